// Test instruments: numeric derivatives on a group, random states near the ground.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>

#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/ins/nav_state.hpp"

namespace liealign::testing {

inline Vector3d normal3(std::mt19937& rng, double sigma = 1.0) {
  std::normal_distribution<double> normal(0.0, sigma);
  const double x = normal(rng), y = normal(rng), z = normal(rng);
  return {x, y, z};
}

// A state a few hundred metres above the ellipsoid, moving at some 10 m/s, any attitude.
inline NavState<double> random_state(std::mt19937& rng) {
  std::uniform_real_distribution<double> lat(-80, 80), lon(-180, 180), angle(-3, 3);
  const double la = lat(rng) * kDegToRad, lo = lon(rng) * kDegToRad;
  NavState<double> X;
  X.first.p = ecef_from_geodetic({la, lo, 300});
  const double roll = angle(rng), pitch = 0.4 * angle(rng), yaw = angle(rng);
  X.first.C = C_n_e(la, lo) * C_b_n_from_rpy({roll, pitch, yaw});
  X.first.v = C_n_e(la, lo) * normal3(rng, 10.0);
  X.second.x << normal3(rng, 0.01), normal3(rng, 1e-3);
  return X;
}

// Products one at a time, of any size: a chain of them is a template of its own, and long to compile.
inline Eigen::MatrixXd times(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) { return A * B; }
// A P A^T.
inline Eigen::MatrixXd sandwich(const Eigen::MatrixXd& A, const Eigen::MatrixXd& P) {
  return times(times(A, P), A.transpose());
}

// Central difference of a vector function of the state by the left error, through X exp(eps). Position steps are
// larger: ECEF coordinates carry 1e-9 m of rounding.
template <typename Function>
Eigen::MatrixXd derivative_by_left_error(const NavState<double>& X, Function f, const Vector<double, 15>& step) {
  Eigen::MatrixXd J;
  for (int i = 0; i < 15; ++i) {
    const Vector<double, 15> eps = step[i] * Vector<double, 15>::Unit(i);
    const Eigen::VectorXd column =
        (f(X * NavState<double>::exp(eps)) - f(X * NavState<double>::exp(-eps))) / (2 * step[i]);
    if (i == 0) J.resize(column.size(), 15);
    J.col(i) = column;
  }
  return J;
}

inline Vector<double, 15> default_steps() {
  Vector<double, 15> s;
  s << 1e-3, 1e-3, 1e-3, 1e-2, 1e-2, 1e-2, 10, 10, 10, 1e-2, 1e-2, 1e-2, 1e-3, 1e-3, 1e-3;
  return s;
}

}  // namespace liealign::testing
