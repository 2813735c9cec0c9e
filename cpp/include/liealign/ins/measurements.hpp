// Measurement models on SE_2(3) x T(6): what is seen, and its derivative by the left error (phi, nu, rho, b_a, b_g).
//
//   GNSS position   h = p + C l                              H = [-C hat(l), 0, C, 0, 0]         (Eq. 19)
//   GNSS velocity   h = v + C (w x l) - omega_ie x C l       H = [hat(omega_ie) C hat(l) - C hat(w x l), C, 0, 0, C hat(l)]  (Eq. 20)
//   zero velocity   h = v                                    H = [0, C, 0, 0, 0]                  (Eq. 21)
//   zero rate       h = C^T omega_ie + b_g                   H = [hat(C^T omega_ie), 0, 0, 0, I]  (Eq. 22)
//
// l = l_ba_b, w = omega_ib_b (bias corrected), all ECEF but the zero rate, which is in body axes.
// Source: TAES (22), (14h); Groves (2013) 14.3.2 for the lever arm's rotation term.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/types.hpp"
#include "liealign/earth/wgs84.hpp"
#include "liealign/lie/product.hpp"
#include "liealign/lie/se23.hpp"
#include "liealign/lie/translation.hpp"

namespace liealign {

// The state of TAES (19): X.first = (C_b_e, v_eb_e, p_eb_e), X.second = (b_a, b_g).
template <typename Scalar>
using NavState = Product<SE23<Scalar>, Translation<Scalar, 6>>;

// Offsets of the error blocks.
inline constexpr int kPhi = 0, kNu = 3, kRho = 6, kBa = 9, kBg = 12;

template <typename Scalar>
Vector3<Scalar> b_a(const NavState<Scalar>& X) {
  return X.second.x.template head<3>();
}
template <typename Scalar>
Vector3<Scalar> b_g(const NavState<Scalar>& X) {
  return X.second.x.template tail<3>();
}

template <typename Scalar>
struct Prediction {
  Vector3<Scalar> h;
  Eigen::Matrix<Scalar, 3, 15> H;
};

// (Eq. 19); l_ba_b in m.
template <typename Scalar>
Prediction<Scalar> predict_gnss_position(const NavState<Scalar>& X, const Vector3d& l_ba_b) {
  const Vector3<Scalar> l = l_ba_b.cast<Scalar>();
  Prediction<Scalar> m{X.first.p + X.first.C * l, Eigen::Matrix<Scalar, 3, 15>::Zero()};
  m.H.template middleCols<3>(kPhi) = -X.first.C * hat(l);
  m.H.template middleCols<3>(kRho) = X.first.C;
  return m;
}

// (Eq. 20); omega_ib_b [rad/s] already without its bias.
template <typename Scalar>
Prediction<Scalar> predict_gnss_velocity(const NavState<Scalar>& X, const Vector3d& l_ba_b,
                                         const Vector3<Scalar>& omega_ib_b) {
  const Matrix3<Scalar>& C = X.first.C;
  const Vector3<Scalar> l = l_ba_b.cast<Scalar>();
  const Vector3<Scalar> omega_ie = wgs84::omega_ie_e<Scalar>();
  const Vector3<Scalar> w_l = omega_ib_b.cross(l);
  Prediction<Scalar> m{X.first.v + C * w_l - omega_ie.cross(C * l), Eigen::Matrix<Scalar, 3, 15>::Zero()};
  m.H.template middleCols<3>(kPhi) = hat(omega_ie) * C * hat(l) - C * hat(w_l);
  m.H.template middleCols<3>(kNu) = C;
  m.H.template middleCols<3>(kBg) = C * hat(l);
  return m;
}

// (Eq. 21).
template <typename Scalar>
Prediction<Scalar> predict_zero_velocity(const NavState<Scalar>& X) {
  Prediction<Scalar> m{X.first.v, Eigen::Matrix<Scalar, 3, 15>::Zero()};
  m.H.template middleCols<3>(kNu) = X.first.C;
  return m;
}

// (Eq. 22): what a gyro at rest reads.
template <typename Scalar>
Prediction<Scalar> predict_zero_rate(const NavState<Scalar>& X) {
  const Vector3<Scalar> omega_ie_b = X.first.C.transpose() * wgs84::omega_ie_e<Scalar>();
  Prediction<Scalar> m{omega_ie_b + b_g(X), Eigen::Matrix<Scalar, 3, 15>::Zero()};
  m.H.template middleCols<3>(kPhi) = hat(omega_ie_b);
  m.H.template middleCols<3>(kBg) = Matrix3<Scalar>::Identity();
  return m;
}

}  // namespace liealign
