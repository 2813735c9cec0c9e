// liealign-stages: one flight through the library stage by stage, and one line of JSON with the seconds and the memory of each.
//
// Threads by OMP_NUM_THREADS. Medians over --repeat runs where a stage can be repeated. Beside the job itself, on request:
// curves of many headings, the dense yardstick, and the plain full-rate filter and smoother to compare the result with.
// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>
#include <unistd.h>
#ifdef _OPENMP
#include <omp.h>
#endif

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <optional>
#include <utility>

#include "dense_filter.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/interval_smoother.hpp"
#include "liealign/estimate/smoother.hpp"
#include "liealign/io/csv.hpp"
#include "liealign/io/json.hpp"
#include "liealign/pipeline/clock.hpp"
#include "liealign/pipeline/results.hpp"
#include "liealign/pipeline/settings.hpp"

namespace liealign::bench {
namespace {

using Model = LieModel<double>;

struct Options {
  std::string imu, gnss, folder, states;
  std::vector<double> lever_arm = {0.0, 0.0, 0.0};
  std::vector<std::string> formats = {"sbet"};
  std::vector<int> candidates;
  int by_samples = 0;           // headings of a curve without preintegration
  double align_time_s = 300.0;  // motion that the candidates see; 0 = all
  int repeat = 3;
  bool automatic = false, dense = false, dense_smoother = false, check = false;
};

// ---- Clock and memory -----------------------------------------------------------------------------------------------

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Median seconds of so many runs.
template <typename Work>
double median_seconds(int repeat, Work work) {
  std::vector<double> seconds;
  for (int i = 0; i < repeat; ++i) {
    const double begin = seconds_now();
    work();
    seconds.push_back(seconds_now() - begin);
  }
  std::sort(seconds.begin(), seconds.end());
  return seconds[seconds.size() / 2];
}

// A field of /proc/self/status in MB; nothing where there is no such file.
std::optional<double> status_mb(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(field + ":")) return 1024e-6 * std::stod(line.substr(field.size() + 1));
  }
  return std::nullopt;
}

double peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return status_mb("VmHWM").value_or(1024e-6 * static_cast<double>(usage.ru_maxrss));
}

// So that the next peak is that of the next stage alone. Linux only; elsewhere peaks are those since the start.
void forget_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

// Stages of the job, in their order.
struct Stages {
  Json list{JsonArray{}};

  template <typename Work>
  void run(const char* name, int repeat, Work work) {
    forget_peak();
    const std::optional<double> before = status_mb("VmRSS");
    Json stage;
    stage["stage"] = name;
    stage["seconds"] = median_seconds(repeat, work);
    stage["rss_before_mb"] = before;
    stage["peak_mb"] = peak_mb();
    list.push_back(std::move(stage));
  }
};

// ---- The job --------------------------------------------------------------------------------------------------------

Config config_from(const Options& o) {
  Config config;
  config.imu.file = o.imu;
  config.gnss.file = o.gnss;
  std::copy_n(o.lever_arm.begin(), 3, config.gnss.lever_arm_b_m.begin());
  config.align.max_time_s = o.align_time_s;
  config.output.formats = o.formats;
  if (!o.automatic) {
    config.gnss.error_model = "white";
    config.gnss.latency_s = 0.0;
    config.gnss.std_scale = config.imu.noise_scale = 1.0;
  }
  return config;
}

HeadingResult align(const PreparedFlight& flight) {
  HeadingSearch search(heading_search_options(flight));
  while (!search.done()) search.tell(evaluate_candidates(flight.problem, search.ask()));
  return with_clock_of_flight(flight, search.result());
}

// What process() runs over, for those who do the same in another way: all with the parameters that the alignment found.
struct Found {
  FlightData data;
  FilterOptions filter;

  Found(const PreparedFlight& flight, const HeadingResult& heading)
      : data(with_parameters(flight.data, heading.parameters, flight.problem.t_start_s)),
        filter(with_parameters(with_gates(flight.filter, heading.gate_scales), heading.parameters)) {}
};

Belief<Model> start(const PreparedFlight& flight, const HeadingResult& heading, double heading_std_rad) {
  const AlignmentProblem& problem = flight.problem;
  return start_belief(problem, with_parameters(problem.initial, heading.parameters), heading.heading_rad,
                      heading_std_rad, heading.start);
}

double initial_std_rad(const PreparedFlight& flight) { return flight.config.initial.heading_std_deg * kDegToRad; }

