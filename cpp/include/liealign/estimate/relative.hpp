// Two position errors: against the Earth, rho, and in the receiver's own datum, rho + S c with S = C^T K, where K c is the
// receiver's correlated error (gnss_position.hpp). What blurs an image is the second.
//
//   cov(rho + S c) = P_rho + G S^T + (G S^T)^T + S V S^T,   G = cov(rho, c), V = cov(c)                          (Eq. 83)
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/estimate/ekf.hpp"
#include "liealign/estimate/lie_model.hpp"

namespace liealign {

// c beside the navigation error: what it is, its covariance with (phi, nu, rho), and its own.
template <typename Scalar>
struct ErrorCorrelation {
  NavRows<Scalar, 3> G;
  Matrix3<Scalar> V;
  Vector3<Scalar> c;
};

// (Eq. 83) of a point whose covariances these are.
template <typename Scalar>
Matrix3<Scalar> relative_covariance(const Matrix3<Scalar>& P_rho, const Matrix3<Scalar>& G, const Matrix3<Scalar>& V,
                                    const Matrix3<Scalar>& S) {
  const Matrix3<Scalar> half = G * S.transpose() + Scalar(0.5) * (S * Matrix3<Scalar>(V * S.transpose()));
  return P_rho + half + half.transpose();
}

template <int tail>
ErrorCorrelation<double> error_correlation(const Belief<LieModel<double, tail>>& belief) {
  if constexpr (tail == 0) {
    return {{Matrix3d::Zero(), Matrix3d::Zero(), Matrix3d::Zero()}, Matrix3d::Zero(), Vector3d::Zero()};
  } else {
    constexpr int c = kTail + kTailC;
    return {{belief.P.template block<3, 3>(kPhi, c), belief.P.template block<3, 3>(kNu, c),
             belief.P.template block<3, 3>(kRho, c)},
            belief.P.template block<3, 3>(c, c),
            belief.X.second.x.template segment<3>(6 + kTailC)};
  }
}

// A belief of the vehicle alone.
template <int tail>
Belief<LieModel<double>> without_tail(const Belief<LieModel<double, tail>>& belief) {
  return {{belief.X.first, {biases(belief.X)}}, belief.P.template topLeftCorner<kTail, kTail>()};
}

}  // namespace liealign
