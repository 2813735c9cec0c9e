// The Lie model: state X in SE_2(3) x T(6), left error X = X_hat exp(eps). What Ekf and Smoother ask of a model.
//
// A model gives: State, Dim, and the static functions below. Its error has nine navigation components, then
// (b_a, b_g), so that a transition is always [F B; 0 I] with F 9x9 and B 9x6. Source: TAES (19)-(22).
// SPDX-License-Identifier: Apache-2.0
#pragma once

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
  // M <- M J_r(eps)^T, M of any number of rows: the reset of the left error.
  struct Reset {
    typename SE23<Scalar>::JacobianBlocks blocks;

    explicit Reset(const Tangent& eps)
        : blocks(SE23<Scalar>::left_jacobian_blocks(-eps.template head<SE23<Scalar>::Dim>())) {}

    template <typename Columns>
    void columns(Columns& M) const {
      using Block = Eigen::Matrix<Scalar, Columns::RowsAtCompileTime, 3>;
      const Block phi = M.template middleCols<3>(kPhi), nu = M.template middleCols<3>(kNu),
                  rho = M.template middleCols<3>(kRho);
      const Matrix3<Scalar> Jt = blocks.J.transpose();
      M.template middleCols<3>(kPhi) = phi.lazyProduct(Jt);
      M.template middleCols<3>(kNu) = nu.lazyProduct(Jt) + phi.lazyProduct(blocks.Q_nu.transpose());
      M.template middleCols<3>(kRho) = rho.lazyProduct(Jt) + phi.lazyProduct(blocks.Q_rho.transpose());
    }
  };
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

}  // namespace liealign
