// The Lie model: state X in SE_2(3) x T(6), left error X = X_hat exp(eps). What Ekf and Smoother ask of a model.
//
// A model gives: State, Dim, and the static functions below. Its error has nine navigation components, then
// (b_a, b_g), so that a transition is always [F B; 0 I] with F 9x9 and B 9x6. Source: TAES (19)-(22).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/ins/interval_error.hpp"
#include "liealign/ins/measurements.hpp"
#include "liealign/ins/mechanization.hpp"

namespace liealign {

template <typename Scalar_ = double>
struct LieModel {
  using Scalar = Scalar_;
  using State = NavState<Scalar>;
  static constexpr int Dim = State::Dim;
  using Tangent = Vector<Scalar, Dim>;
  using Covariance = SquareMatrix<Scalar, Dim>;

  static State retract(const State& X, const Tangent& eps) { return X * State::exp(eps); }
  static Tangent local(const State& X_hat, const State& X) { return (X_hat.inverse() * X).log(); }
  // P <- J_r(eps) P J_r(eps)^T, the reset of the left error, on the half of P below its diagonal.
  static void reset(Covariance& P, const Tangent& eps) {
    const typename SE23<Scalar>::JacobianBlocks J =
        SE23<Scalar>::left_jacobian_blocks(-eps.template head<SE23<Scalar>::Dim>());
    NavCovariance<Scalar, 6> nav = nav_covariance(P);
    apply_jacobian(nav, J);
    set_nav_covariance(P, nav);
  }
  static Covariance right_jacobian(const Tangent& eps) { return State::right_jacobian(eps); }
  static Covariance right_jacobian_inverse(const Tangent& eps) { return State::right_jacobian_inverse(eps); }

  // One IMU step of dt seconds with the measured rate and force; X becomes the next state.
  static NavTransition<Scalar> step(State& X, const Vector3d& omega_measured, const Vector3d& f_measured, double dt,
                                    Mechanization mechanization, GravityModel gravity) {
    const ImuInput<Scalar> u{omega_measured.cast<Scalar>() - b_g(X), f_measured.cast<Scalar>() - b_a(X), dt};
    return advance(X.first, u, mechanization, gravity);
  }

  static Prediction<Scalar> gnss_position(const State& X, const Vector3d& l_ba_b) {
    return predict_gnss_position(X, l_ba_b);
  }
  static Prediction<Scalar> gnss_velocity(const State& X, const Vector3d& l_ba_b, const Vector3d& omega_measured) {
    return predict_gnss_velocity(X, l_ba_b, Vector3<Scalar>(omega_measured.cast<Scalar>() - b_g(X)));
  }
  static Prediction<Scalar> zero_velocity(const State& X) { return predict_zero_velocity(X); }
  static Prediction<Scalar> zero_rate(const State& X) { return predict_zero_rate(X); }
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
