// The candidate bank: the same flight run from several headings, each scored by (Eq. 33).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "liealign/align/candidate.hpp"
#include "liealign/align/initial.hpp"
#include "liealign/estimate/intervals.hpp"

namespace liealign {

// Everything about a flight that the candidates share.
struct AlignmentProblem {
  FlightData data;  // with the fixes that lie inside the scored flight whatever the parameters
  FilterOptions filter;
  RestStatistics rest;
  std::optional<MotionStatistics> motion;  // of a start in motion, which has no rest
  InitialStd initial;
  double t_begin_s = 0.0;  // rest used for the pre-tuning of tilt and biases begins
  double t_start_s = 0.0;  // the last instant of rest, or the first in motion: candidate headings hold here
  double t_end_s = 0.0;    // fixes in (t_start_s, t_end_s] are scored
  // From t_begin_s to t_end_s, of preintegrate(). Without intervals the candidates go sample by sample, a few hundred times as
  // long at 1 Hz.
  SampleBlocks blocks;
  IntervalSeries intervals;
};

// The fixes as the parameters put and weigh them, listed as observations again.
FlightData with_parameters(const FlightData& data, const FlightParameters& parameters, double t_start_s);
FilterOptions with_parameters(FilterOptions options, const FlightParameters& parameters);
InitialStd with_parameters(InitialStd std, const FlightParameters& parameters);

// The belief that a run starts from: at t_begin_s at rest, at t_start_s in motion.
Belief<LieModel<double>> start_belief(const AlignmentProblem& problem, const InitialStd& initial, double heading_rad,
                                      double heading_std_rad, const StartCorrection& correction = {});

// The IMU of a problem, cut at its observations as these parameters put them.
IntervalSeries intervals_for(const AlignmentProblem& problem, const FlightParameters& parameters);

// Fills in the blocks and intervals of a problem: its IMU with the biases seen at rest, cut at its observations.
void preintegrate(AlignmentProblem& problem);

// One filter per candidate: pre-tuning at rest, then set_heading(), then the scored flight. Over intervals, neighbours that
// differ in their headings alone go side by side. Threads over candidates; the result does not depend on their number, nor on
// who goes beside whom.
std::vector<CandidateScore> evaluate_candidates(const AlignmentProblem& problem,
                                                const std::vector<HeadingCandidate>& candidates);

// The same of one candidate with its clock changed by some milliseconds at most, side by side: over its own intervals (of
// intervals_for()), carried on to the changed times of the fixes. For an estimated latency.
std::vector<CandidateScore> evaluate_clocks(const AlignmentProblem& problem, const IntervalSeries& series,
                                            const HeadingCandidate& candidate, const std::vector<ClockChange>& changes);

// What the filter of one candidate was surprised by, fix by fix in time. Throws NumericalError when the filter fails.
std::vector<FixInnovation> fix_innovations(const AlignmentProblem& problem, const HeadingCandidate& candidate);

}  // namespace liealign
