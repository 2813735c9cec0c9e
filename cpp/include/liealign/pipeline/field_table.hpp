// The field table: one row per configuration key with its unit, its meaning, what is allowed and where the value lives.
// config_fields, apply_config, dump_config and config_entries all read it. A new key is a member in config.hpp and a
// row in field_table.cpp, nothing else. Defaults are not in the table: they are read off a default-made Config.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "liealign/pipeline/config.hpp"

namespace liealign {

// Where a value of type T lives in a Config.
template <typename T>
struct Member {
  const T& (*get)(const Config&);
  T& (*ref)(Config&);
};

using AnyMember = std::variant<Member<bool>, Member<int>, Member<std::optional<int>>, Member<double>,
                               Member<std::optional<double>>, Member<std::string>, Member<std::array<double, 3>>,
                               Member<std::vector<int>>, Member<std::vector<std::string>>>;

// What a value may be, beyond its type. A Range holds for every element of a list.
struct Anything {};  // any string, any finite number
struct Range {
  double low;
  double high;    // infinity: no upper limit
  bool low_open;  // the limit itself is excluded
  bool high_open;
};
struct Words {
  std::vector<std::string_view> allowed;
};
struct AxisLetters {};  // one letter of each pair F/B, R/L, D/U, in any order, right-handed

using Allowed = std::variant<Anything, Range, Words, AxisLetters>;

// What it means that an optional key is not set. Only `automatic` has a word in the file: "auto".
enum class Unset { never, automatic, from_profile, none };

struct Field {
  std::string_view key;      // section.member
  std::string_view unit;     // "" when it has none
  std::string_view meaning;  // one sentence, without full stop
  AnyMember member;
  Allowed allowed = Anything{};
  Unset unset = Unset::never;
};

// Every key, in the order of the struct.
const std::vector<Field>& field_table();

// "imu" and "axes" of "imu.axes"; the section is empty when there is no dot.
std::string_view section_of(std::string_view key);
std::string_view member_of(std::string_view key);

// The sections in the order of the table.
std::vector<std::string> config_sections();

// The value of one key; nullopt when it is optional and unset.
std::optional<ConfigValue> field_value(const Field& field, const Config& config);

// Type and range with its article, as an error says it: "a number > 0 or "auto"".
std::string expected_text(const Field& field);

// The value as TOML on one line; doubles in the shortest form that reads back the same.
std::string toml_text(const ConfigValue& value);

enum class Axes { right_handed, left_handed, malformed };

// Whether three letters such as "FRD" name a set of axes, and its hand.
Axes classify_axes(std::string_view letters);

// The names with the smallest Levenshtein distance to `word` (case ignored), ties included; empty when none is near.
// A name that only goes on after `word` with an underscore (a unit left out) counts as one edit away.
std::vector<std::string> nearest_names(std::string_view word, const std::vector<std::string>& names);

// The same for a dotted key among all the keys; a key of another section counts one edit more.
std::vector<std::string> nearest_keys(std::string_view key);

// `; did you mean "a" or "b"?`, or "" for an empty list.
std::string did_you_mean(const std::vector<std::string>& names);

}  // namespace liealign
