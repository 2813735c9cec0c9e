// The configuration in and out: FLIGHT.toml's leaves to the Config struct and back, driven by the field table.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/config.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "liealign/core/error.hpp"
#include "liealign/pipeline/field_table.hpp"

namespace liealign {
namespace {

constexpr std::string_view kAuto = "auto";

// ---- reading one value -------------------------------------------------------------------------------------------
// Each `read` fills `out` and returns true, or returns false and leaves `out` alone. A bool is never a number.

bool in_range(const Allowed& allowed, double value) {
  const Range* range = std::get_if<Range>(&allowed);
  if (!std::isfinite(value)) return false;
  if (range == nullptr) return true;
  return (range->low_open ? value > range->low : value >= range->low) &&
         (range->high_open ? value < range->high : value <= range->high);
}

bool fits_int(long long value) {
  return value >= std::numeric_limits<int>::min() && value <= std::numeric_limits<int>::max();
}

bool read(const Field&, const ConfigValue& value, bool& out) {
  const bool* held = std::get_if<bool>(&value);
  if (held != nullptr) out = *held;
  return held != nullptr;
}

bool read(const Field& field, const ConfigValue& value, int& out) {
  const long long* held = std::get_if<long long>(&value);
  if (held == nullptr || !fits_int(*held) || !in_range(field.allowed, static_cast<double>(*held))) return false;
  out = static_cast<int>(*held);
  return true;
}

bool read(const Field& field, const ConfigValue& value, double& out) {
  double number = std::numeric_limits<double>::quiet_NaN();
  if (const double* real = std::get_if<double>(&value)) number = *real;
  if (const long long* whole = std::get_if<long long>(&value)) number = static_cast<double>(*whole);
  if (!in_range(field.allowed, number)) return false;
  out = number;
  return true;
}

bool read(const Field& field, const ConfigValue& value, std::optional<double>& out) {
  const std::string* word = std::get_if<std::string>(&value);
  if (field.unset == Unset::automatic && word != nullptr && *word == kAuto) {
    out = std::nullopt;
    return true;
  }
  double number = 0.0;
  if (!read(field, value, number)) return false;
  out = number;
  return true;
}

bool read(const Field& field, const ConfigValue& value, std::optional<int>& out) {
  int number = 0;
  if (!read(field, value, number)) return false;
  out = number;
  return true;
}

bool is_allowed(const Allowed& allowed, const std::string& word) {
  const Words* words = std::get_if<Words>(&allowed);
  return words == nullptr || std::find(words->allowed.begin(), words->allowed.end(), word) != words->allowed.end();
}

bool read(const Field& field, const ConfigValue& value, std::string& out) {
  const std::string* held = std::get_if<std::string>(&value);
  if (held == nullptr || !is_allowed(field.allowed, *held)) return false;
  if (std::holds_alternative<AxisLetters>(field.allowed) && classify_axes(*held) != Axes::right_handed) return false;
  out = *held;
  return true;
}

bool read(const Field& field, const ConfigValue& value, std::array<double, 3>& out) {
  std::vector<double> numbers;
  if (const auto* reals = std::get_if<std::vector<double>>(&value)) numbers = *reals;
  if (const auto* wholes = std::get_if<std::vector<long long>>(&value)) {
    for (const long long whole : *wholes) numbers.push_back(static_cast<double>(whole));
  }
  const auto allowed = [&](double number) { return in_range(field.allowed, number); };
  if (numbers.size() != out.size() || !std::all_of(numbers.begin(), numbers.end(), allowed)) return false;
  std::copy(numbers.begin(), numbers.end(), out.begin());
  return true;
}

bool read(const Field& field, const ConfigValue& value, std::vector<int>& out) {
  const auto* held = std::get_if<std::vector<long long>>(&value);
  if (held == nullptr || held->empty()) return false;
  std::vector<int> numbers;
  for (const long long number : *held) {
    if (!fits_int(number) || !in_range(field.allowed, static_cast<double>(number))) return false;
    numbers.push_back(static_cast<int>(number));
  }
  out = numbers;
  return true;
}

bool read(const Field& field, const ConfigValue& value, std::vector<std::string>& out) {
  const auto* held = std::get_if<std::vector<std::string>>(&value);
  const auto allowed = [&](const std::string& word) { return is_allowed(field.allowed, word); };
  if (held == nullptr || held->empty() || !std::all_of(held->begin(), held->end(), allowed)) return false;
  out = *held;
  return true;
}

// ---- the value of a member ---------------------------------------------------------------------------------------

std::optional<ConfigValue> value_of(bool member) { return member; }
std::optional<ConfigValue> value_of(int member) { return static_cast<long long>(member); }
std::optional<ConfigValue> value_of(double member) { return member; }
std::optional<ConfigValue> value_of(const std::string& member) { return member; }
std::optional<ConfigValue> value_of(const std::array<double, 3>& member) {
  return std::vector<double>(member.begin(), member.end());
}
std::optional<ConfigValue> value_of(const std::vector<int>& member) {
  return std::vector<long long>(member.begin(), member.end());
}
std::optional<ConfigValue> value_of(const std::vector<std::string>& member) { return member; }
template <typename T>
std::optional<ConfigValue> value_of(const std::optional<T>& member) {
  return member ? value_of(*member) : std::nullopt;
}

// ---- errors: source:line:column: what was wrong; what is allowed -------------------------------------------------

std::string quoted(std::string_view text) { return toml_text(std::string(text)); }

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

[[noreturn]] void refuse(const ConfigEntry& entry, const std::string& source, const std::string& what) {
  std::string where = source.empty() ? "config" : source;
  if (entry.line > 0) where += ':' + std::to_string(entry.line);
  if (entry.line > 0 && entry.column > 0) where += ':' + std::to_string(entry.column);
  throw ConfigError(where + ": " + what);
}

std::string keys_of(std::string_view section) {
  std::vector<std::string> keys;
  for (const Field& field : field_table()) {
    if (section_of(field.key) == section) keys.emplace_back(member_of(field.key));
  }
  return "the keys of [" + std::string(section) + "] are " + joined(keys);
}

[[noreturn]] void refuse_unknown(const ConfigEntry& entry, const std::string& source) {
  const std::vector<std::string> sections = config_sections();
  const auto is_section = [&](std::string_view name) {
    return std::find(sections.begin(), sections.end(), name) != sections.end();
  };
  const std::string section(section_of(entry.key));
  const std::string all_sections = "the sections are " + joined(sections);

  if (is_section(entry.key)) {
    refuse(entry, source, entry.key + " is " + toml_text(entry.value) + "; expected a section: " + keys_of(entry.key));
  }
  const std::string near_keys = did_you_mean(nearest_keys(entry.key));
  if (section.empty()) {
    refuse(entry, source,
           "unknown key " + quoted(entry.key) + " outside any section" +
               (near_keys.empty() ? "; " + all_sections : near_keys));
  }
  if (!is_section(section)) {
    const std::string near_sections = did_you_mean(nearest_names(section, sections));
    const std::string hint = near_sections.empty() ? near_keys : near_sections;
    refuse(entry, source,
           "unknown section " + quoted(section) + " in key " + quoted(entry.key) +
               (hint.empty() ? "; " + all_sections : hint));
  }
  refuse(entry, source, "unknown key " + quoted(entry.key) + (near_keys.empty() ? "; " + keys_of(section) : near_keys));
}

// The three sets that differ from a left-handed one by one axis turned around.
std::string turned_axes(const std::string& letters) {
  constexpr std::string_view kLetters = "FBRLDU";
  std::vector<std::string> sets;
  for (std::size_t i = 0; i < letters.size(); ++i) {
    std::string turned = letters;
    turned[i] = kLetters[kLetters.find(letters[i]) ^ 1U];
    sets.push_back(quoted(turned));
  }
  return joined(sets);
}

[[noreturn]] void refuse_value(const Field& field, const ConfigEntry& entry, const std::string& source) {
  const std::string* word = std::get_if<std::string>(&entry.value);
  const std::string what = entry.key + " is " + toml_text(entry.value);
  if (word != nullptr && std::holds_alternative<AxisLetters>(field.allowed) &&
      classify_axes(*word) == Axes::left_handed) {
    refuse(entry, source,
           what + ", a left-handed set of axes; expected a right-handed one, such as " + turned_axes(*word) +
               " with one axis turned around");
  }
  std::vector<std::string> words;
  if (const Words* listed = std::get_if<Words>(&field.allowed))
    words.assign(listed->allowed.begin(), listed->allowed.end());
  if (field.unset == Unset::automatic) words.emplace_back(kAuto);
  const std::string hint = word == nullptr ? "" : did_you_mean(nearest_names(*word, words));

  const long long* whole = std::get_if<long long>(&entry.value);
  const bool too_big =
      std::holds_alternative<Member<int>>(field.member) && whole != nullptr && *whole > 0 && !fits_int(*whole);
  const std::string limit = too_big ? ", at most " + std::to_string(std::numeric_limits<int>::max()) : "";
  refuse(entry, source, what + "; expected " + expected_text(field) + limit + hint);
}

void refuse_repeated(const std::vector<ConfigEntry>& entries, std::size_t at, const std::string& source) {
  const auto here = entries.begin() + static_cast<std::ptrdiff_t>(at);
  const auto first =
      std::find_if(entries.begin(), here, [&](const ConfigEntry& entry) { return entry.key == here->key; });
  if (first == here) return;
  const std::string on_line = first->line > 0 ? " (first on line " + std::to_string(first->line) + ")" : "";
  refuse(*here, source, here->key + " is given twice" + on_line + "; give it once");
}

// ---- one key of the dump -----------------------------------------------------------------------------------------

std::string type_text(const Field& field) {
  const std::string expected = expected_text(field);
  return expected.starts_with("a ") ? expected.substr(2) : expected;
}

// The value as TOML; nullopt when the key is unset and has no word for that.
std::optional<std::string> value_text(const Field& field, const Config& config) {
  if (const std::optional<ConfigValue> value = field_value(field, config)) return toml_text(*value);
  if (field.unset == Unset::automatic) return quoted(kAuto);
  return std::nullopt;
}

std::string dump_field(const Field& field, const Config& config) {
  const std::string unit = field.unit.empty() ? "" : " [" + std::string(field.unit) + "]";
  const std::string comment = "# " + std::string(field.meaning) + unit + "; " + type_text(field) + ".\n";
  const std::string key(member_of(field.key));
  const std::optional<std::string> value = value_text(field, config);
  if (value) return comment + key + " = " + *value + '\n';
  return comment + "# " + key + " = ...  # " + (field.unset == Unset::from_profile ? "from the profile" : "none") +
         '\n';
}

}  // namespace

std::optional<ConfigValue> field_value(const Field& field, const Config& config) {
  return std::visit([&](const auto& member) { return value_of(member.get(config)); }, field.member);
}

std::vector<ConfigField> config_fields() {
  const Config defaults;
  std::vector<ConfigField> fields;
  for (const Field& field : field_table()) {
    const std::string value = value_text(field, defaults).value_or("");
    fields.push_back({std::string(field.key), type_text(field), std::string(field.unit), std::string(field.meaning),
                      value == quoted("") ? "" : value});
  }
  return fields;
}

Config apply_config(const Config& base, const std::vector<ConfigEntry>& entries, const std::string& source) {
  Config config = base;
  const std::vector<Field>& table = field_table();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const ConfigEntry& entry = entries[i];
    const auto field = std::find_if(table.begin(), table.end(), [&](const Field& row) { return row.key == entry.key; });
    if (field == table.end()) refuse_unknown(entry, source);
    refuse_repeated(entries, i, source);
    const auto read_member = [&](const auto& member) { return read(*field, entry.value, member.ref(config)); };
    if (!std::visit(read_member, field->member)) refuse_value(*field, entry, source);
  }
  return config;
}

std::string dump_config(const Config& config) {
  std::string text = "# liealign configuration, every key written out. A commented key is not set.\n";
  std::string_view section;
  for (const Field& field : field_table()) {
    if (section_of(field.key) != section) {
      section = section_of(field.key);
      text += "\n[" + std::string(section) + "]\n";
    }
    text += dump_field(field, config);
  }
  return text;
}

std::vector<ConfigEntry> config_entries(const Config& config) {
  std::vector<ConfigEntry> entries;
  for (const Field& field : field_table()) {
    if (std::optional<ConfigValue> value = field_value(field, config)) {
      entries.push_back({std::string(field.key), *value});
    }
  }
  return entries;
}

}  // namespace liealign
