// The coarse stage: heading, tilt and GNSS latency at once, before any filter runs.
//
// The gyros carry an attitude C_L(t) from the body axes of the start, L. The GNSS says the specific force over each second or
// two, alpha = a_n - g_n; the accelerometers say it in L:
//   beta_k = R alpha_k(latency) + noise,   beta = second difference of  int int C_L f  (positions), or first of  int C_L f   (Eq. 56)
// A rotation between two sets of vectors (Wahba): gravity shows its tilt, acceleration its heading, R by singular value
// decomposition, whatever the heading. Then Gauss-Newton steps with the biases, Huber weights and a prior on the biases:
//   R alpha - beta = hat(R alpha) delta + hat(beta) G b_g - C_L b_a,   G = int C_L                     (Eq. 57)
// in windows of a minute, for each latency of a grid; the latency is where the residuals of all windows are least.
// Source: the vectors of optimisation-based alignment (Wu et al. 2013), the latency by correlation of accelerations.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "liealign/estimate/flight_data.hpp"

namespace liealign {

struct CoarseOptions {
  double window_s = 60.0;
  double max_lag_s = 1.0;                // latencies tried; 0: the latency is known
  double gyro_bias_std_rps = 0.03;       // without a rest
  double rest_gyro_bias_std_rps = 5e-4;  // with the bias seen at rest
  double accel_bias_std_mps2 = 0.5;
};

// One window at its best latency.
struct CoarseWindow {
  double begin_s = 0.0, end_s = 0.0;
  double heading_rad = 0.0, heading_std_rad = 0.0;  // at t_ref, in (-pi, pi]
  double latency_s = 0.0;
  double modulus = 0.0;          // of the correlation of horizontal accelerations, 0 to 1
  double excitation_mps2 = 0.0;  // rms of the horizontal acceleration that the fixes show
};

struct CoarseMode {
  double heading_rad = 0.0, heading_std_rad = 0.0;
  double latency_s = 0.0, latency_std_s = 0.0;
  double weight = 0.0;  // share of the information of all windows
};

struct CoarseAlignment {
  std::vector<CoarseMode> modes;  // the heaviest first; empty where the motion shows no heading
  std::vector<CoarseWindow> windows;
  double roll_rad = 0.0, pitch_rad = 0.0, tilt_std_rad = 0.0;  // at t_ref
  Vector3d b_g_rps = Vector3d::Zero();
  double b_g_std_rps = 0.0;
};

// `imu` prepared, body axes; fixes with t_s = stamp minus the latency known so far: what comes out is to be added to it.
// b_g_rps: seen at rest, absent for a start in motion. Times in s; the log has to cover t_ref_s.
CoarseAlignment coarse_alignment(const ImuSeries& imu, const std::vector<GnssFix>& fixes, const Vector3d& l_ba_b,
                                 double t_ref_s, double t_end_s, const CoarseOptions& options = {},
                                 const std::optional<Vector3d>& b_g_rps = {});

}  // namespace liealign
