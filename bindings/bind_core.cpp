// Floor 1: the exception family. Error is a ValueError; the others are Errors.
// SPDX-License-Identifier: Apache-2.0
#include "floors.hpp"
#include "liealign/core/error.hpp"

namespace liealign::bindings {
namespace {

// Tracebacks and pickles name the public module.
template <typename Exception>
py::object add_exception(py::module_& m, const char* name, py::handle base, const char* doc) {
  py::object type = py::register_exception<Exception>(m, name, base);
  type.attr("__module__") = "liealign";
  type.attr("__doc__") = doc;
  return type;
}

}  // namespace

void bind_core(py::module_& m) {
  const py::object error = add_exception<Error>(m, "Error", PyExc_ValueError, "Anything liealign refuses.");
  add_exception<InputError>(m, "InputError", error,
                            "A file or table that cannot be used: file:line:column, value, what is allowed.");
  add_exception<ConfigError>(m, "ConfigError", error, "A configuration key or value that cannot be used.");
  add_exception<NumericalError>(m, "NumericalError", error, "The computation itself failed.");
  add_exception<Cancelled>(m, "Cancelled", error, "The progress callback returned False.");
}

}  // namespace liealign::bindings
