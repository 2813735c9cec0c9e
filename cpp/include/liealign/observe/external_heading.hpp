// The direction of a baseline of the body against north: two antennas, or whatever else gives a heading.
//
//   y = atan2(d_E, d_N) + n,   d = C_b_n u,   u: the baseline in the body
//   H_phi = -(d_N e_E - d_E e_N)^T C_b_n hat(u) / (d_N^2 + d_E^2)                                      (Eq. 81)
//
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
  static constexpr bool kHasJitter = false;

  static void see(const StateView<double>& view, const Observation& o, Sighting<double>& out) {
    const Matrix3d C_b_n = C_n_e(view.X.p).transpose() * view.X.C;
    const Vector3d d = C_b_n * o.lever_b;
    const double level2 = d.x() * d.x() + d.y() * d.y();
    out.z[0] = std::remainder(o.y[0] - std::atan2(d.y(), d.x()), 2.0 * kPi);
    const Eigen::RowVector3d across(-d.y() / level2, d.x() / level2, 0.0);
    out.H.block<1, 3>(0, kPhi) = -across * C_b_n * hat(o.lever_b);
    out.R(0, 0) = o.R(0, 0);
  }
};

}  // namespace liealign
