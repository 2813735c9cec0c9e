// The candidate bank.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/candidates.hpp"

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

CandidateScore evaluate(const AlignmentProblem& problem, const HeadingCandidate& candidate) {
  const FlightData& data = problem.data;
  const FilterOptions scoring = with_gates(problem.filter, candidate.gate_scales);
  FilterOptions filter = candidate.gated ? scoring : ungated(scoring);
  filter.reacquire_after = 0;  // every candidate scores the same fixes
  Belief<Model> belief = belief_at_rest(problem.rest, candidate.heading_rad, candidate.heading_std_rad, problem.initial,
                                        data.l_ba_b, filter.dynamics.gravity);
  ImuCursor cursor = cursor_at(data.imu, problem.t_begin_s);
  SilentVisitor<Model> silent;
  cursor = forward_pass(data, filter, belief, cursor, problem.t_start_s, silent);
  const Ekf<Model> ekf{filter.dynamics, filter.covariance_reset};
  propagate_to(ekf, data.imu, problem.t_start_s, cursor, belief, silent);
  set_heading(belief, candidate.heading_rad, candidate.heading_std_rad, data.l_ba_b);

  ScoringVisitor visitor{{}, scoring, {}};
  forward_pass(data, filter, belief, cursor, problem.t_end_s, visitor);
  return {visitor.score.negative_log_likelihood, visitor.score.p_rms(), visitor.score.nis_90(),
          visitor.score.gate_scales(), visitor.score.positions};
}

}  // namespace

std::vector<CandidateScore> evaluate_candidates(const AlignmentProblem& problem,
                                                const std::vector<HeadingCandidate>& candidates) {
  std::vector<CandidateScore> scores(candidates.size());
  const auto n = static_cast<std::ptrdiff_t>(candidates.size());
  std::vector<std::exception_ptr> failures(candidates.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    try {
      scores[k] = evaluate(problem, candidates[k]);
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

}  // namespace liealign
