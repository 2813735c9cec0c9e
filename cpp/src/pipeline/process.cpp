// Forward pass and backward pass of a prepared flight.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/process.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/output_frame.hpp"
#include "liealign/estimate/smoother.hpp"
#include "liealign/pipeline/settings.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;

double initial_heading_std(const PreparedFlight& flight, const HeadingResult& heading) {
  const double widest = 20.0 * kDegToRad;  // what an error of first order can carry
  double std = std::max(flight.config.initial.heading_std_deg * kDegToRad, 5.0 * heading.sigma_rad.value_or(widest));
  if (flight.config.align.heading_guess_deg) std = std::min(std, flight.config.align.heading_guess_std_deg * kDegToRad);
  return std::min(std, widest);
}

FixUpdate fix_update(const Innovation<double>& innovation, const Matrix3d& C_e_n) {
  return {C_e_n * innovation.z, (C_e_n * innovation.S * C_e_n.transpose()).diagonal().cwiseSqrt(), innovation.nis,
          innovation.weight, innovation.verdict};
}

// Which epochs are wanted, of which point: [output].
struct Output {
  const ImuSeries& imu;
  const OutputConfig& config;
  OutputFrame frame;
  double gyro_arw;

  explicit Output(const PreparedFlight& flight)
      : imu(flight.problem.data.imu),
        config(flight.config.output),
        frame(output_frame(flight.config)),
        gyro_arw(flight.filter.dynamics.noise.gyro_arw) {}

  // The number of the step of output.rate_hz that t has reached; the slack is for stamps a rounding below it.
  double step(double t) const { return std::floor(t * *config.rate_hz + 1e-6); }

  bool wanted(std::size_t k) const {
    const double t = imu[k].t_s;
    if (t < config.start_time_s.value_or(t) || t > config.stop_time_s.value_or(t)) return false;
    return !config.rate_hz || k == 0 || step(t) > step(imu[k - 1].t_s);
  }

  Epoch epoch(std::size_t k, const Belief<Model>& belief) const {
    if (frame.is_imu()) return epoch_of(imu[k].t_s, belief);
    const ImuAtStamp at = imu_at_stamp(imu, k);
    return epoch_of(imu[k].t_s, belief, frame, at.omega_ib_b, gyro_arw * gyro_arw / at.white_s);
  }
};

// Keeps what the backward pass and the output need of the forward pass.
struct ForwardRecorder : SilentVisitor<Model> {
  const PreparedFlight& flight;
  const FilterOptions& filter;
  const Output& output;
  const Progress& progress;
  Solution& solution;
  std::vector<Checkpoint<Model>> checkpoints;

  void add(std::size_t k, const Belief<Model>& belief) {
    if (output.config.filtered && output.wanted(k)) solution.filtered.push_back(output.epoch(k, belief));
  }

  void after(const Belief<Model>& belief, const NavTransition<double>&, std::size_t k, bool whole) {
    if (whole) add(k, belief);
  }

  void updated(const Event& event, UpdateKind kind, const Innovation<double>& innovation) {
    solution.score.add(filter, kind, innovation);
    if (event.kind != Event::Kind::fix) return;
    const GnssFix& fix = flight.problem.data.fixes[event.index];
    FixRecord& record = solution.fixes[fix.record];
    const Matrix3d C_e_n = C_n_e(fix.p_ea_e).transpose();
    (kind == UpdateKind::position ? record.position : record.velocity) = fix_update(innovation, C_e_n);
  }

  void checkpoint(std::size_t i, const Belief<Model>& belief, const ImuCursor& cursor, const Model::State& X_predicted,
                  const Model::Covariance& P_predicted) {
    checkpoints.push_back({belief, cursor, {X_predicted, P_predicted}});
    // An event on the stamp of a sample: the filtered epoch there is the one after the update.
    if (!solution.filtered.empty() && solution.filtered.back().t_s == cursor.t_s) {
      solution.filtered.pop_back();
      add(cursor.k - 1, belief);
    }
    const std::size_t n = flight.problem.data.events.size();
    if (progress && i % (1 + n / 50) == 0 && !progress(i, 2 * n)) throw Cancelled("cancelled");
  }
};

}  // namespace

Solution process(const PreparedFlight& flight, const HeadingResult& heading, const Progress& progress,
                 bool keep_events) {
  const AlignmentProblem& problem = flight.problem;
  const FlightData& data = problem.data;
  const FilterOptions filter = with_gates(flight.filter, heading.gate_scales);
  const Output output(flight);
  Solution solution;
  solution.heading_std_initial_rad = initial_heading_std(flight, heading);
  for (std::size_t i = 0; i < flight.record_use.size(); ++i) {
    solution.fixes.push_back({flight.record_time_s[i], flight.record_use[i], {}, {}});
  }

  Belief<Model> belief = belief_at_rest(problem.rest, heading.heading_rad, solution.heading_std_initial_rad,
                                        problem.initial, data.l_ba_b, flight.filter.dynamics.gravity);
  const ImuCursor start = cursor_at(data.imu, flight.t_begin_s);
  ForwardRecorder recorder{{}, flight, filter, output, progress, solution, {{belief, start, belief}}};
  if (data.imu[start.k - 1].t_s == start.t_s) recorder.add(start.k - 1, belief);
  forward_pass(data, filter, belief, start, data.imu.back().t_s, recorder);
  const std::vector<Checkpoint<Model>>& checkpoints = recorder.checkpoints;

  const Ekf<Model> ekf{flight.filter.dynamics, flight.filter.covariance_reset};
  bool finite = true;
  const auto emit = [&](std::size_t k, const Belief<Model>& b) {
    finite = finite && b.X.first.p.allFinite();
    if (output.wanted(k)) solution.smoothed.push_back(output.epoch(k, b));
  };
  const auto at_event = [&](std::size_t i, const Belief<Model>& b) {
    if (!keep_events) return;
    solution.filtered_at_events.push_back(epoch_of(checkpoints[i].cursor.t_s, checkpoints[i].updated));
    solution.smoothed_at_events.push_back(epoch_of(checkpoints[i].cursor.t_s, b));
  };
  const Progress second_half = [&](std::size_t done, std::size_t total) {
    return !progress || progress(total + done, 2 * total);
  };
  smooth(ekf, data, checkpoints, emit, at_event, second_half);
  for (std::vector<Epoch>* epochs : {&solution.smoothed, &solution.filtered_at_events, &solution.smoothed_at_events})
    std::reverse(epochs->begin(), epochs->end());
  if (!finite) throw NumericalError("the smoothed trajectory is not finite");
  if (solution.smoothed.empty()) {
    throw InputError(
        "output.rate_hz leaves no epoch between output.start_time_s and output.stop_time_s; raise it, or drop it");
  }
  return solution;
}

}  // namespace liealign
