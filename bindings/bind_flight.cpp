// Floor 7: a flight as read and as the filters take it, from files and from arrays; the candidate bank over it.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <vector>

#include "floors.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/pipeline/clock.hpp"
#include "liealign/pipeline/flight.hpp"

namespace liealign::bindings {
namespace {

using OptionalArray = std::optional<Array>;

const double* optional_rows_of(const OptionalArray& array, const char* name, py::ssize_t n, bool three) {
  return array ? rows_of(*array, name, n, three) : nullptr;
}

ImuSeries imu_series(const Array& time_s, const Array& omega, const Array& f) {
  const py::ssize_t n = time_s.size();
  const double *t = rows_of(time_s, "imu_time_s", n, false), *w = rows_of(omega, "omega_ib_b_rps", n, true),
               *a = rows_of(f, "f_ib_b_mps2", n, true);
  ImuSeries imu(static_cast<std::size_t>(n));
  for (std::size_t k = 0; k < imu.size(); ++k) imu[k] = {t[k], get3(w + 3 * k), get3(a + 3 * k)};
  return imu;
}

// Heights of a barometer; none without times.
std::vector<BaroRecord> baro_records(const OptionalArray& time_s, const OptionalArray& height_m,
                                     const OptionalArray& std_m) {
  if (!time_s) return {};
  const py::ssize_t n = time_s->size();
  const double *t = rows_of(*time_s, "baro_time_s", n, false),
               *height = optional_rows_of(height_m, "baro_height_m", n, false),
               *std = optional_rows_of(std_m, "baro_std_m", n, false);
  if (height == nullptr) throw InputError("baro_time_s is given without baro_height_m; expected both or neither");
  std::vector<BaroRecord> baro(static_cast<std::size_t>(n));
  for (std::size_t k = 0; k < baro.size(); ++k) {
    BaroRecord& r = baro[k];
    r.t_s = t[k];
    r.height_m = height[k];
    r.has_std = std != nullptr && std::isfinite(std[k]);
    if (r.has_std) r.std_m = std[k];
  }
  return baro;
}

Flight flight_from_arrays(const Config& config, const Array& imu_time_s, const Array& omega_ib_b_rps,
                          const Array& f_ib_b_mps2, const Array& gnss_time_s, const Array& lat_deg,
                          const Array& lon_deg, const Array& height_m, const Array& std_p_n_m,
                          const OptionalArray& cov_p_n_m2, const OptionalArray& v_n_mps,
                          const OptionalArray& std_v_n_mps, const OptionalArray& fix, const OptionalArray& heading_deg,
                          const OptionalArray& std_heading_deg, const OptionalArray& baro_time_s,
                          const OptionalArray& baro_height_m, const OptionalArray& baro_std_m) {
  Flight flight;
  flight.config = config;
  flight.imu = imu_series(imu_time_s, omega_ib_b_rps, f_ib_b_mps2);
  const py::ssize_t n = gnss_time_s.size();
  const double *t = rows_of(gnss_time_s, "gnss_time_s", n, false), *lat = rows_of(lat_deg, "lat_deg", n, false),
               *lon = rows_of(lon_deg, "lon_deg", n, false), *height = rows_of(height_m, "height_m", n, false),
               *std = rows_of(std_p_n_m, "std_p_n_m", n, true),
               *cov = optional_rows_of(cov_p_n_m2, "cov_p_n_m2", n, true),
               *v = optional_rows_of(v_n_mps, "v_n_mps", n, true),
               *std_v = optional_rows_of(std_v_n_mps, "std_v_n_mps", n, true),
               *q = optional_rows_of(fix, "fix", n, false),
               *heading = optional_rows_of(heading_deg, "heading_deg", n, false),
               *std_heading = optional_rows_of(std_heading_deg, "std_heading_deg", n, false);
  flight.gnss.resize(static_cast<std::size_t>(n));
  for (std::size_t k = 0; k < flight.gnss.size(); ++k) {
    GnssRecord& r = flight.gnss[k];
    r.t_s = t[k];
    r.lat_rad = lat[k] * kDegToRad;
    r.lon_rad = lon[k] * kDegToRad;
    r.height_m = height[k];
    r.P_n_m2 = get3(std + 3 * k).cwiseAbs2().asDiagonal();
    if (cov != nullptr) {
      r.P_n_m2(0, 1) = r.P_n_m2(1, 0) = cov[3 * k];
      r.P_n_m2(0, 2) = r.P_n_m2(2, 0) = cov[3 * k + 1];
      r.P_n_m2(1, 2) = r.P_n_m2(2, 1) = cov[3 * k + 2];
    }
    r.has_velocity = v != nullptr && std::isfinite(v[3 * k]);
    if (r.has_velocity) r.v_n_mps = get3(v + 3 * k);
    r.has_velocity_std = r.has_velocity && std_v != nullptr;
    if (r.has_velocity_std) r.std_v_n_mps = get3(std_v + 3 * k);
    if (q != nullptr) r.fix = static_cast<int>(q[k]);
    r.has_heading = heading != nullptr && std_heading != nullptr && std::isfinite(heading[k]);
    if (r.has_heading) {
      r.heading_rad = heading[k] * kDegToRad;
      r.std_heading_rad = std_heading[k] * kDegToRad;
    }
  }
  flight.baro = baro_records(baro_time_s, baro_height_m, baro_std_m);
  return flight;
}

py::dict imu_columns(const Flight& flight) {
  const std::size_t n = flight.imu.size();
  py::dict columns;
  double *t = add_column(columns, "time_s", n), *w = add_column(columns, "omega_ib_b_rps", n, {3}),
         *f = add_column(columns, "f_ib_b_mps2", n, {3});
  for (std::size_t k = 0; k < n; ++k) {
    t[k] = flight.imu[k].t_s;
    put3(w + 3 * k, flight.imu[k].omega_ib_b);
    put3(f + 3 * k, flight.imu[k].f_ib_b);
  }
  return columns;
}

py::dict gnss_columns(const Flight& flight) {
  const std::size_t n = flight.gnss.size();
  py::dict columns;
  double *t = add_column(columns, "time_s", n), *lat = add_column(columns, "lat_deg", n),
         *lon = add_column(columns, "lon_deg", n), *height = add_column(columns, "height_m", n),
         *P = add_column(columns, "P_n_m2", n, {3, 3}), *v = add_column(columns, "v_n_mps", n, {3}),
         *std_v = add_column(columns, "std_v_n_mps", n, {3}), *fix = add_column(columns, "fix", n),
         *heading = add_column(columns, "heading_deg", n), *std_heading = add_column(columns, "std_heading_deg", n);
  const Vector3d absent = Vector3d::Constant(std::nan(""));
  for (std::size_t k = 0; k < n; ++k) {
    const GnssRecord& r = flight.gnss[k];
    t[k] = r.t_s;
    lat[k] = r.lat_rad * kRadToDeg;
    lon[k] = r.lon_rad * kRadToDeg;
    height[k] = r.height_m;
    for (int i = 0; i < 3; ++i) put3(P + 9 * k + 3 * static_cast<std::size_t>(i), r.P_n_m2.row(i));
    put3(v + 3 * k, r.has_velocity ? r.v_n_mps : absent);
    put3(std_v + 3 * k, r.has_velocity_std ? r.std_v_n_mps : absent);
    fix[k] = r.fix;
    heading[k] = r.has_heading ? r.heading_rad * kRadToDeg : std::nan("");
    std_heading[k] = r.has_heading ? r.std_heading_rad * kRadToDeg : std::nan("");
  }
  return columns;
}

py::dict baro_columns(const Flight& flight) {
  const std::size_t n = flight.baro.size();
  py::dict columns;
  double *t = add_column(columns, "time_s", n), *height = add_column(columns, "height_m", n),
         *std = add_column(columns, "std_m", n);
  for (std::size_t k = 0; k < n; ++k) {
    const BaroRecord& r = flight.baro[k];
    t[k] = r.t_s;
    height[k] = r.height_m;
    std[k] = r.has_std ? r.std_m : std::nan("");
  }
  return columns;
}

template <typename Period>
py::array_t<double> spans(const std::vector<Period>& periods) {
  py::array_t<double> array({static_cast<py::ssize_t>(periods.size()), py::ssize_t{2}});
  double* to = array.mutable_data();
  for (const Period& p : periods) {
    *to++ = p.begin_s;
    *to++ = p.end_s;
  }
  return array;
}

void bind_raw_flight(py::module_& m) {
  py::class_<Flight>(m, "Flight", "A flight as logged: configuration, IMU samples, GNSS records, warnings.")
      .def(py::init(&flight_from_arrays), py::kw_only(), py::arg("config"), py::arg("imu_time_s"),
           py::arg("omega_ib_b_rps"), py::arg("f_ib_b_mps2"), py::arg("gnss_time_s"), py::arg("lat_deg"),
           py::arg("lon_deg"), py::arg("height_m"), py::arg("std_p_n_m"), py::arg("cov_p_n_m2") = py::none(),
           py::arg("v_n_mps") = py::none(), py::arg("std_v_n_mps") = py::none(), py::arg("fix") = py::none(),
           py::arg("heading_deg") = py::none(), py::arg("std_heading_deg") = py::none(),
           py::arg("baro_time_s") = py::none(), py::arg("baro_height_m") = py::none(),
           py::arg("baro_std_m") = py::none(),
           "From arrays: times (n,), vectors (n, 3), NED; covariances (n, 3) are NE, ND, ED. A row of v_n_mps or "
           "heading_deg that is NaN has none.\n\n"
           "Only shapes are checked here (InputError); liealign.flight_from_arrays checks the values too.")
      .def_readonly("config", &Flight::config)
      .def(
          "with_config",
          [](const Flight& flight, const Config& config) {
            Flight other = flight;
            other.config = config;
            return other;
          },
          py::arg("config"), "The same log under another configuration; files that it names are not read again.")
      .def_readonly("warnings", &Flight::warnings)
      .def("imu", &imu_columns, "time_s (n,), omega_ib_b_rps (n, 3), f_ib_b_mps2 (n, 3), as logged.")
      .def("gnss", &gnss_columns,
           "time_s, lat_deg, lon_deg, height_m, fix (n,); P_n_m2 (n, 3, 3); v_n_mps, std_v_n_mps (n, 3), heading_deg, "
           "std_heading_deg (n,), NaN where absent.")
      .def("baro", &baro_columns, "time_s, height_m, std_m (n,), NaN where absent; n is 0 without baro.file.");

  m.def("read_flight", &read_flight, py::arg("config"), py::call_guard<py::gil_scoped_release>(),
        "Reads imu.file, gnss.file and, where given, baro.file. Raises InputError (file:line:column) or ConfigError "
        "when a file is not named.");
}

void bind_coarse(py::module_& m) {
  using M = CoarseMode;
  py::class_<M>(m, "CoarseMode", "A heading at the start with the GNSS latency that goes with it; weight: its share.")
      .def_readonly("heading_rad", &M::heading_rad)
      .def_readonly("heading_std_rad", &M::heading_std_rad)
      .def_readonly("latency_s", &M::latency_s, "Beyond that of the prepared flight.")
      .def_readonly("latency_std_s", &M::latency_std_s)
      .def_readonly("weight", &M::weight);
  using W = CoarseWindow;
  py::class_<W>(m, "CoarseWindow", "What a window of a minute says by itself; its latency is beyond the one given.")
      .def_readonly("begin_s", &W::begin_s)
      .def_readonly("end_s", &W::end_s)
      .def_readonly("heading_rad", &W::heading_rad)
      .def_readonly("heading_std_rad", &W::heading_std_rad)
      .def_readonly("latency_s", &W::latency_s)
      .def_readonly("modulus", &W::modulus, "Of the correlation of horizontal accelerations, 0 to 1.")
      .def_readonly("excitation_mps2", &W::excitation_mps2);
  using C = CoarseAlignment;
  py::class_<C>(m, "CoarseAlignment", "Heading, tilt and latency before any filter runs.")
      .def_readonly("modes", &C::modes, "The heaviest first; empty where the motion shows no heading.")
      .def_readonly("windows", &C::windows)
      .def_readonly("roll_rad", &C::roll_rad)
      .def_readonly("pitch_rad", &C::pitch_rad)
      .def_readonly("tilt_std_rad", &C::tilt_std_rad)
      .def_readonly("b_g_std_rps", &C::b_g_std_rps);
}

}  // namespace

void bind_flight(py::module_& m) {
  bind_raw_flight(m);
  bind_coarse(m);

  py::class_<PreparedFlight>(m, "PreparedFlight",
                             "A flight as the filters take it. Read only; times are true times [s].")
      .def_readonly("config", &PreparedFlight::config)
      .def_readonly("warnings", &PreparedFlight::warnings)
      .def_property_readonly(
          "rests", [](const PreparedFlight& f) { return spans(f.rests); }, "Begin and end (n, 2) [s].")
      .def_property_readonly(
          "gaps", [](const PreparedFlight& f) { return spans(f.gaps); }, "Of the IMU log, (n, 2) [s].")
      .def_property_readonly(
          "fix_p_ea_e_m",
          [](const PreparedFlight& f) {
            py::array_t<double> array({static_cast<py::ssize_t>(f.record_p_ea_e.size()), py::ssize_t{3}});
            double* to = array.mutable_data();
            for (std::size_t i = 0; i < f.record_p_ea_e.size(); ++i) put3(to + 3 * i, f.record_p_ea_e[i]);
            return array;
          },
          "The antenna as each row of the GNSS log has it, ECEF (n, 3) [m].")
      .def_property_readonly(
          "fix_std_p_n_m",
          [](const PreparedFlight& f) {
            py::array_t<double> array({static_cast<py::ssize_t>(f.gnss.size()), py::ssize_t{3}});
            double* to = array.mutable_data();
            for (std::size_t i = 0; i < f.gnss.size(); ++i) put3(to + 3 * i, f.gnss[i].P_n_m2.diagonal().cwiseSqrt());
            return array;
          },
          "The sigma that each row of the GNSS log states, NED (n, 3) [m].")
      .def_readonly("t_begin_s", &PreparedFlight::t_begin_s, "The run begins: start of the first rest.")
      .def_property_readonly(
          "t_start_s", [](const PreparedFlight& f) { return f.problem.t_start_s; },
          "The last instant of rest; the aligned heading holds here.")
      .def_property_readonly(
          "t_end_s", [](const PreparedFlight& f) { return f.problem.t_end_s; },
          "Fixes up to here are scored by the alignment.")
      .def_readonly("imu_rate_hz", &PreparedFlight::imu_rate_hz)
      .def_readonly("latency_s", &PreparedFlight::latency_s, "t_true = time_s - latency_s.")
      .def_readonly("imu_noise_scale", &PreparedFlight::imu_noise_scale)
      .def_readonly("gnss_std_scale", &PreparedFlight::gnss_std_scale)
      .def_readonly("start", &PreparedFlight::start, "static or moving.")
      .def_readonly("start_reason", &PreparedFlight::start_reason)
      .def_readonly("coarse", &PreparedFlight::coarse);

  m.def("heading_search_options", py::overload_cast<const PreparedFlight&>(&heading_search_options), py::arg("flight"),
        "The options that the keys of [align], \"auto\" and the coarse stage stand for.");

  m.def("with_clock_of_flight", &with_clock_of_flight, py::arg("flight"), py::arg("found"),
        py::call_guard<py::gil_scoped_release>(),
        "found, a HeadingResult, with latency and drift of the clock from up to half an hour of the flight,\n"
        "where they are estimated and the alignment has used less.");
  m.def("prepare_flight", &prepare_flight, py::arg("flight"), py::call_guard<py::gil_scoped_release>(),
        "Raises InputError when IMU and GNSS do not overlap or the flight does not begin at rest.");
  m.def(
      "evaluate_candidates",
      [](const PreparedFlight& flight, const std::vector<HeadingCandidate>& candidates) {
        return evaluate_candidates(flight.problem, candidates);
      },
      py::arg("flight"), py::arg("candidates"), py::call_guard<py::gil_scoped_release>(),
      "One filter per candidate, in parallel; the result does not depend on the number of threads.");
  m.def(
      "fix_innovations",
      [](const PreparedFlight& flight, const HeadingCandidate& candidate) {
        AlignmentProblem problem = flight.problem;
        problem.data = flight.data;  // every fix, whatever the alignment leaves out
        return fix_innovations(problem, candidate);
      },
      py::arg("flight"), py::arg("candidate"), py::call_guard<py::gil_scoped_release>(),
      "The position innovation of each fix that the filter of a candidate saw, in time.\n\n"
      "Raises NumericalError when the filter fails.");
}

}  // namespace liealign::bindings
