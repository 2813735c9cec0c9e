// Floor 7: filter and smoother over a prepared flight, their output as numpy columns and as files.
// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <optional>

#include "floors.hpp"
#include "liealign/core/units.hpp"
#include "liealign/pipeline/process.hpp"
#include "liealign/pipeline/results.hpp"
#include "liealign/pipeline/run_text.hpp"

namespace liealign::bindings {
namespace {

// One pass over the epochs. The keys are the fields of liealign.Trajectory.
py::dict trajectory_columns(const std::vector<Epoch>& epochs) {
  const std::size_t n = epochs.size();
  py::dict d;
  double *t = add_column(d, "time_s", n), *lat = add_column(d, "lat_deg", n), *lon = add_column(d, "lon_deg", n),
         *height = add_column(d, "height_m", n), *v = add_column(d, "v_n_mps", n, {3}),
         *rpy = add_column(d, "rpy_deg", n, {3}), *std_p = add_column(d, "std_p_n_m", n, {3}),
         *std_v = add_column(d, "std_v_n_mps", n, {3}), *std_rpy = add_column(d, "std_rpy_deg", n, {3}),
         *ba = add_column(d, "b_a_mps2", n, {3}), *bg = add_column(d, "b_g_rps", n, {3}),
         *std_ba = add_column(d, "std_b_a_mps2", n, {3}), *std_bg = add_column(d, "std_b_g_rps", n, {3}),
         *p_e = add_column(d, "p_eb_e_m", n, {3}), *v_e = add_column(d, "v_eb_e_mps", n, {3}),
         *C = add_column(d, "C_b_e", n, {3, 3}), *relative = add_column(d, "relative_std_p_n_m", n, {3});
  py::gil_scoped_release release;
  for (std::size_t i = 0; i < n; ++i) {
    const Epoch& e = epochs[i];
    const NavRow row = nav_row(e);
    const std::size_t at = 3 * i;
    t[i] = row.t_s;
    lat[i] = row.lat_rad * kRadToDeg;
    lon[i] = row.lon_rad * kRadToDeg;
    height[i] = row.height_m;
    put3(v + at, row.v_n_mps);
    put3(rpy + at, row.rpy_rad, kRadToDeg);
    put3(std_p + at, row.std_p_n_m);
    put3(relative + at, row.relative_std_p_n_m);
    put3(std_v + at, row.std_v_n_mps);
    put3(std_rpy + at, row.std_rpy_rad, kRadToDeg);
    put3(ba + at, b_a(e.X));
    put3(bg + at, b_g(e.X));
    put3(std_ba + at, e.variance_b_a.cwiseSqrt());
    put3(std_bg + at, e.variance_b_g.cwiseSqrt());
    put3(p_e + at, e.X.first.p);
    put3(v_e + at, e.X.first.v);
    for (int r = 0; r < 3; ++r) put3(C + 9 * i + 3 * static_cast<std::size_t>(r), e.X.first.C.row(r));
  }
  return d;
}

struct UpdateColumns {
  double *residual, *std, *nis, *weight;

