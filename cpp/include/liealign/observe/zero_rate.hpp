// What the gyros read, in the mean, of a vehicle that rests on the Earth.
//
//   y = C^T omega_ie + b_g + n             H = [hat(C^T omega_ie), 0, 0, 0, I]                        (Eq. 22)
//
// The means have the noise of the gyros, or what they scatter by (R) where that is more, and besides what `root` is the root
// of. Body axes.
// Source: TAES (14h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/earth/wgs84.hpp"
#include "liealign/observe/observation.hpp"

namespace liealign {

struct ZeroRate {
  static constexpr std::string_view kName = "zero_rate";
  static constexpr int kRows = 3;
  static constexpr GateClass kGate = GateClass::none;
  static constexpr ResidualAxes kAxes = ResidualAxes::body;
  static constexpr unsigned kBlocks = kSeesPhi | kSeesBg;
  static constexpr bool kHasJitter = false;

  template <typename Scalar>
  static void see(const StateView<Scalar>& view, const Observation& o, Sighting<Scalar>& out) {
    const Vector3<Scalar> omega_ie_b = view.X.C.transpose() * wgs84::omega_ie_e<Scalar>();
    out.z = o.y.cast<Scalar>() - omega_ie_b - view.b_g;
    out.H.template middleCols<3>(kPhi) = hat(omega_ie_b);
    out.H.template middleCols<3>(kBg) = Matrix3<Scalar>::Identity();
    const double least = view.gyro_arw * view.gyro_arw / o.span_s;
    const Vector3d variance = o.R.diagonal().cwiseMax(least);
    out.R = Matrix3d(Matrix3d(variance.asDiagonal()) + o.root * o.root.transpose()).cast<Scalar>();
  }
};

}  // namespace liealign
