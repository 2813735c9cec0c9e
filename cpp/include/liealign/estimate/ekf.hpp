// D-LIE-EKF: the discrete extended Kalman filter on a Lie group, over any Model.
//
//   X_{k+1|k} = f(X_{k|k}, u)                                   P_{k+1|k} = F P F^T + B Sigma B^T + Q_b        (Eq. 27)
//   K = P H^T S^-1, S = H P H^T + R                             X+ = X exp(gamma K z)                          (Eq. 28)
//   P+ = J [P - gamma (2 - gamma) K S K^T] J^T,  J = J_r(gamma K z)                                            (Eq. 29)
//
// Source: TAES (14), (23)-(25), DRONES (6). Beyond them: P+ is that of the gain that was applied, gamma K, which is
// (I - gamma K H) P (I - gamma K H)^T + gamma^2 K R K^T written out; and the covariance is carried to the tangent of the updated
// state by J_r (reset of the left error; `covariance_reset`).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <cmath>

#include "liealign/core/error.hpp"
#include "liealign/estimate/belief.hpp"
#include "liealign/estimate/dynamics.hpp"
#include "liealign/ins/interval_error.hpp"
#include "liealign/observe/observation.hpp"

namespace liealign {

template <typename Model>
struct Ekf {
  using Scalar = typename Model::Scalar;
  using Covariance = typename Model::Covariance;
  using Tall = Eigen::Matrix<Scalar, Model::Dim, 3>;
  static constexpr int kNav = 9, kBias = 6, kCore = kNav + kBias;
  static_assert(Model::Dim == kCore + Model::kTailDim);

  Dynamics dynamics;
  bool covariance_reset = true;
  TailModel tail = {};

  // (Eq. 27) over dt seconds of one IMU sample. Returns the transition, for the smoother. Models without a tail.
  NavTransition<Scalar> predict(Belief<Model>& belief, const ImuSample& sample, double dt) const;

  // The same over a preintegrated interval whose samples were corrected by the biases b_0 (exact mechanization). Returns
  // what gravitation did. The tail moves along, (Eq. 79).
  IntervalPull<Scalar> predict(Belief<Model>& belief, const Preintegrated<Scalar>& pre,
                               const Vector<Scalar, kBias>& b_0) const;

  static void predict_tail(Belief<Model>& belief, const TailStep& step) {
    auto& x = belief.X.second.x;
    Covariance& P = belief.P;
    for (int i = 0; i < Model::kTailDim; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const int row = kTail + i;
      x[kBias + i] *= step.keep[at];
      P.row(row) *= step.keep[at];
      P.col(row) *= step.keep[at];
      if (!TailStep::is_driven(i, Model::kTailDim)) continue;
      // The drivers come later in the tail, so that they are still as they were.
      const int driver = TailStep::driver(i);
      const double by = step.from_driver[at];
      x[kBias + i] += by * x[kBias + driver];
      P.row(row) += by * P.row(kTail + driver);
      P.col(row) += by * P.col(kTail + driver);
    }
    for (int i = 0; i < Model::kTailDim; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const int row = kTail + i;
      P(row, row) += step.noise[at];
      if (!TailStep::is_driven(i, Model::kTailDim)) continue;
      const int j = kTail + TailStep::driver(i);
      P(row, j) += step.with_driver[at];
      P(j, row) = P(row, j);
    }
  }

  // Components [first, first + count) of the tail forget what they were: zero, certain, and nothing to do with the rest.
  static void forget_tail(Belief<Model>& belief, int first, int count) {
    for (int i = first; i < first + count; ++i) {
      belief.X.second.x[kBias + i] = Scalar(0);
      belief.P.row(kTail + i).setZero();
      belief.P.col(kTail + i).setZero();
    }
  }

  // What each bias gains in one half of an interval of T seconds.
  Vector<Scalar, kBias> half_walk(const Scalar& T) const {
    return Scalar(0.5) * T * bias_variance(dynamics.noise, 1.0).template cast<Scalar>();
  }

