// What an estimator gives at an epoch: the state and the covariance blocks the output needs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/estimate/interval_smoother.hpp"

namespace liealign {

// X and the 3x3 diagonal blocks of the covariance of its left error (body axes; b_a, b_g by their diagonals).
struct Epoch {
  double t_s = 0.0;
  NavState<double> X;
  Matrix3d P_phi = Matrix3d::Zero(), P_nu = P_phi, P_rho = P_phi;  // rad^2, (m/s)^2, m^2
  Matrix3d P_relative = Matrix3d::Zero();        // m^2, of the position in the receiver's datum, (Eq. 83)
  Vector3d receiver_error_e = Vector3d::Zero();  // K c: p + K c is the position in the receiver's datum; ECEF, m
  Vector3d variance_b_a = Vector3d::Zero(), variance_b_g = variance_b_a;  // (m/s^2)^2, (rad/s)^2
};

Epoch epoch_of(double t_s, const NodeBelief& b);

// Of lane i.
Epoch epoch_of(double t_s, const NavBelief<Lanes>& b, int i, const InsideInterval& inside);

// An epoch in the terms of the output: geodetic, NED, Euler angles, one sigma. Angles in rad, lengths in m.
struct NavRow {
  double t_s, lat_rad, lon_rad, height_m;
  Vector3d v_n_mps, rpy_rad;  // yaw = heading in [0, 2 pi)
  Vector3d std_p_n_m, std_v_n_mps, std_rpy_rad, relative_std_p_n_m;
};

// Standard deviations from the left error: p_n by C_b_n rho, v_n by C_b_n nu, and Euler angles by
//   d(roll, pitch, yaw) = [1, s_r t_p, c_r t_p; 0, c_r, -s_r; 0, s_r/c_p, c_r/c_p] phi            (Eq. 41)
// Throws NumericalError when a variance is negative.
NavRow nav_row(const Epoch& epoch);

}  // namespace liealign
