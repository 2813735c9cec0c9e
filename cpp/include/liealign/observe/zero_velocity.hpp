// The vehicle rests on the Earth.
//
//   0 = v + n                              H = [0, C, 0, 0, 0]                                        (Eq. 21)
//
// Source: TAES (14h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/observe/observation.hpp"

namespace liealign {

struct ZeroVelocity {
  static constexpr std::string_view kName = "zero_velocity";
  static constexpr int kRows = 3;
  static constexpr GateClass kGate = GateClass::none;  // the rest detector has already decided
  static constexpr ResidualAxes kAxes = ResidualAxes::ecef;
  static constexpr unsigned kBlocks = kSeesNu;
  static constexpr bool kHasJitter = false;

  template <typename Scalar>
  static void see(const StateView<Scalar>& view, const Observation& o, Sighting<Scalar>& out) {
    out.z = -view.X.v;
    out.H.template middleCols<3>(kNu) = view.X.C;
    out.R = o.R.cast<Scalar>();
  }
};

}  // namespace liealign