  void put(std::size_t i, const std::optional<FixUpdate>& update) const {
    constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
    put3(residual + 3 * i, update ? update->residual_n : Vector3d::Constant(kAbsent));
    put3(std + 3 * i, update ? update->std_n : Vector3d::Constant(kAbsent));
    nis[i] = update ? update->nis : kAbsent;
    weight[i] = update ? update->weight : kAbsent;
  }
};

py::dict innovation_columns(const Solution& solution) {
  const std::size_t n = solution.fixes.size();
  py::dict d;
  double* t = add_column(d, "time_s", n);
  const UpdateColumns p = {add_column(d, "res_p_n_m", n, {3}), add_column(d, "std_p_n_m", n, {3}),
                           add_column(d, "nis", n), add_column(d, "weight", n)};
  const UpdateColumns v = {add_column(d, "res_v_n_mps", n, {3}), add_column(d, "std_v_n_mps", n, {3}),
                           add_column(d, "nis_velocity", n), add_column(d, "weight_velocity", n)};
  py::list verdict;
  for (std::size_t i = 0; i < n; ++i) {
    t[i] = solution.fixes[i].t_s;
    p.put(i, solution.fixes[i].position);
    v.put(i, solution.fixes[i].velocity);
    verdict.append(verdict_word(solution.fixes[i]));
  }
  d["verdict"] = py::module_::import("numpy").attr("array")(verdict, py::str("str"));
  return d;
}

Solution run_flight(const PreparedFlight& flight, const HeadingResult& heading, const py::object& progress,
                    bool keep_events) {
  const Progress callback = progress_from(progress);
  py::gil_scoped_release release;
  return process(flight, heading, callback, keep_events);
}

void write(const std::string& folder, const PreparedFlight& flight, const HeadingResult& heading,
           const Solution& solution) {
  py::gil_scoped_release release;
  write_results(folder, flight, heading, solution);
}

std::vector<std::pair<std::string, std::string>> labelled(const std::vector<TextLine>& lines) {
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const TextLine& line : lines) pairs.emplace_back(line.label, line.text);
  return pairs;
}

}  // namespace

void bind_pipeline(py::module_& m) {
  py::class_<Solution>(m, "Solution", "Smoothed (and, on request, filtered) trajectory, and what became of each fix.")
      .def(
          "smoothed", [](const Solution& s) { return trajectory_columns(s.smoothed); },
          "Arrays by name: (n,), vectors (n, 3), C_b_e (n, 3, 3), at the IMU stamps.")
      .def(
          "filtered", [](const Solution& s) { return trajectory_columns(s.filtered); },
          "The same from the forward pass alone; of length 0 unless output.filtered.")
      .def(
          "filtered_at_events", [](const Solution& s) { return trajectory_columns(s.filtered_at_events); },
          "Of the IMU, at the fixes and rest updates, after each; of length 0 unless keep_events.")
      .def(
          "smoothed_at_events", [](const Solution& s) { return trajectory_columns(s.smoothed_at_events); },
          "The smoothed counterpart of filtered_at_events.")
      .def("innovations", &innovation_columns, "Arrays by name, one row per GNSS record; NaN where it was no update.")
      .def_property_readonly("p_rms_m", [](const Solution& s) { return s.score.p_rms(); })
      .def_property_readonly("epochs", [](const Solution& s) { return s.digest.epochs; });

  m.def("process", &run_flight, py::arg("flight"), py::arg("heading"), py::arg("progress") = py::none(),
        py::arg("keep_events") = false,
        "Filter and smoother. progress(done, total) is called now and then; returning False raises Cancelled.\n\n"
        "Raises InputError, NumericalError.");
  m.def(
      "alignment_json",
      [](const PreparedFlight& flight, const HeadingResult& heading) { return alignment_json(flight, heading); },
      py::arg("flight"), py::arg("heading"), "The text of alignment.json.");
  m.def("summary_json", &summary_json, py::arg("flight"), py::arg("heading"), py::arg("solution"),
        "The text of summary.json.");
  m.def(
      "alignment_text",
      [](const PreparedFlight& flight, const HeadingResult& heading) {
        return labelled(alignment_text(flight, heading));
      },
      py::arg("flight"), py::arg("heading"), "What a front end prints of an alignment: (label, text) of each line.");
  m.def(
      "run_text",
      [](const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution,
         const std::string& folder) { return labelled(run_text(flight, heading, solution, folder)); },
      py::arg("flight"), py::arg("heading"), py::arg("solution"), py::arg("folder"),
      "What a front end prints of a run with its results in `folder`: (label, text) of each line.");
  m.def("write_results", &write, py::arg("folder"), py::arg("flight"), py::arg("heading"), py::arg("solution"),
        "Writes the result files into the folder, which is made if need be; file names in config.toml are relative to "
        "it.\n\n"
        "Raises InputError when a file cannot be written.");
}

}  // namespace liealign::bindings
