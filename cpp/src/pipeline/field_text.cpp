// The wording of the field table: values as TOML, what a key allows, and the nearest name to a misspelt one.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <utility>

#include "liealign/pipeline/field_table.hpp"

namespace liealign {
namespace {

template <typename Number>
std::string shortest(Number value) {
  std::array<char, 32> buffer{};  // the shortest double takes at most 24 characters
  const std::to_chars_result end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), end.ptr};
}

// A TOML float has a point or an exponent: 5 becomes 5.0, 1e+22 stays.
std::string toml_double(double value) {
  if (std::isnan(value)) return "nan";
  const std::string text = shortest(value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

// A TOML basic string; bytes above 0x7f are UTF-8 and stay.
std::string toml_string(const std::string& value) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string text = "\"";
  for (const char character : value) {
    const auto byte = static_cast<unsigned char>(character);
    switch (character) {
      case '"':
        text += "\\\"";
        break;
      case '\\':
        text += "\\\\";
        break;
      case '\n':
        text += "\\n";
        break;
      case '\r':
        text += "\\r";
        break;
      case '\t':
        text += "\\t";
        break;
      default:
        if (byte < 0x20 || byte == 0x7f) {
          text += "\\u00";
          text += kHex[byte / 16U];
          text += kHex[byte % 16U];
        } else {
          text += character;
        }
    }
  }
  return text + '"';
}

std::string scalar_text(bool value) { return value ? "true" : "false"; }
std::string scalar_text(long long value) { return shortest(value); }
std::string scalar_text(double value) { return toml_double(value); }
std::string scalar_text(const std::string& value) { return toml_string(value); }

template <typename T>
std::string scalar_text(const std::vector<T>& values) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i) {
    text += (i == 0 ? "" : ", ") + scalar_text(values[i]);
  }
  return text + ']';
}

std::string range_text(const Allowed& allowed) {
  const Range* range = std::get_if<Range>(&allowed);
  if (range == nullptr) return "";
  if (std::isinf(range->high)) return (range->low_open ? " > " : " >= ") + shortest(range->low);
  return (range->low_open ? " in (" : " in [") + shortest(range->low) + ", " + shortest(range->high) +
         (range->high_open ? ")" : "]");
}

std::string number_text(const Field& field) {
  // A range already keeps nan and inf out; without one the word must.
  return std::holds_alternative<Range>(field.allowed) ? "number" + range_text(field.allowed) : "finite number";
}

std::string words_text(const Words& words) {
  std::string text;
  for (const std::string_view word : words.allowed) text += (text.empty() ? "" : ", ") + toml_string(std::string(word));
  return text;
}

std::string string_text(const Field& field) {
  if (std::holds_alternative<AxisLetters>(field.allowed)) {
    return "three letters, one of each pair F/B, R/L, D/U, that make a right-handed set, such as \"FRD\" or \"FLU\"";
  }
  const Words* words = std::get_if<Words>(&field.allowed);
  return words == nullptr ? "a string" : "one of " + words_text(*words);
}

struct ExpectedText {
  const Field& field;

  std::string operator()(const Member<bool>&) const { return "true or false"; }
  std::string operator()(const Member<int>&) const { return "a whole number" + range_text(field.allowed); }
  std::string operator()(const Member<std::optional<int>>&) const {
    return "a whole number" + range_text(field.allowed);
  }
  std::string operator()(const Member<double>&) const { return "a " + number_text(field); }
  std::string operator()(const Member<std::optional<double>>&) const {
    return "a " + number_text(field) + (field.unset == Unset::automatic ? " or \"auto\"" : "");
  }
  std::string operator()(const Member<std::string>&) const { return string_text(field); }
  std::string operator()(const Member<std::array<double, 3>>&) const { return "3 numbers" + range_text(field.allowed); }
  std::string operator()(const Member<std::vector<int>>&) const {
    return "a list of at least one whole number" + range_text(field.allowed);
  }
  std::string operator()(const Member<std::vector<std::string>>&) const {
    return "a list of " + words_text(std::get<Words>(field.allowed));
  }
};

char lower(char letter) { return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter; }

// Levenshtein (1966): the fewest insertions, deletions and substitutions that turn a into b; one row at a time.
std::size_t levenshtein(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, diagonal + 1, substituted});
    }
  }
  return row.back();
}

std::size_t name_distance(std::string_view word, std::string_view name) {
  const bool lacks_ending =
      !word.empty() && name.size() > word.size() && name.starts_with(word) && name[word.size()] == '_';
  return lacks_ending ? 1 : levenshtein(word, name);
}

// A third of the letters may be wrong, two always (a swap of neighbours), but never all of them.
std::size_t near_limit(std::string_view word) {
  return word.empty() ? 0 : std::min(word.size() - 1, std::max<std::size_t>(2, word.size() / 3));
}

std::vector<std::string> best_of(const std::vector<std::pair<std::size_t, std::string>>& ranked, std::size_t limit) {
  std::size_t best = limit;
  for (const auto& [distance, name] : ranked) best = std::min(best, distance);
  std::vector<std::string> names;
  for (const auto& [distance, name] : ranked) {
    if (distance == best) names.push_back(name);
  }
  return names;
}

}  // namespace

std::string toml_text(const ConfigValue& value) {
  return std::visit([](const auto& held) { return scalar_text(held); }, value);
}

std::string expected_text(const Field& field) { return std::visit(ExpectedText{field}, field.member); }

Axes classify_axes(std::string_view letters) {
  constexpr std::string_view kLetters = "FBRLDU";  // two by two: along x, y, z of the body, and against
  if (letters.size() != 3) return Axes::malformed;
  std::array<std::size_t, 3> axis{};
  int determinant = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t at = kLetters.find(letters[i]);
    if (at == std::string_view::npos) return Axes::malformed;
    axis[i] = at / 2;
    determinant *= at % 2 == 0 ? 1 : -1;
  }
  if (axis[0] == axis[1] || axis[1] == axis[2] || axis[2] == axis[0]) return Axes::malformed;
  const bool cyclic = (axis[0] + 1) % 3 == axis[1];
  determinant *= cyclic ? 1 : -1;
  return determinant > 0 ? Axes::right_handed : Axes::left_handed;
}

std::vector<std::string> nearest_names(std::string_view word, const std::vector<std::string>& names) {
  std::vector<std::pair<std::size_t, std::string>> ranked;
  ranked.reserve(names.size());
  for (const std::string& name : names) ranked.emplace_back(name_distance(word, name), name);
  return best_of(ranked, near_limit(word));
}

std::vector<std::string> nearest_keys(std::string_view key) {
  const std::string_view section = section_of(key);
  std::vector<std::pair<std::size_t, std::string>> ranked;
  for (const Field& field : field_table()) {
    const bool elsewhere = !section.empty() && section != section_of(field.key);
    ranked.emplace_back(name_distance(member_of(key), member_of(field.key)) + (elsewhere ? 1U : 0U),
                        std::string(field.key));
  }
  return best_of(ranked, near_limit(member_of(key)));
}

std::string did_you_mean(const std::vector<std::string>& names) {
  if (names.empty()) return "";
  std::string text = "; did you mean ";
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : " or ") + toml_string(names[i]);
  return text + '?';
}

}  // namespace liealign
