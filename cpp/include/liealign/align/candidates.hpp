// The candidate bank: the same flight run from several headings, each scored by (Eq. 33).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "liealign/align/initial.hpp"
#include "liealign/estimate/intervals.hpp"

namespace liealign {

// Everything about a flight that the candidates share.
struct AlignmentProblem {
  FlightData data;
  FilterOptions filter;
  RestStatistics rest;
  InitialStd initial;
  double t_begin_s = 0.0;  // rest used for the pre-tuning of tilt and biases begins
  double t_start_s = 0.0;  // the last instant of rest: candidate headings hold here
  double t_end_s = 0.0;    // fixes in (t_start_s, t_end_s] are scored
  // From t_begin_s to t_end_s, of preintegrate(); empty: the candidates go sample by sample, 75 times as long at 1 Hz.
  IntervalSeries intervals;
};

struct HeadingCandidate {
  double heading_rad = 0.0;
  double heading_std_rad = 0.0;  // 0: conditional, places the minimum; wide: finds the basin
  bool gated = false;      // else a wrong heading cannot lock out the fixes that show it; the score is bounded anyway
  GateScales gate_scales;  // of the score, and of the filter when gated
};

struct CandidateScore {
  double cost = 0.0;     // (Eq. 33) without prior; +infinity when the filter failed
  double p_rms_m = 0.0;  // (Eq. 34)
  double nis_90 = 0.0;   // 90 % point of the positions' NIS; 6.25 where the noise model is right
  GateScales gate_scales;
  std::size_t fixes = 0;
};

// The IMU of the problem, cut at its events and preintegrated with the biases seen at rest.
IntervalSeries preintegrate(const AlignmentProblem& problem);

// One filter per candidate: pre-tuning at rest, then set_heading(), then the scored flight. Threads over candidates; the
// result does not depend on their number.
std::vector<CandidateScore> evaluate_candidates(const AlignmentProblem& problem,
                                                const std::vector<HeadingCandidate>& candidates);

// Of one fix: the row of the GNSS log that it came from, and the length of its position innovation.
struct FixInnovation {
  std::size_t record = 0;
  double norm_m = 0.0;  // |z| of (Eq. 34)
};

// What the filter of one candidate was surprised by, fix by fix in time. Throws NumericalError when the filter fails.
std::vector<FixInnovation> fix_innovations(const AlignmentProblem& problem, const HeadingCandidate& candidate);

}  // namespace liealign
