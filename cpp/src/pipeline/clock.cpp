// The clock over the whole flight.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/clock.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/align/block_misfit.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

// Latency in the middle of the span and drift, which there know little of each other.
struct ClockFit {
  SurfaceVector x;
  SurfaceMatrix covariance;
  bool settled = false;
  int evaluations = 0;
};

FlightParameters with_clock(FlightParameters parameters, const SurfaceVector& x, double half_s) {
  parameters.latency_s = x[0] - half_s * x[1];
  parameters.clock_drift = x[1];
  return parameters;
}

// From the clock of the candidate; step_s is the first step of the latency.
ClockFit fit_clock(const AlignmentProblem& problem, HeadingCandidate candidate, double half_s, double step_s) {
  constexpr double kCarried_s = 5e-3;  // that evaluate_clocks() stands for
  const auto change_to = [&](const SurfaceVector& x) {
    const FlightParameters to = with_clock(candidate.parameters, x, half_s), &from = candidate.parameters;
    return ClockChange{to.latency_s - from.latency_s, to.clock_drift - from.clock_drift};
  };
  step_s = std::min(step_s, kCarried_s);
  SurfaceVector x(2), steps(2);
  x << candidate.parameters.latency_s + half_s * candidate.parameters.clock_drift, candidate.parameters.clock_drift;
  steps << step_s, std::sqrt(3.0) * step_s / half_s;  // by the ratio of the sigmas
  SurfaceSearch search(x, steps, {.tolerance_sigma = 2.0, .max_rounds = 10});
  IntervalSeries intervals = intervals_for(problem, candidate.parameters);
  std::vector<CandidateScore> scores;
  ClockFit fit;
  while (!search.done()) {
    const ClockChange moved = change_to(search.centre());
    if (std::max(std::abs(moved.latency_s), std::abs(moved.latency_s + 2.0 * half_s * moved.drift)) > kCarried_s) {
      candidate.parameters = with_clock(candidate.parameters, search.centre(), half_s);
      intervals = intervals_for(problem, candidate.parameters);
    }
    std::vector<ClockChange> changes;
    changes.reserve(search.ask().size());
    for (const SurfaceVector& at : search.ask()) changes.push_back(change_to(at));
    scores = evaluate_clocks(problem, intervals, candidate, changes);
    std::vector<double> costs;
    costs.reserve(scores.size());
    for (const CandidateScore& score : scores) costs.push_back(score.cost);
    fit.evaluations += static_cast<int>(costs.size());
    search.tell(costs);
  }
  const Surface& surface = search.surface();
  fit.settled = search.settled() && surface.has_minimum;
  if (!fit.settled) return fit;
  fit.x = surface.minimum;
  fit.covariance = surface.covariance();
  const SurfaceVector misfit = block_misfit(fit.covariance, search.steps(), scores);
  fit.covariance = (misfit.asDiagonal() * fit.covariance * misfit.asDiagonal()).eval();
  return fit;
}

}  // namespace

HeadingResult with_clock_of_flight(const PreparedFlight& flight, HeadingResult found) {
  constexpr double kLongest_s = 1800.0, kLonger = 1.5;
  constexpr double kWidest_rad = 20.0 * kDegToRad;
  constexpr double kSignificant = 3.0;  // sigmas of a drift, which goes on outside of what it is found in
  const double begin_s = flight.problem.t_start_s, was_s = flight.problem.t_end_s - begin_s;
  const double span_s = std::min(kLongest_s, flight.data.imu().back().t_s - begin_s), half_s = 0.5 * span_s;
  if (!found.parameters_std.latency_s || !found.sigma_rad || !found.settled || span_s < kLonger * was_s) return found;

  AlignmentProblem problem = flight.problem;
  problem.t_end_s = begin_s + span_s;
  problem.data = scored_data(flight, problem.t_end_s);
  HeadingCandidate candidate;
  candidate.heading_rad = found.heading_rad;
  candidate.heading_std_rad = std::min(5.0 * *found.sigma_rad, kWidest_rad);  // the filter's to find
  candidate.parameters = found.parameters;
  candidate.start = found.start;
  ClockFit fit =
      fit_clock(problem, candidate, half_s, 1.5 * *found.parameters_std.latency_s * std::sqrt(was_s / span_s));
  found.evaluations += fit.evaluations;
  if (!fit.settled) return found;

  const SurfaceMatrix& P = fit.covariance;
  const double drift_std = std::sqrt(P(1, 1));
  double latency_variance = P(0, 0);
  if (std::abs(fit.x[1]) < kSignificant * drift_std) {  // without drift
    fit.x[0] -= P(0, 1) / P(1, 1) * fit.x[1];
    fit.x[1] = 0.0;
    latency_variance -= P(0, 1) * P(0, 1) / P(1, 1);
  } else {  // that of the start
    latency_variance += half_s * (half_s * P(1, 1) - 2.0 * P(0, 1));
  }
  found.parameters = with_clock(found.parameters, fit.x, half_s);
  found.parameters_std.latency_s = std::sqrt(latency_variance);
  found.parameters_std.clock_drift = drift_std;
  return found;
}

}  // namespace liealign
