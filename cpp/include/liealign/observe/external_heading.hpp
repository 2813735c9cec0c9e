// The direction of a baseline of the body against north: two antennas, or whatever else gives a heading.
//
//   y = psi - psi' dl_p + n,   psi = atan2(d_E, d_N),   d = C_b_n u,   u: the baseline in the body
//   d psi = a^T delta d,  a = (d_N e_E - d_E e_N) / (d_N^2 + d_E^2):   H_phi = -a^T C_b_n hat(u),  psi' = a^T C_b_n (w x u)   (Eq. 81)
//
// It comes with the position of its message, and as late as that: it is of the attitude C exp(-w dl_p).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/observe/observation.hpp"

namespace liealign {

struct ExternalHeading {
  static constexpr std::string_view kName = "heading";
  static constexpr int kRows = 1;
  static constexpr GateClass kGate = GateClass::scalar;
  static constexpr ResidualAxes kAxes = ResidualAxes::own;  // rad
  static constexpr unsigned kBlocks = kSeesPhi;
  static constexpr std::string_view kUnit = "deg";
  static constexpr double kInUnit = kRadToDeg;
  static constexpr bool kHasJitter = false;

  static void see(const StateView<double>& view, const Observation& o, Sighting<double>& out) {
    const double late = view.has_tail ? view.tail[kTailPositionLatency] : 0.0;
    const Matrix3d back = gamma<0>(Vector3d(-late * view.omega_ib_b));
    const Matrix3d C_b_n = C_n_e(view.X.p).transpose() * view.X.C * back;
    const Vector3d d = C_b_n * o.lever_b;
    const double level2 = d.x() * d.x() + d.y() * d.y();
    out.z[0] = std::remainder(o.y[0] - std::atan2(d.y(), d.x()), 2.0 * kPi);
    const Eigen::RowVector3d by_turn =
        -Eigen::RowVector3d(-d.y() / level2, d.x() / level2, 0.0) * C_b_n * hat(o.lever_b);
    out.H.block<1, 3>(0, kPhi) = by_turn * back.transpose();
    out.R(0, 0) = o.R(0, 0);
    if (!view.has_tail) return;
    out.H.block<1, 3>(0, kBg) = late * by_turn * SO3<double>::right_jacobian(Vector3d(-late * view.omega_ib_b));
    out.H_tail(0, kTailPositionLatency) = -by_turn * view.omega_ib_b;
  }
};

}  // namespace liealign
