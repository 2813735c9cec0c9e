// Forward pass and backward pass of a prepared flight.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/process.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/smoother.hpp"

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

// Keeps what the backward pass and the output need of the forward pass.
struct ForwardRecorder : SilentVisitor<Model> {
  const PreparedFlight& flight;
  const FilterOptions& filter;
  const Progress& progress;
  Solution& solution;
  std::vector<Checkpoint<Model>> checkpoints;

  void after(const Belief<Model>& belief, const NavTransition<double>&, std::size_t k, bool whole) {
    if (whole && flight.config.output.filtered)
      solution.filtered.push_back(epoch_of(flight.problem.data.imu[k].t_s, belief));
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
    const ImuSample& sample = flight.problem.data.imu[cursor.k - 1];
    if (flight.config.output.filtered && sample.t_s == cursor.t_s)
      solution.filtered.back() = epoch_of(sample.t_s, belief);
    const std::size_t n = flight.problem.data.events.size();
    if (progress && i % (1 + n / 50) == 0 && !progress(i, 2 * n)) throw Cancelled("cancelled");
  }
};

}  // namespace

Solution process(const PreparedFlight& flight, const HeadingResult& heading, const Progress& progress) {
  const AlignmentProblem& problem = flight.problem;
  const FlightData& data = problem.data;
  const FilterOptions filter = with_gates(flight.filter, heading.gate_scales);
  Solution solution;
  solution.heading_std_initial_rad = initial_heading_std(flight, heading);
  for (std::size_t i = 0; i < flight.record_use.size(); ++i) {
    solution.fixes.push_back({flight.record_time_s[i], flight.record_use[i], {}, {}});
  }

  Belief<Model> belief = belief_at_rest(problem.rest, heading.heading_rad, solution.heading_std_initial_rad,
                                        problem.initial, data.l_ba_b, flight.filter.dynamics.gravity);
  const ImuCursor start = cursor_at(data.imu, flight.t_begin_s);
  ForwardRecorder recorder{{}, flight, filter, progress, solution, {{belief, start, belief}}};
  const ImuSample& first = data.imu[start.k - 1];
  if (flight.config.output.filtered && first.t_s == start.t_s) solution.filtered.push_back(epoch_of(first.t_s, belief));
  forward_pass(data, filter, belief, start, data.imu.back().t_s, recorder);

  const Ekf<Model> ekf{flight.filter.dynamics, flight.filter.covariance_reset};
  const auto emit = [&](std::size_t k, const Belief<Model>& b) {
    solution.smoothed.push_back(epoch_of(data.imu[k].t_s, b));
  };
  const Progress second_half = [&](std::size_t done, std::size_t total) {
    return !progress || progress(total + done, 2 * total);
  };
  smooth(
      ekf, data, recorder.checkpoints, emit, [](std::size_t, const Belief<Model>&) {}, second_half);
  std::reverse(solution.smoothed.begin(), solution.smoothed.end());
  if (solution.smoothed.empty() || !solution.smoothed.front().X.first.p.allFinite()) {
    throw NumericalError("the smoothed trajectory is empty or not finite");
  }
  return solution;
}

}  // namespace liealign
