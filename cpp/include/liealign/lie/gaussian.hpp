// The concentrated Gaussian on a group: X = mu exp(eps), eps ~ N(0, P).
//
//   log p(X) = -1/2 |log(mu^-1 X)|^2_{P^-1} - 1/2 log((2 pi)^n |P|)                          (Eq. 8)
//
// The normalising constant is the one of the tangent space (exact as P -> 0). Source: TAES (9)-(10).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "liealign/core/error.hpp"
#include "liealign/core/types.hpp"

namespace liealign {

// One draw: `unit_normal` is a vector of Dim independent N(0, 1) numbers, P the covariance of the left error.
template <typename Group>
Group sample_concentrated_gaussian(const Group& mean, const typename Group::Jacobian& P,
                                   const typename Group::Tangent& unit_normal) {
  const Eigen::LLT<typename Group::Jacobian> llt(P);
  if (llt.info() != Eigen::Success) throw NumericalError("concentrated Gaussian: P is not positive definite");
  const typename Group::Tangent eps = llt.matrixL() * unit_normal;
  return mean * Group::exp(eps);
}

template <typename Group>
typename Group::Scalar concentrated_gaussian_log_density(const Group& X, const Group& mean,
                                                         const typename Group::Jacobian& P) {
  using Scalar = typename Group::Scalar;
  using std::log;
  const Eigen::LLT<typename Group::Jacobian> llt(P);
  if (llt.info() != Eigen::Success) throw NumericalError("concentrated Gaussian: P is not positive definite");
  const typename Group::Tangent eps = (mean.inverse() * X).log();
  const typename Group::Tangent whitened = llt.matrixL().solve(eps);
  Scalar half_log_det(0);
  for (int i = 0; i < Group::Dim; ++i) half_log_det += log(llt.matrixLLT()(i, i));
  return Scalar(-0.5) * whitened.squaredNorm() - half_log_det -
         Scalar(0.5 * Group::Dim * std::log(2.0 * std::numbers::pi));
}

}  // namespace liealign
