// Floors 4 and 6: simulated flights. Their parameters are keyword arguments named as the fields.
// SPDX-License-Identifier: Apache-2.0
#include "floors.hpp"
#include "liealign/core/units.hpp"
#include "liealign/estimate/solution.hpp"
#include "liealign/pipeline/simulated_flight.hpp"

namespace liealign::bindings {
namespace {

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

py::dict truth_columns(const Truth& truth) {
  const std::size_t n = truth.epochs.size();
  py::dict d;
  double *t = add_column(d, "time_s", n), *lat = add_column(d, "lat_deg", n), *lon = add_column(d, "lon_deg", n),
         *height = add_column(d, "height_m", n), *v = add_column(d, "v_n_mps", n, {3}),
         *rpy = add_column(d, "rpy_deg", n, {3}), *p_e = add_column(d, "p_eb_e_m", n, {3}),
         *v_e = add_column(d, "v_eb_e_mps", n, {3}), *C = add_column(d, "C_b_e", n, {3, 3});
  const Matrix3d none = Matrix3d::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    const SE23<double>& X = truth.epochs[i].X;
    const NavRow row = nav_row({truth.epochs[i].t_s, {X, {}}, none, none, none, Vector3d::Zero(), Vector3d::Zero()});
    t[i] = row.t_s;
    lat[i] = row.lat_rad * kRadToDeg;
    lon[i] = row.lon_rad * kRadToDeg;
    height[i] = row.height_m;
    put3(v + 3 * i, row.v_n_mps);
    put3(rpy + 3 * i, row.rpy_rad, kRadToDeg);
    put3(p_e + 3 * i, X.p);
    put3(v_e + 3 * i, X.v);
    for (int r = 0; r < 3; ++r) put3(C + 9 * i + 3 * static_cast<std::size_t>(r), X.C.row(r));
  }
  return d;
}

void bind_drone(py::module_& m) {
  using D = DroneFlight;
  py::class_<D>(m, "DroneFlight",
                "A multirotor survey flight: parked, take-off, lines flown crabwise, circles, landing, parked.")
      .def(py::init(&from_keywords<D>))
      .def_readwrite("lat_deg", &D::lat_deg)
      .def_readwrite("lon_deg", &D::lon_deg)
      .def_readwrite("height_m", &D::height_m)
      .def_readwrite("rate_hz", &D::rate_hz)
      .def_readwrite("oversample", &D::oversample)
      .def_readwrite("start_time_s", &D::start_time_s)
      .def_readwrite("duration_s", &D::duration_s)
      .def_readwrite("parked_before_s", &D::parked_before_s)
      .def_readwrite("parked_after_s", &D::parked_after_s)
      .def_readwrite("parked_roll_deg", &D::parked_roll_deg)
      .def_readwrite("parked_pitch_deg", &D::parked_pitch_deg)
      .def_readwrite("heading_deg", &D::heading_deg)
      .def_readwrite("speed_mps", &D::speed_mps)
      .def_readwrite("climb_mps", &D::climb_mps)
      .def_readwrite("descent_mps", &D::descent_mps)
      .def_readwrite("altitude_m", &D::altitude_m)
      .def_readwrite("line_bearing_deg", &D::line_bearing_deg)
      .def_readwrite("line_length_m", &D::line_length_m)
      .def_readwrite("line_spacing_m", &D::line_spacing_m)
      .def_readwrite("crab_deg", &D::crab_deg)
      .def_readwrite("drag_per_s", &D::drag_per_s)
      .def_readwrite("gust_mps2", &D::gust_mps2)
      .def_readwrite("attitude_wobble_deg", &D::attitude_wobble_deg)
      .def_readwrite("max_tilt_deg", &D::max_tilt_deg)
      .def_readwrite("seed", &D::seed);
}

}  // namespace

void bind_simulate(py::module_& m) {
  bind_drone(m);

  using G = GnssErrors;
  py::class_<G>(m, "GnssErrors", "Rate, noise, lever arm, latency and outliers of simulated fixes. Vectors are (3,).")
      .def(py::init(&from_keywords<G>))
      .def_readwrite("std_ned_m", &G::std_ned_m)
      .def_readwrite("rate_hz", &G::rate_hz)
      .def_readwrite("l_ba_b", &G::l_ba_b)
      .def_readwrite("latency_s", &G::latency_s)
      .def_readwrite("velocity", &G::velocity)
      .def_readwrite("velocity_std_ned", &G::velocity_std_ned)
      .def_readwrite("outlier_probability", &G::outlier_probability)
      .def_readwrite("outlier_m", &G::outlier_m);

  py::class_<SimulatedFlight>(m, "SimulatedFlight", "A flight and its truth.")
      .def_readonly("flight", &SimulatedFlight::flight)
      .def(
          "truth", [](const SimulatedFlight& s) { return truth_columns(s.truth); },
          "Arrays by name at the IMU stamps: time_s, lat_deg, lon_deg, height_m (n,); v_n_mps, rpy_deg, p_eb_e_m, "
          "v_eb_e_mps (n, 3);\n"
          "C_b_e (n, 3, 3).");

  m.def(
      "simulate_flight", &simulate_flight, py::arg("drone"), py::arg("gnss"), py::arg("config"), py::arg("seed"),
      py::call_guard<py::gil_scoped_release>(),
      "IMU noise of the profile in `config`, drifting biases around a turn-on value (TAES table I), GNSS as given.\n\n"
      "Raises Error for a field out of range or a duration too short for a flight.");
  m.def("write_flight", &write_flight, py::arg("folder"), py::arg("simulated"),
        py::call_guard<py::gil_scoped_release>(),
        "Writes imu.csv, gnss.csv, truth.csv and FLIGHT.toml into the folder, which is made if need be.");
}

}  // namespace liealign::bindings