  // z, S, zeta of an observation at the belief as it is. PHt becomes P H^T.
  // Throws NumericalError when S is not positive definite.
  Innovation<Scalar> innovate(const Belief<Model>& belief, const Sighting<Scalar>& seen, const Tall& Ht,
                              unsigned blocks, Tall& PHt) const {
    using std::isfinite;
    Innovation<Scalar> innovation;
    innovation.z = seen.z;
    PHt = times_columns(belief.P, Ht, blocks);
    innovation.S = Ht.transpose().lazyProduct(PHt) + seen.R;
    const Eigen::LLT<Matrix3<Scalar>> llt(innovation.S);
    const Vector3<Scalar> whitened = llt.matrixL().solve(innovation.z);
    innovation.nis = whitened.squaredNorm();
    if (llt.info() != Eigen::Success || !isfinite(innovation.nis)) {
      throw NumericalError("filter: the innovation covariance is not positive definite or the state is not finite");
    }
    innovation.half_log_det_S = half_log_det(llt);
    return innovation;
  }

  // (Eq. 28)-(Eq. 29) with gain weight * K. A weight of 0 leaves the belief as it is. `note` becomes what the smoother needs.
  void correct(Belief<Model>& belief, Innovation<Scalar>& innovation, const Tall& Ht, const Tall& PHt,
               const Scalar& weight, Correction<Model>* note = nullptr) const {
    innovation.weight = weight;
    innovation.verdict = weight == Scalar(0)  ? Verdict::rejected
                         : weight < Scalar(1) ? Verdict::weighted
                                              : Verdict::used;
    if (innovation.verdict == Verdict::rejected) return;
    const Eigen::LLT<Matrix3<Scalar>> llt(innovation.S);
    const Tall K_full = solve_from_right(PHt, llt), K = weight * K_full;
    const typename Model::Tangent eps = K * innovation.z;
    belief.X = Model::retract(belief.X, eps);
    // P - K U^T - U K^T, U = P H^T - K S / 2, on and below the diagonal.
    const Tall U = PHt - Scalar(0.5) * K.lazyProduct(innovation.S);
    subtract_products(belief.P, K, U);
    if (covariance_reset) Model::reset(belief.P, eps);
    mirror(belief.P);
    if (note == nullptr) return;
    *note = {Ht, K_full, llt.solve(Matrix3<Scalar>::Identity()), llt.solve(innovation.z), weight, eps};
  }

  // P <- [F B; 0 I] P [F B; 0 I]^T + [B Sigma B^T, 0; 0, Q_b], with the zeros and identities used.
  void propagate_covariance(Covariance& P, const NavTransition<Scalar>& t, double dt, const WhiteDensity& white) const {
    const Vector<Scalar, kBias> Sigma = input_variance(white, dt).template cast<Scalar>();
    const SquareMatrix<Scalar, kNav> P_nn = P.template topLeftCorner<kNav, kNav>();
    const Eigen::Matrix<Scalar, kNav, kBias> P_nb = P.template topRightCorner<kNav, kBias>();
    SquareMatrix<Scalar, kBias> P_bb = P.template bottomRightCorner<kBias, kBias>();
    const Eigen::Matrix<Scalar, kNav, kBias> P_nb_next = t.F * P_nb + t.B * P_bb;
    const Eigen::Matrix<Scalar, kNav, kBias> M = P_nb_next + t.B * Sigma.asDiagonal();
    const SquareMatrix<Scalar, kNav> half = P_nn * t.F.transpose() + P_nb * t.B.transpose();
    // F P_nb B^T stands twice here; symmetrising makes the second one its transpose.
    P.template topLeftCorner<kNav, kNav>() = t.F * half + M * t.B.transpose();
    P.template topRightCorner<kNav, kBias>() = P_nb_next;
    P.template bottomLeftCorner<kBias, kNav>() = P_nb_next.transpose();
    P_bb.diagonal() += bias_variance(dynamics.noise, dt).template cast<Scalar>();
    P.template bottomRightCorner<kBias, kBias>() = P_bb;
    symmetrise(P);
  }

  // P <- (P + P^T) / 2, against rounding.
  static void symmetrise(Covariance& P) { P = (Scalar(0.5) * (P + P.transpose())).eval(); }