// The filter of the library with state and covariance at every IMU epoch, as for filtered.csv. The sum of something of every
// epoch, so that none is optimised away.
double filter(const PreparedFlight& flight, const HeadingResult& heading, const Found& found) {
  double sum = 0.0;
  FilterSink sink;
  sink.wanted = [](std::size_t) { return true; };
  sink.epoch = [&](std::size_t, const NodeBelief& at) { sum += at.belief.P(0, 0); };
  sink.inside = [&](const SampleLanes& samples, const InsideInterval& filtered) {
    const NavBelief<Lanes> belief = filtered.nav_at(samples);
    for (int i = 0; i < samples.count; ++i) sum += epoch_of(0.0, belief, i, filtered).P_phi(0, 0);
  };
  run_forward<kNoTail>(found.data, found.filter, start(flight, heading, initial_std_rad(flight)),
                       cursor_at(found.data.imu(), flight.t_begin_s), sink);
  return sum;
}

// Its states where something is observed.
std::vector<NavState<double>> filtered_at_events(const PreparedFlight& flight, const HeadingResult& heading,
                                                 const Found& found) {
  struct Silent {
    void updated(const Observation&, const Innovation<double>&) {}
    void inside(std::size_t, const Preintegrated<double>&) {}
  } silent;
  RunState<kNoTail> run = run_from<kNoTail>(found.data, start(flight, heading, initial_std_rad(flight)),
                                            cursor_at(found.data.imu(), flight.t_begin_s));
  IntervalStep<kNoTail> step;
  std::vector<NavState<double>> states;
  while (next_node(found.data, found.filter, run, step, silent)) {
    if (run.observed) states.push_back(run.belief.X);
  }
  return states;
}

// IMU samples that a run goes through.
std::size_t epochs_of(const PreparedFlight& flight) {
  const ImuSeries& imu = flight.problem.data.imu();
  return imu.size() - cursor_at(imu, flight.t_begin_s).k;
}

// ---- The yardstick and the check ------------------------------------------------------------------------------------

std::vector<double> event_times(const PreparedFlight& flight, const Found& found) {
  std::vector<double> times;
  for (const Observation& o : found.data.observations) {
    if (o.t_s > flight.t_begin_s && (times.empty() || o.t_s > times.back())) times.push_back(o.t_s);
  }
  return times;
}

// As trajectory.csv, without sigmas.
void write_states(const std::string& path, const std::vector<double>& times,
                  const std::function<SE23<double>(std::size_t)>& state) {
  const std::vector<CsvColumn> columns = {{"time_s", 6},   {"lat_deg", 11},  {"lon_deg", 11},   {"height_m", 5},
                                          {"roll_deg", 6}, {"pitch_deg", 6}, {"heading_deg", 6}};
  write_csv(path, columns, times.size(), [&](std::size_t i, double* c) {
    const SE23<double> X = state(i);
    const Geodetic g = geodetic_from_ecef(X.p);
    const Vector3d rpy = rpy_from_C_b_n(C_n_e(X.p).transpose() * X.C) * kRadToDeg;
    const double row[] = {times[i], g.lat_rad * kRadToDeg, g.lon_rad * kRadToDeg, g.height_m, rpy[0], rpy[1], rpy[2]};
    std::copy(std::begin(row), std::end(row), c);
  });
}

// That both smoothers do the same work: rms over the second half of the flight, where every fix lies on a stamp of the IMU.
Json difference(const std::vector<DenseBelief>& dense, const std::vector<Epoch>& epochs) {
  Json json;
  if (dense.size() + 1 != epochs.size()) return json;
  double position = 0.0, attitude = 0.0;
  const std::size_t begin = dense.size() / 2, n = dense.size() - begin;
  for (std::size_t i = begin; i < dense.size(); ++i) {
    const SE23<double>& X = epochs[i].X.first;
    position += (dense[i].X.p - X.p).squaredNorm();
    attitude += SO3<double>{X.C.transpose() * dense[i].X.C_b_e}.log().squaredNorm();
  }
  json["position_m"] = std::sqrt(position / static_cast<double>(n));
  json["attitude_deg"] = std::sqrt(attitude / static_cast<double>(n)) * kRadToDeg;
  return json;
}

Json dense_yardstick(const Options& o, const PreparedFlight& flight, const Found& found, const DenseBelief& start,
                     const std::vector<Epoch>& smoothed, std::vector<DenseState>& at_events) {
  const FlightData& data = found.data;
  Json json;
  json["filter_seconds"] = median_seconds(o.repeat, [&] {
    DenseBelief belief = start;
    at_events.clear();
    dense_forward(data, found.filter, flight.t_begin_s, belief, at_events);
  });
  if (!o.dense_smoother) return json;
  std::vector<DenseBelief> dense;
  json["filter_and_smoother_seconds"] = median_seconds(1, [&] {
    DenseBelief belief = start;
    std::vector<DenseState> again;
    std::vector<DenseStep> steps;
    dense_forward(data, found.filter, flight.t_begin_s, belief, again, &steps);
    dense = dense_backward(steps, belief);
  });
  json["smoother_difference"] = difference(dense, smoothed);
  return json;
}

