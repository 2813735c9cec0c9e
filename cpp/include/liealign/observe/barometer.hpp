// The height by a barometer, which drifts with the weather.
//
//   y = h(p) + b + n,   h above the ellipsoid, b a state of the tail     H_rho = -down^T C, H_b = 1      (Eq. 82)
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/earth/geodesy.hpp"
#include "liealign/observe/observation.hpp"

namespace liealign {

struct Barometer {
  static constexpr std::string_view kName = "barometer";
  static constexpr int kRows = 1;
  static constexpr GateClass kGate = GateClass::scalar;
  static constexpr ResidualAxes kAxes = ResidualAxes::own;  // m
  static constexpr unsigned kBlocks = kSeesRho;
  static constexpr std::string_view kUnit = "m";
  static constexpr double kInUnit = 1.0;
  static constexpr bool kHasJitter = false;

  static void see(const StateView<double>& view, const Observation& o, Sighting<double>& out) {
    const LocalFrame local = local_frame(view.X.p);
    out.z[0] = o.y[0] - local.position.height_m - view.tail[kTailBaro];
    out.H.block<1, 3>(0, kRho) = -local.C_n_e.col(2).transpose() * view.X.C;
    out.H_tail(0, kTailBaro) = 1.0;
    out.R(0, 0) = o.R(0, 0);
  }
};

}  // namespace liealign
