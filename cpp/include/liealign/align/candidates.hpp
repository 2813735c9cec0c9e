// The candidate bank: the same flight run from several headings, each scored by (Eq. 33).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "liealign/align/initial.hpp"
#include "liealign/estimate/intervals.hpp"

namespace liealign {

// What the logs of a flight leave open besides the heading; factors and offsets to what the problem was prepared with.
struct FlightParameters {
  double latency_s = 0.0;        // of the GNSS stamps at t_start: t_true = stamp - latency - drift (t - t_start)
  double clock_drift = 0.0;      // s/s, of the IMU clock against the fixes'
  double imu_noise_scale = 1.0;  // on every noise of the IMU
  // On the accelerometers' besides: vibration and scale factors reach the two unequally.
  double accel_noise_scale = 1.0;
  double gnss_std_scale = 1.0;
  // On the velocities' besides: receivers state the two apart, or one of them not at all.
  double velocity_std_scale = 1.0;
  double turn_on_scale = 1.0;  // on the biases at the start, besides imu_noise_scale

  bool operator==(const FlightParameters&) const = default;
};

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

struct HeadingCandidate {
  double heading_rad = 0.0;
  double heading_std_rad = 0.0;  // 0: conditional, places the minimum; wide: finds the basin
  bool gated = false;      // else a wrong heading cannot lock out the fixes that show it; the score is bounded anyway
  GateScales gate_scales;  // of the score, and of the filter when gated
  FlightParameters parameters = {};
  StartCorrection start = {};
  bool smoothed = false;  // whether the score shall say what the flight, smoothed, says of its start
};

// A small change of a candidate's clock: of its latency at t_start [s] and of its drift [s/s].
struct ClockChange {
  double latency_s, drift;
};

// What one update adds to the cost.
struct ScoreTerm {
  double t_s;
  double cost;
};

struct CandidateScore {
  double cost = 0.0;     // (Eq. 33) without prior; +infinity when the filter failed
  double p_rms_m = 0.0;  // (Eq. 34)
  double nis_90 = 0.0;   // 90 % point of the positions' NIS; 6.25 where the noise model is right
  GateScales gate_scales, gate_scales_of_most;
  std::size_t fixes = 0;
  std::vector<ScoreTerm> terms = {};
  std::optional<StartCorrection> start = {};  // of a smoothed candidate; absent when its smoother failed
  double turn_rad = 0.0;                      // of the same: from its heading to that of its smoothed start
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

// Of one fix: the row of the GNSS log that it came from, and the length of its position innovation.
struct FixInnovation {
  std::size_t record = 0;
  double norm_m = 0.0;  // |z| of (Eq. 34)
};

// What the filter of one candidate was surprised by, fix by fix in time. Throws NumericalError when the filter fails.
std::vector<FixInnovation> fix_innovations(const AlignmentProblem& problem, const HeadingCandidate& candidate);

}  // namespace liealign