struct Recorder : SilentVisitor<Model> {
  static constexpr bool keeps_changes = true;
  std::vector<Checkpoint<Model>> checkpoints;
  void node(std::size_t, const Belief<Model>& belief, const ImuCursor& cursor, const NodeChanges<Model>& changes) {
    checkpoints.push_back({belief, cursor, changes});
  }
};

// The smoother over a full-rate forward pass, step by step, as process() must come out.
std::vector<Epoch> plain_smoother(const PreparedFlight& flight, const Found& found, Belief<Model> belief) {
  const FlightData& data = found.data;
  const ImuCursor begin = cursor_at(data.imu(), flight.t_begin_s);
  Recorder recorder{{}, {{belief, begin, {}}}};
  forward_pass(data, found.filter, belief, begin, data.imu().back().t_s, recorder);
  std::vector<Epoch> epochs;
  smooth(
      Ekf<Model>{found.filter.dynamics, found.filter.covariance_reset}, data, recorder.checkpoints, kEverySample,
      [&](std::size_t k, const Belief<Model>& b) {
        epochs.push_back(epoch_of(data.imu()[k].t_s, node_belief<kNoTail>(b, Matrix3d::Zero())));
      },
      [](std::size_t, const Belief<Model>&) {});
  std::reverse(epochs.begin(), epochs.end());
  return epochs;
}

// How far the epochs are from the plain smoother's, in its sigmas, and their sigmas from its sigmas: the largest.
Json compare(const std::vector<Epoch>& epochs, const std::vector<Epoch>& plain) {
  if (epochs.size() != plain.size()) throw Error("the smoothers disagree about the number of epochs");
  double difference = 0.0, squares = 0.0, sigma = 0.0;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const Model::Tangent d = Model::local(plain[i].X, epochs[i].X);
    const std::pair<const Matrix3d*, const Matrix3d*> blocks[] = {
        {&epochs[i].P_phi, &plain[i].P_phi}, {&epochs[i].P_nu, &plain[i].P_nu}, {&epochs[i].P_rho, &plain[i].P_rho}};
    for (int j = 0; j < 9; ++j) {
      const double std = std::sqrt((*blocks[j / 3].second)(j % 3, j % 3));
      const double off = std::abs(d[j]) / std;
      difference = std::max(difference, off);
      squares += off * off;
      sigma = std::max(sigma, std::abs(std::sqrt((*blocks[j / 3].first)(j % 3, j % 3)) / std - 1.0));
    }
  }
  Json json;
  json["largest_difference_in_sigma"] = difference;
  json["rms_difference_in_sigma"] = std::sqrt(squares / (9.0 * static_cast<double>(plain.size())));
  json["largest_relative_sigma_error"] = sigma;
  return json;
}

// ---- Curves of many headings ----------------------------------------------------------------------------------------

double curve_seconds(int repeat, const AlignmentProblem& problem, int headings) {
  std::vector<HeadingCandidate> candidates(static_cast<std::size_t>(headings));
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    candidates[i].heading_rad = 2.0 * kPi * static_cast<double>(i) / static_cast<double>(headings);
  }
  return median_seconds(repeat, [&] { evaluate_candidates(problem, candidates); });
}

Json curves(const Options& o, AlignmentProblem problem) {
  const auto after = [](double t, const Observation& other) { return t < other.t_s; };
  const auto& observations = problem.data.observations;
  Json json;
  json["preintegration_seconds"] = median_seconds(o.repeat, [&] { preintegrate(problem); });
  json["intervals"] = problem.intervals.intervals.size();
  json["epochs"] =
      cursor_at(problem.data.imu(), problem.t_end_s).k - cursor_at(problem.data.imu(), problem.t_begin_s).k;
  json["observations"] = std::upper_bound(observations.begin(), observations.end(), problem.t_end_s, after) -
                         std::upper_bound(observations.begin(), observations.end(), problem.t_begin_s, after);
  json["by_intervals"] = JsonArray{};
  for (const int headings : o.candidates) {
    Json curve;
    curve["headings"] = headings;
    curve["seconds"] = curve_seconds(o.repeat, problem, headings);
    json["by_intervals"].push_back(std::move(curve));
  }
  if (o.by_samples == 0) return json;
  problem.intervals = {};
  json["by_samples"]["headings"] = o.by_samples;
  json["by_samples"]["seconds"] = curve_seconds(o.repeat, problem, o.by_samples);
  return json;
}