 private:
  // P H^T. Without a tail a kind sees two or three of the five blocks of the error; the others are left out.
  static Tall times_columns(const Covariance& P, const Tall& Ht, unsigned blocks) {
    if constexpr (Model::kTailDim > 0 || !Model::kKeepsBlocks) {
      return P.lazyProduct(Ht);
    } else {
      Tall out = Tall::Zero();
      for (int block = 0; block < kCore / 3; ++block) {
        if ((blocks >> static_cast<unsigned>(block) & 1U) == 0) continue;
        out += P.template middleCols<3>(3 * block).lazyProduct(Ht.template middleRows<3>(3 * block));
      }
      return out;
    }
  }

  // P -= K U^T + U K^T on and below the diagonal: the core by blocks of three, then the rows of the tail.
  static void subtract_products(Covariance& P, const Tall& K, const Tall& U) {
    for (int j = 0; j < kCore; j += 3)
      for (int i = j; i < kCore; i += 3)
        P.template block<3, 3>(i, j) -=
            K.template middleRows<3>(i).lazyProduct(U.template middleRows<3>(j).transpose()) +
            U.template middleRows<3>(i).lazyProduct(K.template middleRows<3>(j).transpose());
    if constexpr (Model::kTailDim > 0) {
      constexpr int n = Model::kTailDim;
      P.template bottomRows<n>() -=
          K.template bottomRows<n>().lazyProduct(U.transpose()) + U.template bottomRows<n>().lazyProduct(K.transpose());
    }
  }

  // M S^-1 with S = L L^T: by columns, where a solve would divide row by row.
  static Tall solve_from_right(const Tall& M, const Eigen::LLT<Matrix3<Scalar>>& llt) {
    const Matrix3<Scalar>& L = llt.matrixLLT();
    const Vector3<Scalar> inverse = L.diagonal().cwiseInverse();
    Tall K;
    K.col(0) = inverse[0] * M.col(0);
    K.col(1) = inverse[1] * (M.col(1) - L(1, 0) * K.col(0));
    K.col(2) = inverse[2] * (M.col(2) - L(2, 0) * K.col(0) - L(2, 1) * K.col(1));
    K.col(2) *= inverse[2];
    K.col(1) = inverse[1] * (K.col(1) - L(2, 1) * K.col(2));
    K.col(0) = inverse[0] * (K.col(0) - L(1, 0) * K.col(1) - L(2, 0) * K.col(2));
    return K;
  }

  static Scalar half_log_det(const Eigen::LLT<Matrix3<Scalar>>& llt) {
    using std::log;
    return log(llt.matrixLLT().diagonal().prod());
  }
};

// Outside of the class, so that they are compiled where that is asked for (filter_steps.cpp) and nowhere else.
template <typename Model>
NavTransition<typename Model::Scalar> Ekf<Model>::predict(Belief<Model>& belief, const ImuSample& sample,
                                                          double dt) const {
  static_assert(Model::kTailDim == 0);
  const NavTransition<Scalar> t =
      Model::step(belief.X, sample.omega_ib_b, sample.f_ib_b, dt, dynamics.mechanization, dynamics.gravity);
  propagate_covariance(belief.P, t, dt, white_density(dynamics.noise, sample));
  return t;
}

template <typename Model>
IntervalPull<typename Model::Scalar> Ekf<Model>::predict(Belief<Model>& belief, const Preintegrated<Scalar>& pre,
                                                         const Vector<Scalar, kBias>& b_0) const {
  const SE23<Scalar> d = increments<Scalar>(pre, biases(belief.X) - b_0);
  const StartAxes<Scalar> axes(belief.X.first, pre.T);
  if constexpr (Model::kTailDim > 0) predict_tail(belief, tail_step(tail, pre.T));
  propagate_interval<Scalar, Model::Dim>(belief.P, axes, d, pre, half_walk(pre.T));
  const IntervalPull<Scalar> pull(belief.X.first, d, pre.T, dynamics.gravity);
  belief.X.first = advance_interval(belief.X.first, d, pre.T, pull);
  return pull;
}

}  // namespace liealign
