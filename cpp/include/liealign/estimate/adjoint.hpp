// What the future says about the left error at a time, without an inverse of any covariance.
//
//   X^s = X exp(P lambda),   P^s = J_1 (P - P Lambda P) J_1^T,  J_1 = J_r(P lambda)                               (Eq. 30)
// Of an update with gain gamma K, K = P H^T S^-1, and gamma' = gamma (2 - gamma), back to what it started from:
//   lambda <- (I - gamma' K H)^T J^T lambda + gamma H^T S^-1 z
//   Lambda <- (I - gamma' K H)^T J^T Lambda J (I - gamma' K H) + gamma' H^T S^-1 H,   J = J_r(gamma K z)           (Eq. 31)
// Over a transition F:  lambda <- F^T lambda,  Lambda <- F^T Lambda F                                          (Eq. 32)
//
// At the last time both are zero. What is drawn anew has no past: its part of lambda and Lambda is zero before. Equal to Rauch,
// Tung and Striebel's smoother of the same forward pass to the first order of the error; Lambda gathers information, so that
// P - P Lambda P is no difference of two inverses. Source: Bierman (1973), Bryson & Frazier (1963); TAES (15) for the group.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/estimate/ekf.hpp"

namespace liealign {

// One change of the belief at a node, as the smoother goes back through it.
template <typename Model>
struct NodeChange {
  enum class Kind { correction, jitter_redrawn, datum_redrawn };
  Kind kind = Kind::correction;
  Correction<Model> correction;
};
template <typename Model>
using NodeChanges = std::vector<NodeChange<Model>>;

template <typename Model>
struct Adjoint {
  using Scalar = typename Model::Scalar;
  typename Model::Tangent lambda = Model::Tangent::Zero();
  typename Model::Covariance Lambda = Model::Covariance::Zero();

  // (Eq. 31), the latest change first.
  void back_through(const NodeChanges<Model>& changes, bool covariance_reset) {
    for (std::size_t i = changes.size(); i-- > 0;) {
      using Kind = typename NodeChange<Model>::Kind;
      if (changes[i].kind == Kind::correction) {
        back_through(changes[i].correction, covariance_reset);
      } else if (changes[i].kind == Kind::jitter_redrawn) {
        forget(kTailJitter, 1);
      } else {
        forget(kTailC, 3);
        forget(kTailU, 3);
      }
    }
  }

  void back_through(const Correction<Model>& c, bool covariance_reset) {
    using Tall = typename Correction<Model>::Tall;
    if (covariance_reset) {
      Model::template reset_back<1>(lambda, c.eps);
      Model::template reset_back<Model::Dim>(Lambda, c.eps);
      Lambda.transposeInPlace();
      Model::template reset_back<Model::Dim>(Lambda, c.eps);
    }
    const Scalar gamma = c.weight, gain = gamma * (Scalar(2) - gamma);
    const Vector3<Scalar> K_lambda = c.K.transpose() * lambda;
    lambda += c.Ht * Vector3<Scalar>(gamma * c.S_inverse_z - gain * K_lambda);
    // Lambda + Y H + (Y H)^T, Y = gain (H^T (S^-1 + gain K^T Lambda K) / 2 - Lambda K)
    const Tall LK = Lambda.lazyProduct(c.K);
    const Matrix3<Scalar> KLK = c.K.transpose().lazyProduct(LK);
    const Tall Y = gain * (Scalar(0.5) * c.Ht.lazyProduct(Matrix3<Scalar>(c.S_inverse + gain * KLK)) - LK);
    const typename Model::Covariance YH = Y.lazyProduct(c.Ht.transpose());
    Lambda += YH + YH.transpose();
  }

  // (Eq. 32). F = [F B 0; 0 I 0; 0 0 A], A that of the tail.
  void back_over(const NavTransition<Scalar>& t, const TailStep& tail) {
    lambda = back_over_columns<1>(lambda, t, tail);
    const typename Model::Covariance half = back_over_columns<Model::Dim>(Lambda, t, tail).transpose();
    Lambda = back_over_columns<Model::Dim>(half, t, tail);
    Lambda = (Scalar(0.5) * (Lambda + Lambda.transpose())).eval();
  }

  // (Eq. 30).
  Belief<Model> smoothed(const Belief<Model>& belief, bool covariance_reset) const {
    const typename Model::Covariance PL = belief.P.lazyProduct(Lambda);
    const typename Model::Tangent eps = belief.P * lambda;
    Belief<Model> out{Model::retract(belief.X, eps), belief.P - PL.lazyProduct(belief.P)};
    Ekf<Model>::symmetrise(out.P);
    if (covariance_reset) {
      Model::reset(out.P, eps);
      mirror(out.P);
    }
    if ((out.P.diagonal().array() < Scalar(0)).any()) {
      throw NumericalError("smoother: a variance came out negative; the filter's covariance has lost its digits");
    }
    return out;
  }

 private:
  void forget(int first, int count) {
    if (first >= Model::kTailDim) return;
    lambda.segment(kTail + first, count).setZero();
    Lambda.middleRows(kTail + first, count).setZero();
    Lambda.middleCols(kTail + first, count).setZero();
  }

  // F^T M.
  template <int cols>
  static Eigen::Matrix<Scalar, Model::Dim, cols> back_over_columns(const Eigen::Matrix<Scalar, Model::Dim, cols>& M,
                                                                   const NavTransition<Scalar>& t,
                                                                   const TailStep& tail) {
    Eigen::Matrix<Scalar, Model::Dim, cols> out;
    out.template topRows<9>() = t.F.transpose().lazyProduct(M.template topRows<9>());
    out.template middleRows<6>(kBa) =
        M.template middleRows<6>(kBa) + t.B.transpose().lazyProduct(M.template topRows<9>());
    for (int i = 0; i < Model::kTailDim; ++i)
      out.row(kTail + i) = Scalar(tail.keep[static_cast<std::size_t>(i)]) * M.row(kTail + i);
    for (int i = 0; i < Model::kTailDim; ++i) {
      if (TailStep::is_driven(i, Model::kTailDim))
        out.row(kTail + TailStep::driver(i)) +=
            Scalar(tail.from_driver[static_cast<std::size_t>(i)]) * M.row(kTail + i);
    }
    return out;
  }
};

}  // namespace liealign
