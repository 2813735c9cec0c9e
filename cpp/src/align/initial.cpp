// Initial conditions, (Eq. 35)-(Eq. 37).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/initial.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"

namespace liealign {

Vector<double, 2> level(const Vector3d& mean_f_ib_b) {
  const Vector3d& f = mean_f_ib_b;
  return {std::atan2(-f.y(), -f.z()), std::atan2(f.x(), std::hypot(f.y(), f.z()))};
}

StartCorrection correction_between(const NavState<double>& from, const NavState<double>& to) {
  const auto rpy_of = [](const SE23<double>& nav) { return rpy_from_C_b_n(C_n_e(nav.p).transpose() * nav.C); };
  const Vector3d turned = rpy_of(to.first) - rpy_of(from.first);
  return {std::remainder(turned[0], 2.0 * kPi), turned[1], to.second.x - from.second.x};
}

NavState<double> corrected(const NavState<double>& start, const StartCorrection& correction, const Vector3d& l_ba_b) {
  if (correction == StartCorrection{}) return start;
  NavState<double> X = start;
  SE23<double>& nav = X.first;
  const Matrix3d C_n_e_here = C_n_e(nav.p);
  const Vector3d rpy = rpy_from_C_b_n(C_n_e_here.transpose() * nav.C);
  const Vector3d p_ea_e = nav.p + nav.C * l_ba_b;
  nav.C = C_n_e_here * C_b_n_from_rpy({rpy[0] + correction.roll_rad, rpy[1] + correction.pitch_rad, rpy[2]});
  nav.p = p_ea_e - nav.C * l_ba_b;
  X.second.x += correction.biases;
  return X;
}

namespace {

// What an error of first order can carry.
constexpr double kWidestTilt_rad = 20.0 * kDegToRad;

// (Eq. 36): attitude variances along north, east and down, velocity in body axes, position of the antenna in ECEF axes.
LieModel<double>::Covariance initial_covariance(const SE23<double>& nav, const Vector3d& std_phi_n,
                                                const Matrix3d& P_v_b, const Matrix3d& R_p_e, const InitialStd& std,
                                                const Vector3d& l_ba_b) {
  const Matrix3d& C_b_e = nav.C;
  const Matrix3d C_b_n = C_n_e(nav.p).transpose() * C_b_e;
  const Matrix3d P_phi = C_b_n.transpose() * std_phi_n.cwiseAbs2().asDiagonal() * C_b_n;
  const Matrix3d l = hat(l_ba_b);
  LieModel<double>::Covariance P = LieModel<double>::Covariance::Zero();
  P.block<3, 3>(kPhi, kPhi) = P_phi;
  P.block<3, 3>(kNu, kNu) = P_v_b;
  P.block<3, 3>(kRho, kRho) = C_b_e.transpose() * R_p_e * C_b_e + l * P_phi * l.transpose();
  P.block<3, 3>(kRho, kPhi) = l * P_phi;
  P.block<3, 3>(kPhi, kRho) = P_phi * l.transpose();
  P.block<3, 3>(kBa, kBa) = std.accel_bias_mps2 * std.accel_bias_mps2 * Matrix3d::Identity();
  P.block<3, 3>(kBg, kBg) = std.gyro_bias_rps * std.gyro_bias_rps * Matrix3d::Identity();
  return P;
}

}  // namespace

Belief<LieModel<double>> belief_at_rest(const RestStatistics& rest, double heading_rad, double heading_std_rad,
                                        const InitialStd& std, const Vector3d& l_ba_b, GravityModel gravity,
                                        const StartCorrection& correction) {
  const Vector3d& f = rest.mean_f_ib_b;
  const Vector<double, 2> roll_pitch = level(f);
  const Matrix3d C_b_n = C_b_n_from_rpy({roll_pitch[0], roll_pitch[1], heading_rad});
  Belief<LieModel<double>> belief;
  SE23<double>& nav = belief.X.first;
  nav.C = C_n_e(rest.p_ea_e) * C_b_n;
  nav.p = rest.p_ea_e - nav.C * l_ba_b;
  const double g = gravity_e(nav.p, gravity).norm();
  belief.X.second.x << f * (1.0 - g / f.norm()), rest.mean_omega_ib_b - nav.C.transpose() * wgs84::omega_ie_e();
  belief.X = corrected(belief.X, correction, l_ba_b);

  const double tilt = std::min(std::max(std.roll_pitch_rad, std.accel_bias_mps2 / g), kWidestTilt_rad);
  belief.P = initial_covariance(nav, Vector3d(tilt, tilt, heading_std_rad),
                                std.velocity_mps * std.velocity_mps * Matrix3d::Identity(), rest.R_p_e, std, l_ba_b);
  return belief;
}

Belief<LieModel<double>> belief_in_motion(const MotionStatistics& motion, double heading_rad, double heading_std_rad,
                                          const InitialStd& std, const Vector3d& l_ba_b,
                                          const StartCorrection& correction) {
  const Matrix3d C_b_n = C_b_n_from_rpy({motion.roll_rad, motion.pitch_rad, heading_rad});
  Belief<LieModel<double>> belief;
  SE23<double>& nav = belief.X.first;
  nav.C = C_n_e(motion.p_ea_e) * C_b_n;
  nav.v = motion.v_ea_e;
  nav.p = motion.p_ea_e - nav.C * l_ba_b;
  belief.X.second.x << Vector3d::Zero(), motion.b_g_rps;
  belief.X = corrected(belief.X, correction, l_ba_b);
  InitialStd wide = std;
  wide.gyro_bias_rps = std::max(std.gyro_bias_rps, motion.gyro_bias_std_rps);
  const double tilt =
      std::min(std::hypot(motion.tilt_std_rad, std.accel_bias_mps2 / kStandardGravity), kWidestTilt_rad);
  belief.P = initial_covariance(nav, Vector3d(tilt, tilt, heading_std_rad),
                                motion.velocity_std_mps * motion.velocity_std_mps * Matrix3d::Identity(),
                                motion.position_std_m * motion.position_std_m * Matrix3d::Identity(), wide, l_ba_b);
  return belief;
}

double heading_of(const NavState<double>& X) {
  const Vector3d forward_n = C_n_e(X.first.p).transpose() * X.first.C.col(0);
  return std::atan2(forward_n.y(), forward_n.x());
}

void set_heading(Belief<LieModel<double>>& belief, double heading_rad, double heading_std_rad, const Vector3d& l_ba_b) {
  SE23<double>& nav = belief.X.first;
  const Vector3d down_e = C_n_e(nav.p).col(2);
  const Vector3d antenna = nav.p + nav.C * l_ba_b;
  const Matrix3d turn = gamma<0>(Vector3d(down_e * (heading_rad - heading_of(belief.X))));
  nav.C = turn * nav.C;
  nav.v = turn * nav.v;
  nav.p = antenna - nav.C * l_ba_b;

  using Tangent = LieModel<double>::Tangent;
  Tangent u = Tangent::Zero(), w = Tangent::Zero();
  const Vector3d down_b = nav.C.transpose() * down_e;
  u.segment<3>(kPhi) = down_b;
  u.segment<3>(kNu) = down_b.cross(nav.C.transpose() * nav.v);
  u.segment<3>(kRho) = l_ba_b.cross(down_b);
  w.segment<3>(kPhi) = down_b;
  const LieModel<double>::Covariance Pi = LieModel<double>::Covariance::Identity() - u * w.transpose();
  belief.P = (Pi * belief.P * Pi.transpose() + heading_std_rad * heading_std_rad * u * u.transpose()).eval();
  Ekf<LieModel<double>>::symmetrise(belief.P);
}

}  // namespace liealign