// ---- All of it ------------------------------------------------------------------------------------------------------

int threads() {
#ifdef _OPENMP
  return omp_get_max_threads();
#else
  return 1;
#endif
}

Json run(const Options& o) {
  Stages stages;
  std::optional<Flight> read;
  stages.run("read", 1, [&] { read = read_flight(config_from(o)); });
  std::optional<PreparedFlight> prepared;
  stages.run("prepare", 1, [&] { prepared = prepare_flight(std::move(*read)); });
  read.reset();
  const PreparedFlight& flight = *prepared;
  HeadingResult heading;
  stages.run("align", o.repeat, [&] { heading = align(flight); });
  const Found found(flight, heading);
  double filtered = 0.0;
  stages.run("filter", o.repeat, [&] { filtered += filter(flight, heading, found); });
  if (!std::isfinite(filtered)) throw NumericalError("the filter is not finite");
  const EpochSink nowhere{[](std::size_t, const std::vector<Epoch>&) {}, [](std::size_t) {}};
  stages.run("filter_and_smoother", o.repeat, [&] { process(flight, heading, nowhere, nowhere); });
  if (!o.folder.empty()) {
    stages.run("to_files", o.repeat, [&] {
      ResultFiles files(o.folder, flight, heading);
      files.finish(process(flight, heading, files.smoothed(), files.filtered()));
    });
  }

  Json json;
  json["epochs"] = epochs_of(flight);
  json["fixes"] = flight.problem.data.fixes.size();
  json["seconds_of_flight"] = flight.problem.data.imu().back().t_s - flight.problem.data.imu().front().t_s;
  json["threads"] = threads();
  json["heading_deg"] = heading.heading_rad * kRadToDeg;
  json["heading_evaluations"] = heading.evaluations;
  json["stages"] = stages.list;
  Solution solution;
  if (o.check || o.dense) solution = process(flight, heading);
  if (o.check) {
    const Belief<Model> belief = start(flight, heading, solution.heading_std_initial_rad);
    json["check"] = compare(solution.smoothed, plain_smoother(flight, found, belief));
  }
  if (!o.candidates.empty()) json["curves"] = curves(o, flight.problem);
  std::vector<DenseState> dense;
  if (o.dense) {
    const DenseBelief belief = dense_belief(start(flight, heading, initial_std_rad(flight)));
    json["dense"] = dense_yardstick(o, flight, found, belief, solution.smoothed, dense);
  }
  if (!o.states.empty()) {
    const std::vector<double> times = event_times(flight, found);
    const std::vector<NavState<double>> states = filtered_at_events(flight, heading, found);
    write_states(o.states + "/filtered_at_fixes.csv", times, [&](std::size_t i) { return states[i].first; });
    if (o.dense) {
      write_states(o.states + "/dense_at_fixes.csv", times, [&](std::size_t i) {
        return SE23<double>{dense[i].C_b_e, dense[i].v, dense[i].p};
      });
    }
  }
  return json;
}

}  // namespace
}  // namespace liealign::bench

int main(int argc, char** argv) {
  liealign::bench::Options o;
  CLI::App cli("One flight through liealign, stage by stage; one line of JSON.", "liealign-stages");
  cli.add_option("--imu", o.imu, "Native imu.csv")->required();
  cli.add_option("--gnss", o.gnss, "Native gnss.csv")->required();
  cli.add_option("--lever-arm", o.lever_arm, "From the IMU to the antenna [m]")->expected(3);
  cli.add_option("--write", o.folder, "Folder for the results; without it nothing is written");
  cli.add_option("--format", o.formats, "Trajectory files to write")->delimiter(',');
  cli.add_option("--states", o.states, "Folder for the filtered states at the fixes");
  cli.add_option("--candidates", o.candidates, "Numbers of headings of curves to time")->delimiter(',');
  cli.add_option("--by-samples", o.by_samples, "Headings of a curve without preintegration");
  cli.add_option("--align-time", o.align_time_s, "Motion that candidates see [s]; 0: all");
  cli.add_option("--repeat", o.repeat, "Runs of a stage, of which the median counts")->check(CLI::PositiveNumber);
  cli.add_flag("--auto", o.automatic, "GNSS latency and noise scales are not told");
  cli.add_flag("--dense", o.dense, "Also the dense yardstick");
  cli.add_flag("--dense-smoother", o.dense_smoother, "Also its smoother, which keeps every step: 6 kB an epoch");
  cli.add_flag("--check", o.check, "Compare with the plain full-rate filter and smoother");
  CLI11_PARSE(cli, argc, argv);
  try {
    std::printf("%s\n", liealign::dump_json(liealign::bench::run(o), 0).c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
