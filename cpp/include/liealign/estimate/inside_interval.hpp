// State and covariance at any sample inside a preintegrated interval, of the filter or of the smoother, from those at its
// start alone: no step from the neighbouring sample.
//
// What the future says about the left error at a time is an adjoint (lambda, Lambda): X^s = X exp(P lambda), P^s = P - P Lambda P.
// At the end of an interval, from the smoothed belief there, z_s and J_0 as in (Eq. 30) and (Eq. 32), and brought to its start:
//   lambda_N = P_N^-1 z_s,  Lambda_N = P_N^-1 (P_N - J_0 P^s_N J_0^T) P_N^-1,   lambda = F^T lambda_N,  Lambda = F^T Lambda_N F    (Eq. 54)
// Inside, x_t = A_t x_0 + w with A_t = [D_t B_t; 0 I] and w ~ Q_t of (Eq. 53), in the coordinates of x_0 and after it with
// the future N = D_t^-1 Q_t, M = P Lambda of the white noise:
//   x^s = A_t P lambda + N^T lambda,   P^s_t = A_t P^s A_t^T + Q_t - A_t M N - (A_t M N)^T - N^T Lambda N                (Eq. 55)
// Equal to the steps of (Eq. 30) sample by sample, to rounding. Source: Bryson & Frazier (1963); Bierman (1973) for the adjoint.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/estimate/interval_run.hpp"

namespace liealign {

struct Adjoint {
  Vector<double, 15> lambda = Vector<double, 15>::Zero();
  SquareMatrix<double, 15> Lambda = SquareMatrix<double, 15>::Zero();
};

// (Eq. 54): at the start of the interval (after the first half of the biases' walk) from `smoothed` at its end. Throws
// NumericalError when the predicted covariance is not positive definite.
Adjoint adjoint_before(const IntervalStep& step, const Belief<LieModel<double>>& smoothed, bool covariance_reset);

// The smoothed belief at the start of the interval.
Belief<LieModel<double>> smoothed_before(const IntervalStep& step, const Adjoint& adjoint, bool covariance_reset);

// State, navigation part of the covariance of its left error, and the biases' own covariance.
struct NavBelief {
  NavState<double> X;
  NavSquare<double> P_nn;  // rows 9 to 11 are zero
  SquareMatrix<double, 6> P_bb;
};

// (Eq. 55), prepared for one interval.
class InsideInterval {
 public:
  // Without an adjoint: the filter's.
  InsideInterval(const IntervalStep& step, const Vector<double, 6>& half_walk, const Adjoint* adjoint,
                 bool covariance_reset);

  // pre: the samples from the start of the interval to the wanted time.
  Belief<LieModel<double>> at(const Preintegrated<double>& pre) const;
  // The same without the covariances between navigation and biases, which most outputs do not need.
  NavBelief nav_at(const Preintegrated<double>& pre) const;

 private:
  NavBelief compute(const Preintegrated<double>& pre, NavColumns<double, 6>* P_bn) const;

  const IntervalStep& step_;
  StartAxes<double> axes_;
  bool smoothed_, covariance_reset_;
  // In the coordinates of x_0; rows 9 to 11 of the tall ones are zero.
  NavSquare<double> P_nn_, M_nn_;
  Eigen::Matrix<double, 12, 6> P_nb_;
  SquareMatrix<double, 6> P_bb_;
  NavColumns<double, 6> M_bn_;
  SquareMatrix<double, 9> Lambda_;
  Vector<double, 9> lambda_;
  Vector<double, 15> x_0_;
};

}  // namespace liealign
