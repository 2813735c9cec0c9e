// FLIGHT.toml to the flat entries that the field table takes: dotted key, value, line, column.
// SPDX-License-Identifier: Apache-2.0
#include "flight_toml.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <tuple>
#include <vector>

#include "liealign/core/error.hpp"
#include "liealign/io/text_file.hpp"
#include "liealign/pipeline/config_files.hpp"

namespace liealign::app {
namespace {

std::string place(const std::string& file, const toml::source_position& at) {
  return file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column);
}

template <typename T>
std::vector<T> list_of(const toml::array& items) {
  std::vector<T> values;
  for (const toml::node& item : items) values.push_back(*item.value<T>());
  return values;
}

// nullopt for what TOML has but the field table has not.
std::optional<ConfigValue> value_from(const toml::node& node) {
  if (const auto* flag = node.as_boolean()) return flag->get();
  if (const auto* whole = node.as_integer()) return static_cast<long long>(whole->get());
  if (const auto* real = node.as_floating_point()) return real->get();
  if (const auto* text = node.as_string()) return text->get();
  const toml::array* items = node.as_array();
  if (items == nullptr) return std::nullopt;
  const auto all = [&](auto is) { return std::all_of(items->begin(), items->end(), is); };
  if (all([](const toml::node& item) { return item.is_integer(); })) return list_of<long long>(*items);
  if (all([](const toml::node& item) { return item.is_number(); })) return list_of<double>(*items);
  if (all([](const toml::node& item) { return item.is_string(); })) return list_of<std::string>(*items);
  return std::nullopt;
}

void add_leaves(const std::string& file, const toml::table& tree, const std::string& prefix,
                std::vector<ConfigEntry>& entries) {
  for (const auto& [name, node] : tree) {
    const std::string key = prefix + std::string(name.str());
    const toml::source_position at = name.source().begin;
    if (const toml::table* section = node.as_table()) {
      add_leaves(file, *section, key + ".", entries);
    } else if (const std::optional<ConfigValue> value = value_from(node)) {
      entries.push_back({key, *value, at.line, at.column});
    } else {
      std::ostringstream text;
      node.visit([&](const auto& held) { text << held; });
      throw ConfigError(place(file, at) + ": " + key + " is " + text.str() +
                        "; expected true or false, a number, a string, or a list of numbers");
    }
  }
}

}  // namespace

Config read_flight_toml(const std::string& file) {
  std::vector<ConfigEntry> entries;
  try {
    add_leaves(file, toml::parse(read_text_file(file), file), "", entries);
  } catch (const toml::parse_error& error) {
    throw ConfigError(place(file, error.source().begin) + ": not valid TOML: " + std::string(error.description()) +
                      "; expected lines such as key = 1.5 or key = \"text\"");
  }
  // toml++ sorts by name; the first error shall be the first in the file.
  std::stable_sort(entries.begin(), entries.end(), [](const ConfigEntry& a, const ConfigEntry& b) {
    return std::tie(a.line, a.column) < std::tie(b.line, b.column);
  });
  return files_from(file, apply_config({}, entries, file));
}

}  // namespace liealign::app
