// Floor 7: the configuration. Python values to ConfigEntry and back; the field table does the rest.
// SPDX-License-Identifier: Apache-2.0
#include <tuple>

#include "floors.hpp"
#include "liealign/core/error.hpp"
#include "liealign/pipeline/config.hpp"
#include "liealign/pipeline/config_files.hpp"
#include "liealign/pipeline/field_table.hpp"

namespace liealign::bindings {
namespace {

using EntryTuple = std::tuple<std::string, py::object, std::size_t, std::size_t>;

bool is_bool(py::handle h) { return PyBool_Check(h.ptr()) != 0; }
bool is_int(py::handle h) { return PyLong_Check(h.ptr()) != 0 && !is_bool(h); }
bool is_float(py::handle h) { return PyFloat_Check(h.ptr()) != 0; }

template <typename T>
std::vector<T> cast_all(const py::list& items) {
  std::vector<T> values;
  for (const py::handle item : items) values.push_back(item.cast<T>());
  return values;
}

template <typename Is>
bool all(const py::list& items, const Is& is) {
  for (const py::handle item : items) {
    if (!is(item)) return false;
  }
  return true;
}

// Throws py::cast_error for what TOML has but the field table has not, and for integers beyond 64 bits.
ConfigValue value_from(const py::object& object) {
  if (is_bool(object)) return object.cast<bool>();
  if (is_int(object)) return object.cast<long long>();
  if (is_float(object)) return object.cast<double>();
  if (py::isinstance<py::str>(object)) return object.cast<std::string>();
  if (!py::isinstance<py::list>(object) && !py::isinstance<py::tuple>(object)) throw py::cast_error();
  const py::list items(object);
  if (all(items, is_int)) return cast_all<long long>(items);
  if (all(items, [](py::handle h) { return is_int(h) || is_float(h); })) return cast_all<double>(items);
  if (all(items, [](py::handle h) { return py::isinstance<py::str>(h); })) return cast_all<std::string>(items);
  throw py::cast_error();
}

ConfigEntry entry_from(const EntryTuple& entry, const std::string& source) {
  const auto& [key, value, line, column] = entry;
  try {
    return {key, value_from(value), line, column};
  } catch (const py::cast_error&) {
    std::string where = source.empty() ? "config" : source;
    if (line > 0) where += ":" + std::to_string(line) + ":" + std::to_string(column);
    throw ConfigError(where + ": " + key + " is " + py::repr(value).cast<std::string>() +
                      "; expected true or false, a number, a string, or a list of numbers");
  }
}

Config apply(const Config& base, const std::vector<EntryTuple>& entries, const std::string& source) {
  std::vector<ConfigEntry> translated;
  for (const EntryTuple& entry : entries) translated.push_back(entry_from(entry, source));
  return apply_config(base, translated, source);
}

py::dict values(const Config& config) {
  py::dict all_set;
  for (const ConfigEntry& entry : config_entries(config)) all_set[py::str(entry.key)] = py::cast(entry.value);
  return all_set;
}

}  // namespace

void bind_config(py::module_& m) {
  py::class_<Config>(m, "Config",
                     "Every setting of a run; made by apply_config, never changed. Config() has the defaults.")
      .def(py::init<>())
      .def(
          "__eq__", [](const Config& a, const Config& b) { return dump_config(a) == dump_config(b); },
          py::arg("other"));

  py::class_<ConfigField>(m, "ConfigField", "What the field table says of one key.")
      .def_readonly("key", &ConfigField::key)
      .def_readonly("type", &ConfigField::type)
      .def_readonly("unit", &ConfigField::unit)
      .def_readonly("meaning", &ConfigField::meaning)
      .def_readonly("default_value", &ConfigField::default_value);

  m.def("config_fields", &config_fields, "Every configuration key with type, unit, meaning and default, in order.");
  m.def("apply_config", &apply, py::arg("base"), py::arg("entries"), py::arg("source"),
        "`base` with the entries (key, value, line, column) applied; line 0 = unknown. `source` is the file name for "
        "messages.\n\n"
        "Raises ConfigError for an unknown key (naming the nearest one), a wrong type, a value out of range.");
  m.def("dump_config", &dump_config, py::arg("config"), "FLIGHT.toml text with every key, its unit and its meaning.");
  m.def("config_entries", &values, py::arg("config"),
        "The values by their dotted keys; optional keys that are unset are left out.");
  m.def(
      "did_you_mean",
      [](const std::string& word, const std::vector<std::string>& names) {
        return did_you_mean(nearest_names(word, names));
      },
      py::arg("word"), py::arg("names"),
      "`; did you mean \"a\"?` with the nearest of the names; empty when none is near.");
  m.def("files_from", &files_from, py::arg("toml"), py::arg("config"),
        "`config` as read from the file `toml`, with its file names put behind the folder of that file.");
}

}  // namespace liealign::bindings
