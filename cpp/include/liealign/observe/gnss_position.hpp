// The position of a GNSS antenna, with what its receiver does to it.
//
//   y = p_a + K c - v_a (dl_p + j) + n,   K = C_n_e chol(Sigma_file),   n ~ N(0, R)                     (Eq. 19)
//
// c: the correlated error in units of the stated std; dl_p: what is left of the latency of positions; j: the jitter of this
// stamp, in R where it is no state. Source: TAES (22), with the terms of docs/gnss-errors.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/observe/antenna_motion.hpp"

namespace liealign {

struct GnssPosition {
  static constexpr std::string_view kName = "position";
  static constexpr int kRows = 3;
  static constexpr GateClass kGate = GateClass::position;
  static constexpr ResidualAxes kAxes = ResidualAxes::ecef;
  static constexpr unsigned kBlocks = kSeesPhi | kSeesRho;
  static constexpr bool kHasJitter = true;

  template <typename Scalar>
  static void see(const StateView<Scalar>& view, const Observation& o, Sighting<Scalar>& out) {
    const Vector3<Scalar> l = o.lever_b.cast<Scalar>();
    const Seen<Scalar> p = position_of(view.X, l);
    out.z = o.y.cast<Scalar>() - p.h;
    out.H = p.H;
    out.R = o.R.cast<Scalar>();
    if (!view.has_tail) return;
    const Seen<Scalar> moved = velocity_of(view.X, l, view.omega_ib_b);
    const Vector3<Scalar>& v = moved.h;
    const Matrix3<Scalar> root = o.root.cast<Scalar>();
    const Scalar late = view.tail[kTailPositionLatency] + view.tail[kTailJitter];
    out.z -= root * view.tail.template segment<3>(kTailC) - late * v;
    out.H -= late * moved.H;
    out.H_tail.template middleCols<3>(kTailC) = root;
    out.H_tail.col(kTailPositionLatency) = -v;
    out.H_tail.col(kTailJitter) = -v;
    out.R += Scalar(view.jitter_variance) * v * v.transpose();
  }
};

}  // namespace liealign
