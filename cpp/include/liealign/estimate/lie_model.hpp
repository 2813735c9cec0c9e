// The Lie model: state X in SE_2(3) x T(6 + tail), left error X = X_hat exp(eps). What Ekf and the smoothers ask of a model.
//
// With a tail, position and velocity retract straight, p + C rho in place of the group's p + C J_l(phi) rho: to the
// first order the same. A receiver's error c ties p to what it states, p + K c, by centimetres where either is known to
// metres; a correction that bends with the attitude would tear the two apart, in the mean and in the covariance.
//
// A model gives: State, Dim, kTailDim, and the static functions below. Its error has nine navigation components, then
// (b_a, b_g), so that a transition is always [F B; 0 I] with F 9x9 and B 9x6; the tail moves by itself. Observations are
// predicted with the Lie error; error_columns() turns their derivatives to that of the model.
// Source: TAES (19)-(22).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/ins/interval_error.hpp"
#include "liealign/ins/mechanization.hpp"
#include "liealign/ins/nav_state.hpp"

namespace liealign {

// J_r(eps) of SE_2(3) by its blocks, and of the straight retraction.
template <typename Scalar>
ResetBlocks<Scalar> group_reset(const Vector<Scalar, 9>& eps) {
  const typename SE23<Scalar>::JacobianBlocks j = SE23<Scalar>::left_jacobian_blocks(-eps);
  return {j.J, j.J, j.Q_nu, j.Q_rho};
}
template <typename Scalar>
ResetBlocks<Scalar> straight_reset(const Vector<Scalar, 9>& eps) {
  const Vector3<Scalar> phi = eps.template head<3>();
  return {SO3<Scalar>::right_jacobian(phi), gamma<0>(Vector3<Scalar>(-phi)), Matrix3<Scalar>::Zero(),
          Matrix3<Scalar>::Zero()};
}
template <typename Scalar>
SE23<Scalar> retract_straight(const SE23<Scalar>& X, const Vector<Scalar, 9>& eps) {
  return {X.C * gamma<0>(Vector3<Scalar>(eps.template head<3>())), X.v + X.C * eps.template segment<3>(kNu),
          X.p + X.C * eps.template segment<3>(kRho)};
}

template <typename Scalar_ = double, int tail = 0>
struct LieModel {
  using Scalar = Scalar_;
  using State = NavState<Scalar, tail>;
  static constexpr int Dim = State::Dim, kTailDim = tail;
  static constexpr bool kKeepsBlocks = true;  // a kind's zero blocks are zero in this error as well
  using Tangent = Vector<Scalar, Dim>;
  using Covariance = SquareMatrix<Scalar, Dim>;

  static State retract(const State& X, const Tangent& eps) {
    if constexpr (tail == 0) {
      return X * State::exp(eps);
    } else {
      State to;
      to.first = retract_straight(X.first, Vector<Scalar, 9>(eps.template head<9>()));
      to.second.x = X.second.x + eps.template tail<6 + tail>();
      return to;
    }
  }
  static Tangent local(const State& X_hat, const State& X) {
    if constexpr (tail == 0) {
      return (X_hat.inverse() * X).log();
    } else {
      const Matrix3<Scalar> Ct = X_hat.first.C.transpose();
      Tangent eps;
      eps << SO3<Scalar>{Ct * X.first.C}.log(), Ct * (X.first.v - X_hat.first.v), Ct * (X.first.p - X_hat.first.p),
          X.second.x - X_hat.second.x;
      return eps;
    }
  }
  // P <- J_r(eps) P J_r(eps)^T, the reset of the left error, on the half of P below its diagonal.
  static void reset(Covariance& P, const Tangent& eps) {
    NavCovariance<Scalar, Dim - 9> nav = nav_covariance<Scalar, Dim>(P);
    apply_reset(nav, reset_blocks(eps));
    set_nav_covariance<Scalar, Dim>(P, nav);
  }
  static Covariance right_jacobian(const Tangent& eps) {
    const ResetBlocks<Scalar> j = reset_blocks(eps);
    Covariance out = Covariance::Identity();
    out.template block<3, 3>(kPhi, kPhi) = j.J;
    out.template block<3, 3>(kNu, kNu) = out.template block<3, 3>(kRho, kRho) = j.R;
    out.template block<3, 3>(kNu, kPhi) = j.Q_nu;
    out.template block<3, 3>(kRho, kPhi) = j.Q_rho;
    return out;
  }

  // lambda <- J_r(eps)^T lambda for each column of M: back through the reset.
  template <int cols>
  static void reset_back(Eigen::Matrix<Scalar, Dim, cols>& M, const Tangent& eps) {
    using Rows = Eigen::Matrix<Scalar, 3, cols>;
    const ResetBlocks<Scalar> j = reset_blocks(eps);
    const Rows phi = M.template middleRows<3>(kPhi), nu = M.template middleRows<3>(kNu),
               rho = M.template middleRows<3>(kRho);
    M.template middleRows<3>(kPhi) =
        j.J.transpose().lazyProduct(phi) + j.Q_nu.transpose().lazyProduct(nu) + j.Q_rho.transpose().lazyProduct(rho);
    M.template middleRows<3>(kNu) = j.R.transpose().lazyProduct(nu);
    M.template middleRows<3>(kRho) = j.R.transpose().lazyProduct(rho);
  }

  // One IMU step of dt seconds with the measured rate and force; X becomes the next state.
  static NavTransition<Scalar> step(State& X, const Vector3d& omega_measured, const Vector3d& f_measured, double dt,
                                    Mechanization mechanization, GravityModel gravity) {
    const ImuInput<Scalar> u{omega_measured.cast<Scalar>() - b_g(X), f_measured.cast<Scalar>() - b_a(X), dt};
    return advance(X.first, u, mechanization, gravity);
  }

  // The columns that an observation's derivative by the Lie error has in the error of this model: the same.
  static void error_columns(const State&, Eigen::Matrix<Scalar, 3, kTail>&) {}

 private:
  static ResetBlocks<Scalar> reset_blocks(const Tangent& eps) {
    const Vector<Scalar, 9> nav = eps.template head<9>();
    if constexpr (tail == 0) {
      return group_reset(nav);
    } else {
      return straight_reset(nav);
    }
  }
};

// One lane of a state, and a state into one.
inline NavState<double> lane(const NavState<Lanes>& X, int i) {
  return {{lane(X.first.C, i), lane(X.first.v, i), lane(X.first.p, i)}, {lane(X.second.x, i)}};
}
inline void set_lane(NavState<Lanes>& X, int i, const NavState<double>& one) {
  set_lane(X.first.C, i, one.first.C);
  set_lane(X.first.v, i, one.first.v);
  set_lane(X.first.p, i, one.first.p);
  set_lane(X.second.x, i, one.second.x);
}

}  // namespace liealign
