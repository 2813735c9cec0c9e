// What a filter's start is made of, as data: its sigmas, its correction, and what a start in motion begins with.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/types.hpp"

namespace liealign {

// One sigma, SI.
struct InitialStd {
  double roll_pitch_rad = 0.0;  // at least; levelled by gravity, the tilt is off by accel_bias / g
  double velocity_mps = 0.0;
  double gyro_bias_rps = 0.0;
  double accel_bias_mps2 = 0.0;
};

// What a smoothed flight says of the tilt and the biases that it starts with. The filter is of first order in the errors of its
// start: from a corrected one it is of first order in what is left of them. Velocity and position need none of it.
struct StartCorrection {
  double roll_rad = 0.0, pitch_rad = 0.0;
  Vector<double, 6> biases = Vector<double, 6>::Zero();  // b_a, b_g

  bool operator==(const StartCorrection&) const = default;
};

// What a start in motion begins with: velocity and position of the antenna from the fixes, the tilt from the coarse stage.
struct MotionStatistics {
  double t_s = 0.0;
  double roll_rad = 0.0, pitch_rad = 0.0;
  double tilt_std_rad = 0.0;
  Vector3d p_ea_e = Vector3d::Zero();
  double position_std_m = 0.0;
  Vector3d v_ea_e = Vector3d::Zero();
  double velocity_std_mps = 0.0;
  Vector3d b_g_rps = Vector3d::Zero();
  double gyro_bias_std_rps = 0.0;  // of b_g, where that of InitialStd is larger
};

}  // namespace liealign
