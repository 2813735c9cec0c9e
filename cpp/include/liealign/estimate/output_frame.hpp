// The trajectory of another point and other axes of the body: a camera, a scanner, a radar antenna.
//
// With the lever arm l from the IMU to the point and C_r_b from the wanted axes r to the body:
//   p = p_eb_e + C_b_e l,  v = v_eb_e + C_b_e (omega_ib_b x l) - omega_ie_e x C_b_e l,  C_r_e = C_b_e C_r_b   (Eq. 48)
// The first two are the measurement models of an antenna at l, (Eq. 19) and (Eq. 20), and so are their errors: the
// correlation of position with attitude is in them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/estimate/solution.hpp"

namespace liealign {

struct OutputFrame {
  Vector3d l_br_b = Vector3d::Zero();     // m, from the IMU to the point
  Matrix3d C_r_b = Matrix3d::Identity();  // from the wanted axes to the body

  bool is_imu() const { return l_br_b.isZero(0.0) && C_r_b.isIdentity(0.0); }
};

// The epoch of the point, (Eq. 48); biases stay those of the IMU, in its axes. omega_ib_b [rad/s] is what the gyros
// read at t_s, variance_omega [(rad/s)^2] its white noise.
Epoch epoch_of(double t_s, const NodeBelief& belief, const OutputFrame& frame, const Vector3d& omega_ib_b,
               double variance_omega);

}  // namespace liealign
