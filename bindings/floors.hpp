// What the binding files share: one function per floor, progress callbacks, and numpy columns.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "liealign/core/error.hpp"
#include "liealign/core/progress.hpp"
#include "liealign/core/types.hpp"
#include "liealign/simulate/track_reference.hpp"

namespace liealign::bindings {

namespace py = pybind11;

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

// In this order: a function or class names the types of the floors below in its signature.
void bind_core(py::module_& m);
void bind_earth(py::module_& m);
void bind_profiles(py::module_& m);
void bind_config(py::module_& m);
void bind_align(py::module_& m);
void bind_flight(py::module_& m);
void bind_pipeline(py::module_& m);
void bind_simulate(py::module_& m);
void bind_study(py::module_& m);

// Calls the Python callable with the GIL; what it raises passes through, False cancels. Ctrl-C is seen here as well,
// also without a callable. `callback` must outlive the result.
inline Progress progress_from(const py::object& callback) {
  return [&callback](std::size_t done, std::size_t total) {
    py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (callback.is_none()) return true;
    const py::object answer = callback(done, total);
    return !(py::isinstance<py::bool_>(answer) && !answer.cast<bool>());
  };
}

// A new numpy array in `columns`, (n,) or (n, more...); returns its data, row-major.
inline double* add_column(py::dict& columns, const char* name, std::size_t n, std::vector<py::ssize_t> more = {}) {
  more.insert(more.begin(), static_cast<py::ssize_t>(n));
  py::array_t<double> array(std::move(more));
  columns[name] = array;
  return array.mutable_data();
}

// Rows of a (n,) or (n, 3) array. Throws InputError for another shape.
inline const double* rows_of(const Array& array, const char* name, py::ssize_t n, bool three) {
  const bool fits = three ? array.ndim() == 2 && array.shape(0) == n && array.shape(1) == 3
                          : array.ndim() == 1 && array.shape(0) == n;
  if (!fits) {
    throw InputError(std::string(name) + ": expected an array of shape (" + std::to_string(n) +
                     (three ? ", 3)" : ",)") + ", one row for each time");
  }
  return array.data();
}

inline void put3(double* to, const Vector3d& v, double factor = 1.0) {
  for (int i = 0; i < 3; ++i) to[i] = factor * v[i];
}

inline Vector3d get3(const double* from) { return {from[0], from[1], from[2]}; }

// A struct whose fields were bound by def_readwrite, from keyword arguments.
template <typename Struct>
Struct from_keywords(const py::kwargs& fields) {
  Struct made;
  const py::object view = py::cast(&made, py::return_value_policy::reference);
  for (const auto& [name, value] : fields) {
    const std::string field = py::str(name);
    if (!py::hasattr(view, field.c_str())) throw py::type_error("unexpected keyword argument '" + field + "'");
    py::setattr(view, field.c_str(), py::reinterpret_borrow<py::object>(value));
  }
  return made;
}

// Points from columns of one length, angles in degrees; rpy_deg (n, 3).
std::vector<TrackPoint> track_points(const Array& time_s, const Array& lat_deg, const Array& lon_deg,
                                     const Array& height_m, const Array& rpy_deg);

}  // namespace liealign::bindings
