// The candidate bank.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/candidates.hpp"

#include <algorithm>
#include <exception>
#include <limits>

#include "liealign/estimate/score.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;

struct ScoringVisitor : SilentVisitor<Model> {
  FilterOptions options;
  Score<double> score;

  void updated(const Event&, UpdateKind kind, const Innovation<double>& innovation) {
    score.add(options, kind, innovation);
  }
};

struct RecordingVisitor : SilentVisitor<Model> {
  const FlightData& data;
  std::vector<FixInnovation> innovations;

  void updated(const Event& event, UpdateKind kind, const Innovation<double>& innovation) {
    if (kind == UpdateKind::position) innovations.push_back({data.fixes[event.index].record, innovation.z.norm()});
  }
};

// `motion` stands at t_begin_s and goes through the pre-tuning and, shown to the visitor, the scored flight.
template <typename Motion, typename Visitor>
void run(const AlignmentProblem& problem, Motion motion, const HeadingCandidate& candidate, Visitor& visitor) {
  const FlightData& data = problem.data;
  const FilterOptions scoring = with_gates(problem.filter, candidate.gate_scales);
  FilterOptions filter = candidate.gated ? scoring : ungated(scoring);
  filter.reacquire_after = 0;  // every candidate scores the same fixes
  Belief<Model> belief = belief_at_rest(problem.rest, candidate.heading_rad, candidate.heading_std_rad, problem.initial,
                                        data.l_ba_b, filter.dynamics.gravity);
  SilentVisitor<Model> silent;
  forward_pass(motion, data, filter, belief, problem.t_start_s, silent);
  const Ekf<Model> ekf{filter.dynamics, filter.covariance_reset};
  motion.move_to(problem.t_start_s, ekf, belief, silent);
  set_heading(belief, candidate.heading_rad, candidate.heading_std_rad, data.l_ba_b);
  forward_pass(motion, data, filter, belief, problem.t_end_s, visitor);
}

template <typename Motion>
CandidateScore evaluate(const AlignmentProblem& problem, const Motion& motion, const HeadingCandidate& candidate) {
  ScoringVisitor visitor{{}, with_gates(problem.filter, candidate.gate_scales), {}};
  run(problem, motion, candidate, visitor);
  return {visitor.score.negative_log_likelihood, visitor.score.p_rms(), visitor.score.nis_90(),
          visitor.score.gate_scales(), visitor.score.positions};
}

template <typename Motion>
std::vector<CandidateScore> evaluate_all(const AlignmentProblem& problem, const Motion& motion,
                                         const std::vector<HeadingCandidate>& candidates) {
  std::vector<CandidateScore> scores(candidates.size());
  const auto n = static_cast<std::ptrdiff_t>(candidates.size());
  std::vector<std::exception_ptr> failures(candidates.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    try {
      scores[k] = evaluate(problem, motion, candidates[k]);
    } catch (const NumericalError&) {
      // A heading so wrong that its filter breaks down is simply the worst.
      scores[k].cost = std::numeric_limits<double>::infinity();
    } catch (...) {
      failures[k] = std::current_exception();  // none may leave a parallel region
    }
  }
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
  return scores;
}

}  // namespace

IntervalSeries preintegrate(const AlignmentProblem& problem) {
  std::vector<double> stops = {problem.t_begin_s};
  for (const Event& event : problem.data.events) {
    if (event.t_s > problem.t_begin_s && event.t_s <= problem.t_end_s) stops.push_back(event.t_s);
  }
  stops.push_back(problem.t_start_s);
  std::sort(stops.begin(), stops.end());
  // Attitude is not known yet; the Earth's rate, which the gyro bias so contains, is a small one.
  const Belief<Model> at_rest =
      belief_at_rest(problem.rest, 0.0, 0.0, problem.initial, problem.data.l_ba_b, problem.filter.dynamics.gravity);
  return preintegrate(problem.data.imu, stops, at_rest.X.second.x, problem.filter.dynamics.noise);
}

namespace {

// act(motion) with the motion that the problem has. `paper` has no closed form over an interval.
template <typename Act>
auto with_motion(const AlignmentProblem& problem, const Act& act) {
  if (!problem.intervals.intervals.empty() && problem.filter.dynamics.mechanization == Mechanization::exact)
    return act(ByIntervals(problem.intervals));
  return act(BySamples{problem.data.imu, cursor_at(problem.data.imu, problem.t_begin_s)});
}

}  // namespace

std::vector<CandidateScore> evaluate_candidates(const AlignmentProblem& problem,
                                                const std::vector<HeadingCandidate>& candidates) {
  return with_motion(problem, [&](const auto& motion) { return evaluate_all(problem, motion, candidates); });
}

std::vector<FixInnovation> fix_innovations(const AlignmentProblem& problem, const HeadingCandidate& candidate) {
  RecordingVisitor visitor{{}, problem.data, {}};
  with_motion(problem, [&](const auto& motion) { run(problem, motion, candidate, visitor); });
  return visitor.innovations;
}

}  // namespace liealign
