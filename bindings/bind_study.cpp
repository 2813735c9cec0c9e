// Floor 8: Monte Carlo runs of a study, their errors as numpy arrays.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <tuple>

#include "floors.hpp"
#include "liealign/study/honest.hpp"
#include "liealign/study/monte_carlo.hpp"

namespace liealign::bindings {
namespace {

constexpr std::size_t kChannels = kStudyChannels.size();

double* copy(const ChannelValues& from, double* to) { return std::copy(from.begin(), from.end(), to); }

void bind_case(py::module_& m) {
  using S = StudyCase;
  py::class_<S>(m, "StudyCase",
                "A flight with other sensor errors in each run, and the filters that are compared on it; see "
                "docs/studies.md.")
      .def(py::init(&from_keywords<S>))
      .def_readwrite("flight", &S::flight)
      .def(
          "set_track",
          [](S& s, const Array& time_s, const Array& lat_deg, const Array& lon_deg, const Array& height_m,
             const Array& rpy_deg) { s.track = track_points(time_s, lat_deg, lon_deg, height_m, rpy_deg); },
          py::arg("time_s"), py::arg("lat_deg"), py::arg("lon_deg"), py::arg("height_m"), py::arg("rpy_deg"),
          "Flown instead of `flight`, at its rate_hz and oversample: (n,) each, rpy_deg (n, 3).\n\n"
          "Raises InputError for columns of other shapes.")
      .def_readwrite("gnss", &S::gnss)
      .def_readwrite("imu", &S::imu)
      .def_readwrite("typed_in", &S::typed_in)
      .def_readwrite("config", &S::config)
      .def_readwrite("models", &S::models)
      .def_readwrite("start", &S::start)
      .def_readwrite("heading_error_deg", &S::heading_error_deg)
      .def_readwrite("position_std_m", &S::position_std_m)
      .def_readwrite("biases", &S::biases)
      .def_readwrite("mechanization", &S::mechanization)
      .def_readwrite("rate_hz", &S::rate_hz)
      .def_readwrite("nees_interval_s", &S::nees_interval_s)
      .def_readwrite("seed", &S::seed);
}

// The stages of a model in their order, and the windows of a stage.
std::array<const StageErrors*, 2> stages(const ModelErrors& model) { return {&model.filter, &model.smoother}; }
std::array<const ErrorSums*, 2> windows(const StageErrors& stage) { return {&stage.whole, &stage.flight}; }

void put_sums(py::dict& d, const std::vector<RunErrors>& runs, py::ssize_t models) {
  const std::vector<py::ssize_t> shape = {models, 2, 2, static_cast<py::ssize_t>(kChannels)};
  double *squares = add_column(d, "squares", runs.size(), shape),
         *variances = add_column(d, "variances", runs.size(), shape);
  for (const RunErrors& run : runs) {
    for (const ModelErrors& model : run.models) {
      for (const StageErrors* stage : stages(model)) {
        for (const ErrorSums* sums : windows(*stage)) {
          squares = copy(sums->squares, squares);
          variances = copy(sums->variances, variances);
        }
      }
    }
  }
}

// A model that failed has no epochs: nan.
void put_nees(py::dict& d, const std::vector<RunErrors>& runs, py::ssize_t models, std::size_t times) {
  double* nees = add_column(d, "nees", runs.size(), {models, 2, static_cast<py::ssize_t>(times)});
  for (const RunErrors& run : runs) {
    for (const ModelErrors& model : run.models) {
      for (const StageErrors* stage : stages(model)) {
        std::fill_n(nees, times, std::numeric_limits<double>::quiet_NaN());
        std::copy(stage->nees.begin(), stage->nees.end(), nees);
        nees += times;
      }
    }
  }
}

py::dict columns(const StudyCase& study, const Truth& truth, const std::vector<RunErrors>& runs) {
  const auto models = static_cast<py::ssize_t>(runs.empty() ? study.models.size() : runs.front().models.size());
  py::dict d;
  put_sums(d, runs, models);
  put_nees(d, runs, models, nees_times(study, truth).size());
  const std::size_t n = runs.size();
  py::array_t<std::uint64_t> seed(static_cast<py::ssize_t>(n));
  d["seed"] = seed;
  double *epochs = add_column(d, "epochs", n, {2}), *fixes = add_column(d, "fixes", n),
         *nis = add_column(d, "mean_nis", n, {models}), *simulate = add_column(d, "simulate_s", n),
         *align = add_column(d, "align_s", n), *filter = add_column(d, "filter_s", n, {models}),
         *smoother = add_column(d, "smoother_s", n, {models});
  py::list failures;
  for (std::size_t i = 0; i < n; ++i) {
    const RunErrors& run = runs[i];
    seed.mutable_at(static_cast<py::ssize_t>(i)) = run.seed;
    epochs[2 * i] = static_cast<double>(run.epochs);
    epochs[2 * i + 1] = static_cast<double>(run.flight_epochs);
    fixes[i] = static_cast<double>(run.fixes);
    simulate[i] = run.simulate_s;
    align[i] = run.align_s;
    for (std::size_t j = 0; j < run.models.size(); ++j) {
      const ModelErrors& model = run.models[j];
      *nis++ = model.mean_nis;
      *filter++ = model.filter_s;
      *smoother++ = model.smoother_s;
      if (!model.failure.empty()) failures.append(std::tuple(i, j, model.failure));
    }
  }
  d["failures"] = failures;
  return d;
}

py::dict run_flights(const StudyCase& study, const Truth& truth, std::size_t first, std::size_t count,
                     const py::object& progress) {
  const Progress callback = progress_from(progress);
  std::vector<RunErrors> runs;
  {
    py::gil_scoped_release release;
    runs = run_study(study, truth, first, count, callback);
  }
  return columns(study, truth, runs);
}

py::dict bound(const StudyCase& study, const Truth& truth) {
  std::vector<RunErrors> runs;
  {
    py::gil_scoped_release release;
    runs.push_back(study_bound(study, truth));
  }
  return columns(study, truth, runs);
}

void bind_honest_case(py::module_& m) {
  using H = HonestCase;
  py::class_<H>(m, "HonestCase", "Flights from starts drawn from P_0, whose stated sigmas are held against the truth.")
      .def(py::init(&from_keywords<H>))
      .def_readwrite("config", &H::config)
      .def_readwrite("gnss", &H::gnss)
      .def_property(
          "kinds",
          [](const H& h) {
            std::vector<std::string> names;
            for (const FlightKind kind : h.kinds) names.push_back(flight_kind_name(kind));
            return names;
          },
          [](H& h, const std::vector<std::string>& names) {
            h.kinds.clear();
            for (const std::string& name : names) h.kinds.push_back(flight_kind(name));
          })
      .def_readwrite("rate_hz", &H::rate_hz)
      .def_readwrite("parked_s", &H::parked_s)
      .def_readwrite("flight_s", &H::flight_s)
      .def_readwrite("start_after_s", &H::start_after_s)
      .def_readwrite("latency_start_std_s", &H::latency_start_std_s)
      .def_readwrite("rest_s", &H::rest_s)
      .def_readwrite("tilt_std_deg", &H::tilt_std_deg)
      .def_readwrite("heading_std_deg", &H::heading_std_deg)
      .def_readwrite("velocity_std_mps", &H::velocity_std_mps)
      .def_readwrite("settle_s", &H::settle_s)
      .def_readwrite("every_s", &H::every_s);
}

py::dict honest_parameters(const HonestRun& run) {
  const ReceiverParameters& p = run.parameters;
  py::dict d;
  d["sigma_c"] = p.sigma_c;
  d["tau_c_s"] = p.tau_c_s;
  d["tau_u_s"] = p.tau_u_s;
  d["white_scale"] = p.white_scale;
  d["velocity_scale"] = p.velocity_scale;
  d["sigma_s_mps"] = p.sigma_s_mps;
  d["tau_s_s"] = p.tau_s_s;
  d["jitter_s"] = p.jitter_s;
  d["gyro_scale"] = p.gyro_scale;
  d["accel_scale"] = p.accel_scale;
  return d;
}

py::dict honest_content(const HonestRun& run) {
  const std::size_t n = run.epochs.size();
  py::dict d;
  d["seed"] = run.seed;
  d["kind"] = run.kind;
  d["failure"] = run.failure;
  const auto channels = static_cast<py::ssize_t>(kHonestChannels.size());
  double *time = add_column(d, "time_s", n), *error = add_column(d, "error", n, {channels}),
         *sigma = add_column(d, "sigma", n, {channels}),
         *nees = add_column(d, "nees", n, {static_cast<py::ssize_t>(kHonestBlocks.size())});
  for (const HonestEpoch& epoch : run.epochs) {
    *time++ = epoch.t_s;
    error = std::copy(epoch.error.begin(), epoch.error.end(), error);
    sigma = std::copy(epoch.sigma.begin(), epoch.sigma.end(), sigma);
    nees = std::copy(epoch.nees.begin(), epoch.nees.end(), nees);
  }
  d["fitted"] = run.fitted;
  d["parameters"] = honest_parameters(run);
  d["settled"] = run.settled;
  d["evaluations"] = run.evaluations;
  d["latency_error_s"] = run.latency_error_s;
  d["latency_std_s"] = run.latency_std_s;
  d["velocity_latency_error_s"] = run.velocity_latency_error_s;
  d["velocity_latency_std_s"] = run.velocity_latency_std_s;
  d["simulate_s"] = run.simulate_s;
  d["run_s"] = run.run_s;
  return d;
}

py::list honest_flights(const HonestCase& honest, std::uint64_t first_seed, std::size_t count,
                        const py::object& progress) {
  const Progress callback = progress_from(progress);
  std::vector<HonestRun> runs;
  {
    py::gil_scoped_release release;
    runs = honest_runs(honest, first_seed, count, callback);
  }
  py::list all;
  for (const HonestRun& run : runs) all.append(honest_content(run));
  return all;
}

void bind_honest(py::module_& m) {
  bind_honest_case(m);
  py::list channels, blocks;
  for (const char* name : kHonestChannels) channels.append(name);
  for (const char* name : kHonestBlocks) blocks.append(name);
  m.attr("HONEST_CHANNELS") = py::tuple(channels);
  m.attr("HONEST_BLOCKS") = py::tuple(blocks);
  m.def("honest_runs", &honest_flights, py::arg("case"), py::arg("first_seed"), py::arg("count"),
        py::arg("progress") = py::none(),
        "Flights of the case with seeds from first_seed on; one dict each, by name:\n\n"
        "seed, kind, failure (empty for a run that went through); time_s (n,), error, sigma (n, HONEST_CHANNELS), "
        "nees (n, HONEST_BLOCKS);\n"
        "fitted, and of the fit: parameters, settled, evaluations, latency_error_s, latency_std_s and those of the "
        "velocity;\n"
        "simulate_s, run_s.\n\n"
        "progress(done, total) is called now and then; returning False raises Cancelled. Raises Error.");
}

}  // namespace

void bind_study(py::module_& m) {
  bind_case(m);
  py::class_<Truth>(m, "Truth", "The true states of a flight and its perfect IMU; made by study_truth.");
  py::list channels;
  for (const char* name : kStudyChannels) channels.append(name);
  m.attr("STUDY_CHANNELS") = py::tuple(channels);

  m.def("check_study", &check_study, py::arg("study"),
        "Raises Error for a field of the case itself that is out of range or does not go with another.");
  m.def("study_truth", &study_truth, py::arg("study"), py::call_guard<py::gil_scoped_release>(),
        "The truth that all runs of the case share.\n\nRaises Error for a field out of range.");
  m.def("nees_times", &nees_times, py::arg("study"), py::arg("truth"), "Times that NEES is taken at [s].");
  m.def(
      "run_study", &run_flights, py::arg("study"), py::arg("truth"), py::arg("first"), py::arg("count"),
      py::arg("progress") = py::none(),
      "Runs first to first + count - 1 of the case. Arrays by name, one row per run:\n\n"
      "squares, variances, largest (n, models, 2, 2, channels): sums over the epochs, by filter and smoother, then by "
      "whole run and flight;\n"
      "nees (n, models, 2, times); epochs (n, 2); seed, fixes (n,);\n"
      "mean_nis, filter_s, smoother_s (n, models); simulate_s, align_s (n,); failures: a list of (row, model, "
      "text).\n\n"
      "progress(done, total) is called now and then; returning False raises Cancelled. Raises Error.");
  m.def("study_bound", &bound, py::arg("study"), py::arg("truth"),
        "The same arrays of one run of the Lie model without sensor errors: its variances are the bound.");
  bind_honest(m);
}

}  // namespace liealign::bindings
