// Floor 6: the heading search as ask/tell. evaluate_candidates is with the prepared flight, in bind_flight.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "floors.hpp"
#include "liealign/align/heading_search.hpp"
#include "liealign/align/ranking.hpp"
#include "liealign/pipeline/settings.hpp"

namespace liealign::bindings {
namespace {

py::dict modes(const HeadingResult& r) {
  py::dict columns;
  double* heading = add_column(columns, "heading_rad", r.modes().size());
  double* mass = add_column(columns, "mass", r.modes().size());
  for (std::size_t i = 0; i < r.modes().size(); ++i) {
    heading[i] = r.modes()[i].heading_rad;
    mass[i] = r.modes()[i].mass;
  }
  return columns;
}

py::dict curve(const HeadingResult& r) {
  py::dict columns;
  double* heading = add_column(columns, "heading_rad", r.curve.size());
  double* std = add_column(columns, "heading_std_rad", r.curve.size());
  double* cost = add_column(columns, "cost", r.curve.size());
  py::array_t<bool> gated(static_cast<py::ssize_t>(r.curve.size()));
  columns["gated"] = gated;
  for (std::size_t i = 0; i < r.curve.size(); ++i) {
    heading[i] = r.curve[i].heading_rad;
    std[i] = r.curve[i].heading_std_rad;
    cost[i] = r.curve[i].cost;
    gated.mutable_at(static_cast<py::ssize_t>(i)) = r.curve[i].gated;
  }
  return columns;
}

py::dict density(const HeadingResult& r) {
  const std::vector<PosteriorSample>& samples = r.posterior.samples;
  py::dict columns;
  double* heading = add_column(columns, "heading_rad", samples.size());
  double* value = add_column(columns, "density_per_rad", samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    heading[i] = samples[i].heading_rad;
    value[i] = std::exp(-samples[i].cost);
  }
  return columns;
}

py::dict triple(const HeadingResult& r) {
  py::dict columns;
  double* heading = add_column(columns, "heading_rad", r.triple.size());
  double* cost = add_column(columns, "cost", r.triple.size());
  for (std::size_t i = 0; i < r.triple.size(); ++i) {
    heading[i] = r.triple[i].x;
    cost[i] = r.triple[i].y;
  }
  return columns;
}

void bind_parameters(py::module_& m) {
  using P = FlightParameters;
  py::class_<P>(
      m, "FlightParameters",
      "What the logs leave open besides the heading: offsets and factors to what the flight was prepared with.")
      .def(py::init([](double latency_s, double clock_drift, double imu_noise_scale, double accel_noise_scale,
                       double gnss_std_scale, double velocity_std_scale, double turn_on_scale) {
             return P{latency_s,      clock_drift,        imu_noise_scale, accel_noise_scale,
                      gnss_std_scale, velocity_std_scale, turn_on_scale};
           }),
           py::kw_only(), py::arg("latency_s") = P{}.latency_s, py::arg("clock_drift") = P{}.clock_drift,
           py::arg("imu_noise_scale") = P{}.imu_noise_scale, py::arg("accel_noise_scale") = P{}.accel_noise_scale,
           py::arg("gnss_std_scale") = P{}.gnss_std_scale, py::arg("velocity_std_scale") = P{}.velocity_std_scale,
           py::arg("turn_on_scale") = P{}.turn_on_scale)
      .def_readonly("latency_s", &P::latency_s)
      .def_readonly("clock_drift", &P::clock_drift)
      .def_readonly("imu_noise_scale", &P::imu_noise_scale)
      .def_readonly("accel_noise_scale", &P::accel_noise_scale)
      .def_readonly("gnss_std_scale", &P::gnss_std_scale)
      .def_readonly("velocity_std_scale", &P::velocity_std_scale)
      .def_readonly("turn_on_scale", &P::turn_on_scale);
}

void bind_candidates(py::module_& m) {
  using C = HeadingCandidate;
  py::class_<C>(m, "HeadingCandidate",
                "A filter to run: heading [rad], its standard deviation (0 = conditional), gated or not, gate scales.")
      .def(py::init([](double heading_rad, double heading_std_rad, bool gated, double position, double velocity,
                       const FlightParameters& parameters) {
             return C{heading_rad, heading_std_rad, gated, {position, velocity}, parameters};
           }),
           py::arg("heading_rad"), py::arg("heading_std_rad") = C{}.heading_std_rad, py::arg("gated") = C{}.gated,
           py::arg("gate_scale_position") = C{}.gate_scales.position,
           py::arg("gate_scale_velocity") = C{}.gate_scales.velocity, py::arg("parameters") = FlightParameters{})
      .def_readonly("parameters", &C::parameters)
      .def_readonly("heading_rad", &C::heading_rad)
      .def_readonly("heading_std_rad", &C::heading_std_rad)
      .def_readonly("gated", &C::gated)
      .def_property_readonly("gate_scale_position", [](const C& c) { return c.gate_scales.position; })
      .def_property_readonly("gate_scale_velocity", [](const C& c) { return c.gate_scales.velocity; });

  py::class_<CandidateScore>(m, "CandidateScore", "What a candidate filter scored; cost is infinite when it failed.")
      .def_readonly("cost", &CandidateScore::cost)
      .def_readonly("p_rms_m", &CandidateScore::p_rms_m)
      .def_readonly("nis_90", &CandidateScore::nis_90)
      .def_readonly("fixes", &CandidateScore::fixes);
}

void bind_ranking(py::module_& m) {
  py::class_<FixInnovation>(m, "FixInnovation", "Row of a fix in the GNSS log, and the length of its innovation [m].")
      .def(py::init<std::size_t, double>(), py::arg("record"), py::arg("norm_m"))
      .def_readonly("record", &FixInnovation::record)
      .def_readonly("norm_m", &FixInnovation::norm_m);

  py::class_<RankedFilter>(m, "RankedFilter", "A filter by its place in the list, its P_RMS and the fixes it is of.")
      .def_readonly("filter", &RankedFilter::filter)
      .def_readonly("p_rms_m", &RankedFilter::p_rms_m, "Infinite when the filter failed.")
      .def_readonly("fixes", &RankedFilter::fixes);
  m.def("rank_innovations", &rank_by_p_rms, py::arg("filters"), py::arg("first_record"), py::arg("last_record"),
        "Filters by the P_RMS (Eq. 34) of the fixes that all of them saw, the best first.\n\n"
        "Raises Error when there is no such fix among those rows.");
}

}  // namespace

void bind_align(py::module_& m) {
  bind_parameters(m);
  bind_candidates(m);
  bind_ranking(m);

  py::class_<HeadingSearchOptions>(m, "HeadingSearchOptions",
                                   "Settings of a HeadingSearch; see heading_search_options.")
      .def_readonly("guess_rad", &HeadingSearchOptions::guess_rad)
      .def_readonly("guess_std_rad", &HeadingSearchOptions::guess_std_rad)
      .def_readonly("grid_step_rad", &HeadingSearchOptions::grid_step_rad)
      .def_readonly("grid_std_rad", &HeadingSearchOptions::grid_std_rad)
      .def_readonly("triple_step_rad", &HeadingSearchOptions::triple_step_rad)
      .def_readonly("tolerance_rad", &HeadingSearchOptions::tolerance_rad)
      .def_readonly("max_evaluations", &HeadingSearchOptions::max_evaluations)
      .def_readonly("max_sigma_rad", &HeadingSearchOptions::max_sigma_rad)
      .def_readonly("estimate_latency", &HeadingSearchOptions::estimate_latency)
      .def_readonly("estimate_imu_noise", &HeadingSearchOptions::estimate_imu_noise)
      .def_readonly("estimate_gnss_std", &HeadingSearchOptions::estimate_gnss_std);

  py::class_<HeadingResult>(m, "HeadingResult",
                            "The heading, its sigma (None when the data say nothing), verdict and curve.")
      .def_readonly("heading_rad", &HeadingResult::heading_rad, "[0, 2 pi), clockwise from true north.")
      .def_readonly("sigma_rad", &HeadingResult::sigma_rad)
      .def_readonly("settled", &HeadingResult::settled)
      .def_readonly("verdict", &HeadingResult::verdict, "aligned, weak, ambiguous or unobservable.")
      .def_readonly("advice", &HeadingResult::advice)
      .def_readonly("evaluations", &HeadingResult::evaluations)
      .def_property_readonly("gate_scale_position", [](const HeadingResult& r) { return r.gate_scales.position; })
      .def_property_readonly("gate_scale_velocity", [](const HeadingResult& r) { return r.gate_scales.velocity; })
      .def_readonly("nis_90", &HeadingResult::nis_90)
      .def_readonly("parameters", &HeadingResult::parameters)
      .def_property_readonly(
          "latency_std_s", [](const HeadingResult& r) { return r.parameters_std.latency_s; },
          "None where it was given, as the next ones.")
      .def_property_readonly("imu_noise_scale_std",
                             [](const HeadingResult& r) { return r.parameters_std.imu_noise_scale; })
      .def_property_readonly("accel_noise_scale_std",
                             [](const HeadingResult& r) { return r.parameters_std.accel_noise_scale; })
      .def_property_readonly("gnss_std_scale_std",
                             [](const HeadingResult& r) { return r.parameters_std.gnss_std_scale; })
      .def_property_readonly("mean_rad", [](const HeadingResult& r) { return r.posterior.mean_rad; })
      .def_property_readonly(
          "interval_95_rad",
          [](const HeadingResult& r) { return std::make_pair(r.posterior.low_rad, r.posterior.high_rad); },
          "low <= heading <= high, not wrapped.")
      .def("density", &density, "heading_rad, density_per_rad: arrays (n,), ascending.")
      .def("triple", &triple, "heading_rad (not wrapped), cost: the three points that place the last parabola.")
      .def("modes", &modes, "heading_rad, mass: arrays (n,), the heaviest first.")
      .def("curve", &curve, "heading_rad, heading_std_rad, cost, gated: arrays (n,), in order of evaluation.");

  py::class_<HeadingSearch>(m, "HeadingSearch",
                            "Heading alignment as ask/tell: which candidates to run next, and what their scores say.")
      .def(py::init<const HeadingSearchOptions&>(), py::arg("options"))
      .def("ask", &HeadingSearch::ask, "Candidates to evaluate next; empty when done.")
      .def("tell", &HeadingSearch::tell, py::arg("scores"), "Their scores, in their order.")
      .def("done", &HeadingSearch::done)
      .def("result", &HeadingSearch::result, "Raises Error before done().");
}

}  // namespace liealign::bindings
