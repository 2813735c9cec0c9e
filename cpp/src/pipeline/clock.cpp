// The clock over the whole flight.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/clock.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/align/block_misfit.hpp"
#include "liealign/core/units.hpp"

namespace liealign {

HeadingResult with_clock_of_flight(const PreparedFlight& flight, HeadingResult found) {
  constexpr double kLongest_s = 1800.0, kLonger = 1.5;
  constexpr double kWidest_rad = 20.0 * kDegToRad;
  constexpr double kCarried_s = 5e-3;   // that evaluate_clocks() stands for
  constexpr double kSignificant = 3.0;  // sigmas of a drift, which goes on outside of what it is found in
  const double begin_s = flight.problem.t_start_s, was_s = flight.problem.t_end_s - begin_s;
  const double span_s = std::min(kLongest_s, flight.data.imu().back().t_s - begin_s), half_s = 0.5 * span_s;
  if (!found.parameters_std.latency_s || !found.sigma_rad || !found.settled || span_s < kLonger * was_s) return found;

  AlignmentProblem problem = flight.problem;
  problem.t_end_s = begin_s + span_s;
  problem.data = scored_data(flight, problem.t_end_s);

  // The latency in the middle and the drift, which there know little of each other. The heading is the filter's to find.
  const auto parameters_at = [&](const SurfaceVector& x) {
    FlightParameters parameters = found.parameters;
    parameters.latency_s = x[0] - half_s * x[1];
    parameters.clock_drift = x[1];
    return parameters;
  };
  HeadingCandidate candidate;
  const auto change_to = [&](const SurfaceVector& x) {
    const FlightParameters to = parameters_at(x), &from = candidate.parameters;
    return ClockChange{to.latency_s - from.latency_s, to.clock_drift - from.clock_drift};
  };
  candidate.heading_rad = found.heading_rad;
  candidate.heading_std_rad = std::min(5.0 * *found.sigma_rad, kWidest_rad);
  candidate.start = found.start;
  const FlightParameters& p = found.parameters;
  const double step_s = std::min(kCarried_s, 1.5 * *found.parameters_std.latency_s * std::sqrt(was_s / span_s));
  SurfaceVector x(2), steps(2);
  x << p.latency_s + half_s * p.clock_drift, p.clock_drift;
  steps << step_s, std::sqrt(12.0) * step_s / span_s;
  SurfaceSearch search(x, steps, {.tolerance_sigma = 2.0, .max_rounds = 10});
  candidate.parameters = parameters_at(x);
  IntervalSeries intervals = intervals_for(problem, candidate.parameters);
  std::vector<CandidateScore> scores;
  while (!search.done()) {
    const ClockChange moved = change_to(search.centre());
    if (std::max(std::abs(moved.latency_s), std::abs(moved.latency_s + span_s * moved.drift)) > kCarried_s) {
      candidate.parameters = parameters_at(search.centre());
      intervals = intervals_for(problem, candidate.parameters);
    }
    std::vector<ClockChange> changes;
    for (const SurfaceVector& at : search.ask()) changes.push_back(change_to(at));
    scores = evaluate_clocks(problem, intervals, candidate, changes);
    std::vector<double> costs;
    for (const CandidateScore& score : scores) costs.push_back(score.cost);
    found.evaluations += static_cast<int>(costs.size());
    search.tell(costs);
  }
  const Surface& surface = search.surface();
  if (!search.settled() || !surface.has_minimum) return found;
  SurfaceMatrix covariance = surface.covariance();
  const SurfaceVector misfit = block_misfit(covariance, search.steps(), scores);
  covariance = (misfit.asDiagonal() * covariance * misfit.asDiagonal()).eval();
  x = surface.minimum;
  const double drift_std = std::sqrt(covariance(1, 1));
  double latency_variance = covariance(0, 0);
  if (std::abs(x[1]) < kSignificant * drift_std) {
    x[0] -= covariance(0, 1) / covariance(1, 1) * x[1];
    x[1] = 0.0;
    latency_variance -= covariance(0, 1) * covariance(0, 1) / covariance(1, 1);
  } else {  // that of the start
    latency_variance += half_s * (half_s * covariance(1, 1) - 2.0 * covariance(0, 1));
  }
  found.parameters = parameters_at(x);
  found.parameters_std.latency_s = std::sqrt(latency_variance);
  found.parameters_std.clock_drift = drift_std;
  return found;
}

}  // namespace liealign
