// The trajectory of another point of the body, (Eq. 48).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/output_frame.hpp"

#include "liealign/observe/antenna_motion.hpp"

namespace liealign {

Epoch epoch_of(double t_s, const NodeBelief& b, const OutputFrame& frame, const Vector3d& omega_ib_b,
               double variance_omega) {
  Epoch epoch = epoch_of(t_s, b);
  if (frame.is_imu()) return epoch;
  const Belief<LieModel<double>>& belief = b.belief;
  const Vector3d omega = omega_ib_b - b_g(belief.X);
  const Seen<double> p = position_of(belief.X.first, frame.l_br_b);
  const Seen<double> v = velocity_of(belief.X.first, frame.l_br_b, omega);
  const Matrix3d C_r_e = belief.X.first.C * frame.C_r_b;
  epoch.X.first.C = C_r_e;
  epoch.X.first.v = v.h;
  epoch.X.first.p = p.h;
  const auto in_axes = [&](const Matrix3d& P_e) -> Matrix3d { return C_r_e.transpose() * P_e * C_r_e; };
  const Matrix3d arm = hat(frame.l_br_b);  // the noise of the rate moves the point by noise x l
  epoch.P_phi = frame.C_r_b.transpose() * epoch.P_phi * frame.C_r_b;
  epoch.P_rho = in_axes(p.H * belief.P * p.H.transpose());
  // rho of the point: rho - l x phi.
  const Matrix3d G = frame.C_r_b.transpose() * (b.error.G.rho - arm * b.error.G.phi);
  epoch.P_relative = relative_covariance<double>(epoch.P_rho, G, b.error.V, C_r_e.transpose() * b.root);
  epoch.P_nu = in_axes(v.H * belief.P * v.H.transpose()) +
               variance_omega * frame.C_r_b.transpose() * arm * arm.transpose() * frame.C_r_b;
  return epoch;
}

}  // namespace liealign
