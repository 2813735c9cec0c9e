// A candidate of the bank and its score, as data: who proposes candidates or writes of them needs no filter.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "liealign/align/start_values.hpp"
#include "liealign/estimate/gating.hpp"

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

// Of one fix: the row of the GNSS log that it came from, and the length of its position innovation.
struct FixInnovation {
  std::size_t record = 0;
  double norm_m = 0.0;  // |z| of (Eq. 34)
};

}  // namespace liealign
