// Floor 2: geodetic coordinates to ECEF and back, for arrays.
// SPDX-License-Identifier: Apache-2.0
#include "floors.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"

namespace liealign::bindings {
namespace {

py::tuple geodetic_columns(const Array& p_e_m) {
  if (p_e_m.ndim() != 2 || p_e_m.shape(1) != 3) throw py::value_error("p_e_m: expected an array of shape (n, 3)");
  const py::ssize_t n = p_e_m.shape(0);
  py::array_t<double> lat_deg(n), lon_deg(n), height_m(n);
  for (py::ssize_t i = 0; i < n; ++i) {
    const Geodetic g = geodetic_from_ecef(get3(p_e_m.data(i, 0)));
    lat_deg.mutable_at(i) = g.lat_rad * kRadToDeg;
    lon_deg.mutable_at(i) = g.lon_rad * kRadToDeg;
    height_m.mutable_at(i) = g.height_m;
  }
  return py::make_tuple(lat_deg, lon_deg, height_m);
}

py::array_t<double> ecef_rows(const Array& lat_deg, const Array& lon_deg, const Array& height_m) {
  if (lat_deg.ndim() != 1 || lon_deg.ndim() != 1 || height_m.ndim() != 1 || lat_deg.size() != lon_deg.size() ||
      lat_deg.size() != height_m.size()) {
    throw py::value_error("lat_deg, lon_deg, height_m: expected three arrays of shape (n,)");
  }
  const py::ssize_t n = lat_deg.size();
  py::array_t<double> p_e_m({n, py::ssize_t{3}});
  for (py::ssize_t i = 0; i < n; ++i) {
    put3(p_e_m.mutable_data(i, 0),
         ecef_from_geodetic({lat_deg.at(i) * kDegToRad, lon_deg.at(i) * kDegToRad, height_m.at(i)}));
  }
  return p_e_m;
}

}  // namespace

void bind_earth(py::module_& m) {
  m.def("geodetic_from_ecef", &geodetic_columns, py::arg("p_e_m"),
        "(lat_deg, lon_deg, height_m), each (n,), of ECEF positions (n, 3) [m]. WGS 84, ellipsoidal height.");
  m.def("ecef_from_geodetic", &ecef_rows, py::arg("lat_deg"), py::arg("lon_deg"), py::arg("height_m"),
        "ECEF positions (n, 3) [m] of geodetic ones, each (n,). WGS 84, ellipsoidal height.");
}

}  // namespace liealign::bindings
