// The classical models beside the Lie model: the same state, motion and measurements, the error in other coordinates.
//
//   MEKF    SO(3) x T(12): C = C_hat exp(phi), v = v_hat + dv, p = p_hat + dp, in ECEF axes
//   Euler   T(15): (roll, pitch, heading) of C_b^n at p, v and p as above; at +-90 deg of pitch they are not defined
//
// To first order the Lie error is eps = T(X) eps', T = diag(A, C^T, C^T, I), A = I or the body rates by Euler rates, so that
//   F' = T(X+)^-1 F T(X),   B' = T(X+)^-1 B,   H' = H T(X)                                         (Eq. 66)
// That the local axes turn with dp, by 1.6e-7 rad/m, is left out.
// Source: Markley (2003) for the multiplicative error; Groves (2013) 2.3 for the rates. For comparison: the alignment and the
// intervals are of the Lie model.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <type_traits>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/ekf.hpp"
#include "liealign/estimate/lie_model.hpp"

namespace liealign {

// Multiplicative: the attitude error is that of SO(3).
struct MultiplicativeAttitude {
  static Matrix3d body_from_error(const SE23<double>&) { return Matrix3d::Identity(); }
  static Matrix3d error_from_body(const SE23<double>&) { return Matrix3d::Identity(); }
  // `to` has the position of the updated state already.
  static void turn(const SE23<double>& from, const Vector3d& phi, SE23<double>& to) {
    to.C = from.C * SO3<double>::exp(phi).C;
  }
  static Vector3d between(const SE23<double>& from, const SE23<double>& to) {
    return SO3<double>{from.C.transpose() * to.C}.log();
  }
  static Matrix3d right_jacobian(const Vector3d& phi) { return SO3<double>::right_jacobian(phi); }
  static Matrix3d right_jacobian_inverse(const Vector3d& phi) { return SO3<double>::right_jacobian_inverse(phi); }
};

// Additive in roll, pitch and heading. Throws NumericalError within half a degree of +-90 deg of pitch.
struct EulerAttitude {
  static Vector3d rpy(const SE23<double>& X) { return rpy_from_C_b_n(C_n_e(X.p).transpose() * X.C); }
  static Matrix3d body_from_error(const SE23<double>& X);
  static Matrix3d error_from_body(const SE23<double>& X) { return body_from_error(X).inverse(); }
  static void turn(const SE23<double>& from, const Vector3d& by, SE23<double>& to) {
    to.C = C_n_e(to.p) * C_b_n_from_rpy(rpy(from) + by);
  }
  static Vector3d between(const SE23<double>& from, const SE23<double>& to);
  static Matrix3d right_jacobian(const Vector3d&) { return Matrix3d::Identity(); }
  static Matrix3d right_jacobian_inverse(const Vector3d&) { return Matrix3d::Identity(); }
};

template <typename Attitude>
struct ChartModel {
  using Scalar = double;
  using State = NavState<double>;
  static constexpr int Dim = State::Dim, kTailDim = 0;
  static constexpr bool kKeepsBlocks = false;
  using Tangent = Vector<double, Dim>;
  using Covariance = SquareMatrix<double, Dim>;

  static State retract(const State& X, const Tangent& eps) {
    State to = X;
    to.first.v += eps.template segment<3>(kNu);
    to.first.p += eps.template segment<3>(kRho);
    to.second.x += eps.template tail<6>();
    Attitude::turn(X.first, eps.template head<3>(), to.first);
    return to;
  }
  static Tangent local(const State& X_hat, const State& X) {
    Tangent eps;
    eps << Attitude::between(X_hat.first, X.first), X.first.v - X_hat.first.v, X.first.p - X_hat.first.p,
        X.second.x - X_hat.second.x;
    return eps;
  }
  static Covariance right_jacobian(const Tangent& eps) {
    Covariance J = Covariance::Identity();
    J.template topLeftCorner<3, 3>() = Attitude::right_jacobian(eps.template head<3>());
    return J;
  }
  static Covariance right_jacobian_inverse(const Tangent& eps) {
    Covariance J = Covariance::Identity();
    J.template topLeftCorner<3, 3>() = Attitude::right_jacobian_inverse(eps.template head<3>());
    return J;
  }
  static void reset(Covariance& P, const Tangent& eps) {
    const Covariance J = right_jacobian(eps);
    const Covariance whole = P.template selfadjointView<Eigen::Lower>();
    P = J * whole * J.transpose();
  }

  template <int cols>
  static void reset_back(Eigen::Matrix<double, Dim, cols>& M, const Tangent& eps) {
    M.template topRows<3>() =
        (Attitude::right_jacobian(eps.template head<3>()).transpose() * M.template topRows<3>()).eval();
  }

  // T and its inverse of (Eq. 66).
  static Covariance lie_from_error(const State& X) {
    return blocks(Attitude::body_from_error(X.first), X.first.C.transpose());
  }
  static Covariance error_from_lie(const State& X) { return blocks(Attitude::error_from_body(X.first), X.first.C); }

  static NavTransition<double> step(State& X, const Vector3d& omega_measured, const Vector3d& f_measured, double dt,
                                    Mechanization mechanization, GravityModel gravity) {
    const Covariance before = lie_from_error(X);
    NavTransition<double> t = LieModel<double>::step(X, omega_measured, f_measured, dt, mechanization, gravity);
    const SquareMatrix<double, 9> after = error_from_lie(X).template topLeftCorner<9, 9>();
    t.F = (after * t.F * before.template topLeftCorner<9, 9>()).eval();
    t.B = (after * t.B).eval();
    return t;
  }

  // H' of (Eq. 66).
  static void error_columns(const State& X, Eigen::Matrix<double, 3, kTail>& H) { H = (H * lie_from_error(X)).eval(); }

 private:
  static Covariance blocks(const Matrix3d& A, const Matrix3d& C) {
    Covariance T = Covariance::Identity();
    T.template block<3, 3>(kPhi, kPhi) = A;
    T.template block<3, 3>(kNu, kNu) = C;
    T.template block<3, 3>(kRho, kRho) = C;
    return T;
  }
};

using MekfModel = ChartModel<MultiplicativeAttitude>;
using EulerModel = ChartModel<EulerAttitude>;

// A belief of the Lie model in another one, and back, to first order.
template <typename Model>
Belief<Model> belief_in(const Belief<LieModel<double>>& lie) {
  if constexpr (std::is_same_v<Model, LieModel<double>>) {
    return lie;
  } else {
    const typename Model::Covariance T = Model::error_from_lie(lie.X);
    return {lie.X, T * lie.P * T.transpose()};
  }
}
template <typename Attitude>
Belief<LieModel<double>> lie_belief(const Belief<ChartModel<Attitude>>& belief) {
  const typename ChartModel<Attitude>::Covariance T = ChartModel<Attitude>::lie_from_error(belief.X);
  return {belief.X, T * belief.P * T.transpose()};
}
inline const Belief<LieModel<double>>& lie_belief(const Belief<LieModel<double>>& belief) { return belief; }

}  // namespace liealign
