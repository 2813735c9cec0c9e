// The velocity of a GNSS antenna, with what its receiver does to it.
//
//   y = v_a + C_n_e s - a_a (dl_v + j) + n,   n ~ N(0, R)                                             (Eq. 20)
//
// s: the correlated error; dl_v: what is left of the latency of velocities; j: the jitter of this stamp, the same as that of the
// position of the message. Source: Groves (2013) 14.3.2, with the terms of docs/gnss-errors.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/observe/antenna_motion.hpp"

namespace liealign {

struct GnssVelocity {
  static constexpr std::string_view kName = "velocity";
  static constexpr int kRows = 3;
  static constexpr GateClass kGate = GateClass::velocity;
  static constexpr ResidualAxes kAxes = ResidualAxes::ecef;
  static constexpr unsigned kBlocks = kSeesPhi | kSeesNu | kSeesBg;
  static constexpr bool kHasJitter = true;

  template <typename Scalar>
  static void see(const StateView<Scalar>& view, const Observation& o, Sighting<Scalar>& out) {
    const Vector3<Scalar> l = o.lever_b.cast<Scalar>();
    const Seen<Scalar> v = velocity_of(view.X, l, view.omega_ib_b);
    out.z = o.y.cast<Scalar>() - v.h;
    out.H = v.H;
    out.R = o.R.cast<Scalar>();
    if (!view.has_tail) return;
    const Seen<Scalar> moved = acceleration_of(view.X, l, view.omega_ib_b, view.f_ib_b);
    const Vector3<Scalar>& a = moved.h;
    const Matrix3<Scalar> root = o.root.cast<Scalar>();
    const Scalar late = view.tail[kTailVelocityLatency] + view.tail[kTailJitter];
    out.z -= root * view.tail.template segment<3>(kTailS) - late * a;
    out.H -= late * moved.H;
    out.H_tail.template middleCols<3>(kTailS) = root;
    out.H_tail.col(kTailVelocityLatency) = -a;
    out.H_tail.col(kTailJitter) = -a;
    out.R += Scalar(view.jitter_variance) * a * a.transpose();
  }
};

}  // namespace liealign
