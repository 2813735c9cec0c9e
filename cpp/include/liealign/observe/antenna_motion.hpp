// Position, velocity and acceleration of a point of the body, and their derivatives by the left error.
//
//   p_a = p + C l                                                H_p = [-C hat(l), 0, C, 0, 0]
//   v_a = v + C (w x l) - omega_ie x C l                         H_v = [hat(omega_ie) C hat(l) - C hat(w x l), C, 0, 0, C hat(l)]
//   a_a = C (f + w x (w x l)) + g - 2 omega_ie x v               H_a = [-C hat(f + w x (w x l)), -2 hat(omega_ie) C, 0, -C, C M]
//   M = hat(w) hat(l) + hat(w x l)                                                               (Eq. 80)
//
// l = lever arm, w = omega_ib_b, f = f_ib_b (bias corrected), ECEF. The gradient of gravity is left out of H_a.
// Source: Groves (2013) 14.3.2 for the first two.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/earth/gravity.hpp"
#include "liealign/earth/wgs84.hpp"
#include "liealign/observe/observation.hpp"

namespace liealign {

// A vector in ECEF axes and its derivative.
template <typename Scalar>
struct Seen {
  Vector3<Scalar> h;
  Eigen::Matrix<Scalar, 3, kTail> H = Eigen::Matrix<Scalar, 3, kTail>::Zero();
};

template <typename Scalar>
Seen<Scalar> position_of(const SE23<Scalar>& X, const Vector3<Scalar>& l) {
  Seen<Scalar> seen;
  seen.h = X.p + X.C * l;
  seen.H.template middleCols<3>(kPhi) = -X.C * hat(l);
  seen.H.template middleCols<3>(kRho) = X.C;
  return seen;
}

template <typename Scalar>
Seen<Scalar> velocity_of(const SE23<Scalar>& X, const Vector3<Scalar>& l, const Vector3<Scalar>& omega_ib_b) {
  const Vector3<Scalar> omega_ie = wgs84::omega_ie_e<Scalar>(), w_l = omega_ib_b.cross(l);
  Seen<Scalar> seen;
  seen.h = X.v + X.C * w_l - omega_ie.cross(X.C * l);
  seen.H.template middleCols<3>(kPhi) = hat(omega_ie) * X.C * hat(l) - X.C * hat(w_l);
  seen.H.template middleCols<3>(kNu) = X.C;
  seen.H.template middleCols<3>(kBg) = X.C * hat(l);
  return seen;
}

template <typename Scalar>
Seen<Scalar> acceleration_of(const SE23<Scalar>& X, const Vector3<Scalar>& l, const Vector3<Scalar>& omega_ib_b,
                             const Vector3<Scalar>& f_ib_b) {
  const Vector3<Scalar> omega_ie = wgs84::omega_ie_e<Scalar>(), w_l = omega_ib_b.cross(l),
                        f = f_ib_b + omega_ib_b.cross(w_l);
  Seen<Scalar> seen;
  seen.h = X.C * f + gravity_e(X.p, GravityModel::normal) - Scalar(2) * omega_ie.cross(X.v);
  seen.H.template middleCols<3>(kPhi) = -X.C * hat(f);
  seen.H.template middleCols<3>(kNu) = Scalar(-2) * hat(omega_ie) * X.C;
  seen.H.template middleCols<3>(kBa) = -X.C;
  seen.H.template middleCols<3>(kBg) = X.C * (hat(omega_ib_b) * hat(l) + hat(w_l));
  return seen;
}

}  // namespace liealign
