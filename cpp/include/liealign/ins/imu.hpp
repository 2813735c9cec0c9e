// IMU data and error model: omega~ = omega_ib_b + b_g + noise, f~ = f_ib_b + b_a + noise.
// Source: TAES (17)-(18); docs/equations.md (Eq. 10)-(Eq. 11).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "liealign/core/types.hpp"

namespace liealign {

// One sample of an IMU log. As read: whatever `ImuSampleKind` says. After prepare_imu(): the constant
// rotation rate and specific force over (t_s of the sample before, t_s] that give its exact increments.
struct ImuSample {
  double t_s = 0.0;
  Vector3d omega_ib_b = Vector3d::Zero();  // rad/s
  Vector3d f_ib_b = Vector3d::Zero();      // m/s^2
  double gap_s = 0.0;                      // prepared: the gap of the log that this sample bridges; 0 for none
};

using ImuSeries = std::vector<ImuSample>;

// What a logged sample is: the mean over the interval that ends at its stamp, the value at its stamp,
// or the increments over that interval (rad and m/s in the fields of ImuSample).
enum class ImuSampleKind { mean, instant, increment };

struct NoiseShape;

// Root power spectral densities, SI.
struct ImuNoise {
  double gyro_arw = 0.0;                              // rad/sqrt(s), angular random walk N_g
  double accel_vrw = 0.0;                             // m/s/sqrt(s), velocity random walk N_a
  double gyro_bias_rw = 0.0;                          // rad/s/sqrt(s), random walk of b_g: sqrt(2 sigma^2 / tau_c)
  double accel_bias_rw = 0.0;                         // m/s^2/sqrt(s), random walk of b_a
  double gyro_gap_rps = 0.0;                          // rad/s, unknown rate inside a gap of the log
  double accel_gap_mps2 = 0.0;                        // m/s^2, unknown specific force inside a gap of the log
  std::shared_ptr<const NoiseShape> shape = nullptr;  // of gyro_arw and accel_vrw along the log; none: constant
};

// The same with the noises of either sensor times its scale; what a gap of the log hides does not depend on them.
inline ImuNoise scaled(ImuNoise noise, double gyro_scale, double accel_scale) {
  noise.gyro_arw *= gyro_scale;
  noise.gyro_bias_rw *= gyro_scale;
  noise.accel_vrw *= accel_scale;
  noise.accel_bias_rw *= accel_scale;
  return noise;
}

}  // namespace liealign
