// Rest detection: when did the vehicle stand still, and what did its sensors say then.
//
// A window (half a second) is at rest when rate and force vary little inside it, their means stay where the rest so far
// had them, and the fixes stay within their noise and do not move; where there are fixes, a rest ends with the last one that
// agrees. "Nowhere" is a valid answer. Source: DESIGN; TAES IV-D.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/estimate/flight_data.hpp"

namespace liealign {

struct RestLimits {
  double min_duration_s;
  double gyro_std_rps;   // inside a window, any axis
  double gyro_mean_rps;  // change of the window mean against the rest so far
  double accel_std_mps2 = 0.4;
  double accel_mean_mps2 = 0.15;
  double gnss_drift_sigma;  // position against the mean of the rest so far, in standard deviations of a fix
};

struct RestPeriod {
  double begin_s = 0.0;
  double end_s = 0.0;
};

// Rest periods of at least min_duration_s, in time order. `imu` prepared, body axes.
std::vector<RestPeriod> find_rests(const ImuSeries& imu, const std::vector<GnssFix>& fixes, const RestLimits& limits);

// Averages over a rest: what initial conditions are made of.
struct RestStatistics {
  RestPeriod period;
  Vector3d mean_omega_ib_b = Vector3d::Zero();  // rad/s, measured
  Vector3d mean_f_ib_b = Vector3d::Zero();      // m/s^2, measured
  std::size_t fixes = 0;
  Vector3d p_ea_e = Vector3d::Zero();  // mean antenna position
  Matrix3d R_p_e = Matrix3d::Zero();   // of one fix: errors of successive fixes are common, averaging gains little
};

RestStatistics rest_statistics(const ImuSeries& imu, const std::vector<GnssFix>& fixes, const RestPeriod& period);

// One RestUpdate per interval_s inside the period.
std::vector<RestUpdate> rest_updates(const ImuSeries& imu, const RestPeriod& period, double interval_s);

}  // namespace liealign
