// Floors 5 and 7: simulated flights. Their parameters are keyword arguments named as the fields.
// SPDX-License-Identifier: Apache-2.0
#include "floors.hpp"
#include "liealign/align/heading_search.hpp"
#include "liealign/core/units.hpp"
#include "liealign/estimate/solution.hpp"
#include "liealign/pipeline/simulated_flight.hpp"
#include "liealign/simulate/baro_sensor.hpp"

namespace liealign::bindings {
namespace {

SimulatedFlight simulate_track_arrays(const Array& time_s, const Array& lat_deg, const Array& lon_deg,
                                      const Array& height_m, const Array& rpy_deg, double rate_hz, int oversample,
                                      const GnssErrors& gnss, const Config& config, std::uint64_t seed,
                                      const ImuErrorSizes& imu, const TypedInErrors& typed_in) {
  const std::vector<TrackPoint> track = track_points(time_s, lat_deg, lon_deg, height_m, rpy_deg);
  const py::gil_scoped_release released;
  return simulate_track(track, rate_hz, oversample, gnss, config, seed, imu, typed_in);
}

py::dict truth_columns(const SimulatedFlight& simulated) {
  const Truth& truth = simulated.truth;
  const std::size_t n = truth.epochs.size();
  py::dict d;
  double *t = add_column(d, "time_s", n), *lat = add_column(d, "lat_deg", n), *lon = add_column(d, "lon_deg", n),
         *height = add_column(d, "height_m", n), *v = add_column(d, "v_n_mps", n, {3}),
         *rpy = add_column(d, "rpy_deg", n, {3}), *p_e = add_column(d, "p_eb_e_m", n, {3}),
         *v_e = add_column(d, "v_eb_e_mps", n, {3}), *C = add_column(d, "C_b_e", n, {3, 3}),
         *b_a = add_column(d, "b_a_mps2", n, {3}), *b_g = add_column(d, "b_g_rps", n, {3});
  for (std::size_t i = 0; i < n; ++i) {
    const SE23<double>& X = truth.epochs[i].X;
    Epoch epoch;
    epoch.t_s = truth.epochs[i].t_s;
    epoch.X.first = X;
    const NavRow row = nav_row(epoch);
    t[i] = row.t_s;
    lat[i] = row.lat_rad * kRadToDeg;
    lon[i] = row.lon_rad * kRadToDeg;
    height[i] = row.height_m;
    put3(v + 3 * i, row.v_n_mps);
    put3(rpy + 3 * i, row.rpy_rad, kRadToDeg);
    put3(p_e + 3 * i, X.p);
    put3(v_e + 3 * i, X.v);
    for (int r = 0; r < 3; ++r) put3(C + 9 * i + 3 * static_cast<std::size_t>(r), X.C.row(r));
    put3(b_a + 3 * i, simulated.b_a[i]);
    put3(b_g + 3 * i, simulated.b_g[i]);
  }
  return d;
}

py::dict simulated_baro_columns(const SimulatedFlight& simulated, const BaroErrors& errors, std::uint64_t seed) {
  const std::vector<BaroRecord> records = simulate_baro(simulated.truth, errors, seed);
  py::dict d;
  double *t = add_column(d, "time_s", records.size()), *height = add_column(d, "height_m", records.size()),
         *std_m = add_column(d, "std_m", records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    t[i] = records[i].t_s;
    height[i] = records[i].height_m;
    std_m[i] = records[i].std_m;
  }
  return d;
}

void bind_drone(py::module_& m) {
  using D = DroneFlight;
  py::class_<D>(
      m, "DroneFlight",
      "A multirotor flight: parked, take-off, what its kind says, landing, parked.\n\n"
      "Kinds: survey (lines flown crabwise, then circles), lines, circles, helical, rectangular, hover, parked.")
      .def(py::init(&from_keywords<D>))
      .def_property(
          "kind", [](const D& d) { return flight_kind_name(d.kind); },
          [](D& d, const std::string& name) { d.kind = flight_kind(name); })
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
      .def_readwrite("acceleration_mps2", &D::acceleration_mps2)
      .def_readwrite("line_bearing_deg", &D::line_bearing_deg)
      .def_readwrite("line_length_m", &D::line_length_m)
      .def_readwrite("line_spacing_m", &D::line_spacing_m)
      .def_readwrite("crab_deg", &D::crab_deg)
      .def_readwrite("circle_radius_m", &D::circle_radius_m)
      .def_readwrite("helix_climb_mps", &D::helix_climb_mps)
      .def_readwrite("clockwise", &D::clockwise)
      .def_readwrite("nose_follows", &D::nose_follows)
      .def_readwrite("drag_per_s", &D::drag_per_s)
      .def_readwrite("wind_mps", &D::wind_mps)
      .def_readwrite("wind_from_deg", &D::wind_from_deg)
      .def_readwrite("gust_mps2", &D::gust_mps2)
      .def_readwrite("attitude_wobble_deg", &D::attitude_wobble_deg)
      .def_readwrite("max_tilt_deg", &D::max_tilt_deg)
      .def_readwrite("seed", &D::seed);
}

void bind_errors(py::module_& m) {
  using G = GnssErrors;
  py::class_<G>(m, "GnssErrors",
                "Rate, noise, lever arm, latency, outliers, correlated errors, stamps and steps of simulated fixes. "
                "Vectors are (3,).\n\nSee docs/studies.md; beyond white noise everything is off.")
      .def(py::init(&from_keywords<G>))
      .def_readwrite("std_ned_m", &G::std_ned_m)
      .def_readwrite("rate_hz", &G::rate_hz)
      .def_readwrite("l_ba_b", &G::l_ba_b)
      .def_readwrite("latency_s", &G::latency_s)
      .def_readwrite("velocity", &G::velocity)
      .def_readwrite("velocity_std_ned", &G::velocity_std_ned)
      .def_readwrite("outlier_probability", &G::outlier_probability)
      .def_readwrite("outlier_m", &G::outlier_m)
      .def_readwrite("correlated_std_ned_m", &G::correlated_std_ned_m)
      .def_readwrite("correlation_time_s", &G::correlation_time_s)
      .def_readwrite("smoothing_time_s", &G::smoothing_time_s)
      .def_readwrite("velocity_correlated_std_ned", &G::velocity_correlated_std_ned)
      .def_readwrite("velocity_correlation_time_s", &G::velocity_correlation_time_s)
      .def_readwrite("velocity_latency_s", &G::velocity_latency_s)
      .def_readwrite("stamp_jitter_s", &G::stamp_jitter_s)
      .def_readwrite("arrival_delay_s", &G::arrival_delay_s)
      .def_readwrite("step_ned_m", &G::step_ned_m)
      .def_readwrite("velocity_step_mps", &G::velocity_step_mps)
      .def_readwrite("stated_std_ned_m", &G::stated_std_ned_m)
      .def_readwrite("stated_velocity_std_ned", &G::stated_velocity_std_ned)
      .def_readwrite("stated_std_factor", &G::stated_std_factor)
      .def_readwrite("stated_velocity_std_factor", &G::stated_velocity_std_factor)
      .def_readwrite("heading", &G::heading)
      .def_readwrite("heading_std_deg", &G::heading_std_deg)
      .def_readwrite("stated_heading_std_deg", &G::stated_heading_std_deg)
      .def_readwrite("fix", &G::fix);

  using I = ImuErrorSizes;
  py::class_<I>(m, "ImuErrorSizes",
                "Turn-on biases, scale factors and misalignments of each axis, one sigma; a factor on the noise; "
                "vibration.\n\nturn_on: 'drawn', or 'fixed': of just that size with a sign by the seed.")
      .def(py::init(&from_keywords<I>))
      .def_readwrite("gyro_turn_on_deg_h", &I::gyro_turn_on_deg_h)
      .def_readwrite("accel_turn_on_ug", &I::accel_turn_on_ug)
      .def_readwrite("gyro_scale_ppm", &I::gyro_scale_ppm)
      .def_readwrite("accel_scale_ppm", &I::accel_scale_ppm)
      .def_readwrite("gyro_misalignment_deg", &I::gyro_misalignment_deg)
      .def_readwrite("accel_misalignment_deg", &I::accel_misalignment_deg)
      .def_readwrite("turn_on", &I::turn_on)
      .def_readwrite("noise_scale", &I::noise_scale)
      .def_readwrite("gyro_vibration_deg_s", &I::gyro_vibration_deg_s)
      .def_readwrite("accel_vibration_mps2", &I::accel_vibration_mps2)
      .def_readwrite("vibration_correlation_time_s", &I::vibration_correlation_time_s);

  using T = TypedInErrors;
  py::class_<T>(m, "TypedInErrors",
                "By how much the lever arm (each axis) and the latency of the config are off, one sigma each.")
      .def(py::init(&from_keywords<T>))
      .def_readwrite("lever_arm_std_m", &T::lever_arm_std_m)
      .def_readwrite("latency_std_s", &T::latency_std_s);

  using B = BaroErrors;
  py::class_<B>(m, "BaroErrors", "Noise, rate and wandering offset of a simulated barometer.")
      .def(py::init(&from_keywords<B>))
      .def_readwrite("std_m", &B::std_m)
      .def_readwrite("rate_hz", &B::rate_hz)
      .def_readwrite("bias_sigma_m", &B::bias_sigma_m)
      .def_readwrite("bias_correlation_time_s", &B::bias_correlation_time_s);
}

}  // namespace

std::vector<TrackPoint> track_points(const Array& time_s, const Array& lat_deg, const Array& lon_deg,
                                     const Array& height_m, const Array& rpy_deg) {
  const py::ssize_t n = time_s.size();
  const double *t = rows_of(time_s, "time_s", n, false), *lat = rows_of(lat_deg, "lat_deg", n, false),
               *lon = rows_of(lon_deg, "lon_deg", n, false), *height = rows_of(height_m, "height_m", n, false),
               *rpy = rows_of(rpy_deg, "rpy_deg", n, true);
  std::vector<TrackPoint> track(static_cast<std::size_t>(n));
  for (std::size_t k = 0; k < track.size(); ++k)
    track[k] = {t[k], lat[k] * kDegToRad, lon[k] * kDegToRad, height[k], kDegToRad * get3(rpy + 3 * k)};
  return track;
}

void bind_simulate(py::module_& m) {
  bind_drone(m);

  bind_errors(m);

  py::class_<SimulatedFlight>(m, "SimulatedFlight", "A flight and its truth.")
      .def_readonly("flight", &SimulatedFlight::flight)
      .def("between", &between, py::arg("begin_s"), py::arg("end_s"),
           "Of the same recording, samples, fixes and truth with stamps from begin_s to end_s.\n\n"
           "Raises Error when nothing is left.")
      .def(
          "heading_deg_at",
          [](const SimulatedFlight& s, double t_s) {
            return wrap_2pi(heading_of(NavState<double>{truth_at(s.truth, t_s), {}})) * kRadToDeg;
          },
          py::arg("t_s"), "True heading [deg], [0, 360), at a time within the truth.\n\nRaises Error outside it.")
      .def("truth", &truth_columns,
           "Arrays by name at the IMU stamps: time_s, lat_deg, lon_deg, height_m (n,); v_n_mps, rpy_deg, p_eb_e_m, "
           "v_eb_e_mps,\n"
           "b_a_mps2, b_g_rps (n, 3), the biases with all that they have drifted; C_b_e (n, 3, 3).")
      .def("baro", &simulated_baro_columns, py::arg("errors") = BaroErrors{}, py::kw_only(), py::arg("seed"),
           "Heights of a barometer on this flight (Eq. 76): time_s, height_m, std_m (n,).\n\n"
           "Raises Error for a field out of range.");

  m.def(
      "random_flight",
      [](const std::string& kind, bool gentle, std::uint64_t seed) {
        return random_flight(flight_kind(kind), gentle, seed);
      },
      py::arg("kind"), py::kw_only(), py::arg("gentle") = false, py::arg("seed"),
      "A DroneFlight of that kind with its place, headings, speeds and sizes drawn by the seed.\n\n"
      "5 m/s are reached within 20 s of the take-off; a gentle one accelerates by 0.1 to 0.3 m/s^2 at most. Hover and\n"
      "parked show nothing of the heading. Raises Error for a kind that is none.");
  m.def("simulate_flight",
        py::overload_cast<const DroneFlight&, const GnssErrors&, const Config&, std::uint64_t, const ImuErrorSizes&,
                          const TypedInErrors&>(&simulate_flight),
        py::arg("drone"), py::arg("gnss"), py::arg("config"), py::arg("seed"), py::arg("imu") = ImuErrorSizes{},
        py::arg("typed_in") = TypedInErrors{}, py::call_guard<py::gil_scoped_release>(),
        "IMU noise of the profile in `config`, drifting biases around the turn-on values (TAES table I), GNSS as "
        "given.\n\n"
        "Raises Error for a field out of range or a duration too short for a flight.");
  m.def("simulate_track", &simulate_track_arrays, py::arg("time_s"), py::arg("lat_deg"), py::arg("lon_deg"),
        py::arg("height_m"), py::arg("rpy_deg"), py::arg("rate_hz"), py::arg("oversample"), py::arg("gnss"),
        py::arg("config"), py::arg("seed"), py::arg("imu"), py::arg("typed_in") = TypedInErrors{},
        "The same along points (n,), rpy_deg (n, 3), by splines through them (Eq. 67); liealign.simulate_along.\n\n"
        "Raises Error for points that are no flight, InputError for a wrong shape.");
  m.def("write_flight", &write_flight, py::arg("folder"), py::arg("simulated"),
        py::call_guard<py::gil_scoped_release>(),
        "Writes imu.csv, gnss.csv, truth.csv and FLIGHT.toml into the folder, which is made if need be.");
}

}  // namespace liealign::bindings
