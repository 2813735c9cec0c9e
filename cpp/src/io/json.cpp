// The JSON tree as text (RFC 8259).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/io/json.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace liealign {
namespace {

template <typename Number>
void append_number(Number number, std::string& out) {
  char digits[32];  // the longest shortest double has 24 characters
  out.append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

// Length of the UTF-8 character that starts at `at`, or 0 where the bytes are none (RFC 3629, section 4).
std::size_t utf8_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0U; };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF5 ? 4 : 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
  }
  const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
  const bool surrogate = first == 0xED && byte(1) > 0x9F;
  const bool above_unicode = first == 0xF4 && byte(1) > 0x8F;
  return overlong || surrogate || above_unicode ? 0 : length;
}

void append_ascii(char c, std::string& out) {
  constexpr std::string_view kHex = "0123456789abcdef";
  switch (c) {
    case '"':
      out += "\\\"";
      return;
    case '\\':
      out += "\\\\";
      return;
    case '\b':
      out += "\\b";
      return;
    case '\f':
      out += "\\f";
      return;
    case '\n':
      out += "\\n";
      return;
    case '\r':
      out += "\\r";
      return;
    case '\t':
      out += "\\t";
      return;
    default:
      break;
  }
  if (c >= 0x20) {
    out += c;
  } else {
    out += "\\u00";
    out += kHex[static_cast<std::size_t>(c) >> 4U];
    out += kHex[static_cast<std::size_t>(c) & 0xFU];
  }
}

void append_string(std::string_view text, std::string& out) {
  out += '"';
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(text, at);
    if (length == 0) {
      out += "\xEF\xBF\xBD";  // U+FFFD, the replacement character
    } else if (length == 1) {
      append_ascii(text[at], out);
    } else {
      out += text.substr(at, length);
    }
    at += std::max<std::size_t>(length, 1);
  }
  out += '"';
}

bool is_plain_number(const Json& json) {
  return std::holds_alternative<std::nullptr_t>(json.value) || std::holds_alternative<std::int64_t>(json.value) ||
         std::holds_alternative<double>(json.value);
}

// Appends values to `out`, one overload for each kind of value.
struct Dumper {
  std::string& out;
  int indent;  // spaces per level; 0: one line
  int level = 0;

  void operator()(std::nullptr_t) { out += "null"; }
  void operator()(bool b) { out += b ? "true" : "false"; }
  void operator()(std::int64_t i) { append_number(i, out); }
  void operator()(double x) {
    if (std::isfinite(x)) {
      append_number(x, out);
    } else {
      out += "null";
    }
  }
  void operator()(const std::string& text) { append_string(text, out); }
  void operator()(const JsonArray& items) {
    const bool one_line = indent == 0 || std::all_of(items.begin(), items.end(), is_plain_number);
    append_list('[', items, ']', one_line, [this](const Json& item) { std::visit(*this, item.value); });
  }
  void operator()(const JsonObject& members) {
    append_list('{', members, '}', indent == 0 || members.empty(), [this](const JsonMember& member) {
      append_string(member.key, out);
      out += ": ";
      std::visit(*this, member.value.value);
    });
  }

  template <typename List, typename AppendItem>
  void append_list(char open, const List& list, char close, bool one_line, const AppendItem& append_item) {
    out += open;
    ++level;
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (i > 0) out += one_line ? ", " : ",";
      if (!one_line) new_line();
      append_item(list[i]);
    }
    --level;
    if (!one_line) new_line();
    out += close;
  }

  void new_line() {
    out += '\n';
    out.append(static_cast<std::size_t>(level) * static_cast<std::size_t>(indent), ' ');
  }
};

}  // namespace

Json& Json::operator[](std::string_view key) {
  if (std::holds_alternative<std::nullptr_t>(value)) value = JsonObject{};
  JsonObject* const members = std::get_if<JsonObject>(&value);
  if (members == nullptr) throw Error("JSON key \"" + std::string(key) + "\" asked of a value that is not an object");
  for (JsonMember& member : *members) {
    if (member.key == key) return member.value;
  }
  members->push_back({std::string(key), Json()});
  return members->back().value;
}

void Json::push_back(Json item) {
  if (std::holds_alternative<std::nullptr_t>(value)) value = JsonArray{};
  JsonArray* const items = std::get_if<JsonArray>(&value);
  if (items == nullptr) throw Error("JSON item appended to a value that is not an array");
  items->push_back(std::move(item));
}

std::string dump_json(const Json& json, int indent) {
  std::string out;
  std::visit(Dumper{out, std::max(indent, 0)}, json.value);
  return out;
}

}  // namespace liealign
