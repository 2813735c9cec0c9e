// Test instruments: an observation of any kind, and what it says at a state.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/observe/antenna_motion.hpp"
#include "liealign/observe/kinds.hpp"
#include "numeric.hpp"

namespace liealign::testing {

// What an observation says at a state; with a tail where one is given. omega and f as the IMU reads them.
inline Sighting<double> seen_of(const Observation& o, const NavState<double>& X, const Vector3d& omega,
                                const Vector3d& f, const TailVector<double>* tail = nullptr) {
  StateView<double> view{X.first, omega - b_g(X), f - b_a(X), b_g(X), TailVector<double>::Zero()};
  view.gyro_arw = 1e-5;
  if (tail != nullptr) {
    view.tail = *tail;
    view.has_tail = true;
  }
  Sighting<double> seen;
  see(view, o, seen);
  return seen;
}

// An observation of the kind near what is to be seen at X: small residuals, a direction that is not upright.
inline Observation some_observation(const ObservationKind& kind, const NavState<double>& X, std::mt19937& rng) {
  const Matrix3d C_ne = C_n_e(X.first.p), A = Matrix3d::NullaryExpr([&] { return normal3(rng).x(); });
  Observation o;
  o.kind = &kind;
  o.R = 1e-4 * (A * A.transpose() + Matrix3d::Identity());
  o.root = C_ne * Vector3d(0.01, 0.02, 0.03).asDiagonal();
  const Vector3d along = normal3(rng);
  o.lever_b =
      X.first.C.transpose() * C_ne * Vector3d(std::cos(along.x()), std::sin(along.x()), 0.4 * std::sin(along.y()));
  o.place_e = X.first.p + normal3(rng, 1e4);  // so far that a distance from there is straight
  o.span_s = 1.0;
  o.y = -seen_of(o, X, Vector3d::Zero(), Vector3d::Zero()).z + normal3(rng, 0.01);
  return o;
}

// A tail of the sizes it has: c, s, latencies of some milliseconds, a barometer.
inline TailVector<double> some_tail(std::mt19937& rng) {
  TailVector<double> tail;
  tail << normal3(rng), 4e-3, -3e-3, 2e-3, 1.5, normal3(rng, 0.01), normal3(rng, 0.1);
  return tail;
}

}  // namespace liealign::testing
