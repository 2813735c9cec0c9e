// State and covariance at any sample inside a preintegrated interval, of the filter or of the smoother, from those at its
// start alone: no step from the neighbouring sample.
//
// What the future says about the left error at a time is an adjoint (lambda, Lambda): X^s = X exp(P lambda), P^s = P - P Lambda P.
// At the end of an interval, from the smoothed belief there, z_s and J_0 as in (Eq. 30) and (Eq. 32), and brought to its start:
//   lambda_N = P_N^-1 z_s,  Lambda_N = P_N^-1 (P_N - J_0 P^s_N J_0^T) P_N^-1,   lambda = F^T lambda_N,  Lambda = F^T Lambda_N F    (Eq. 54)
// Inside, x_t = A_t x_0 + w with A_t = [I B_t; 0 I] and w ~ Q_t of (Eq. 53), in its coordinates and with M = P Lambda:
//   x^s = A_t P lambda + Q_t lambda,   P^s_t = A_t P^s A_t^T + Q_t - A_t M Q_t - (A_t M Q_t)^T - Q_t Lambda Q_t          (Eq. 55)
// Equal to the steps of (Eq. 30) sample by sample, to rounding. Source: Bryson & Frazier (1963); Bierman (1973) for the adjoint.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "liealign/core/lanes.hpp"
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

// State, and the covariances of the blocks of its left error.
template <typename Scalar>
struct NavBelief {
  NavState<Scalar> X;
  Matrix3<Scalar> P_phi, P_nu, P_rho;
};

// (Eq. 55), prepared for one interval. With Lanes for the scalar it gives four samples at once.
template <typename Scalar>
class InsideInterval {
 public:
  // Without an adjoint: the filter's.
  InsideInterval(const IntervalStep& step, const Vector<double, 6>& half_walk, const Adjoint* adjoint,
                 bool covariance_reset);

  // pre: the samples from the start of the interval to the wanted time.
  Belief<LieModel<Scalar>> at(const Preintegrated<Scalar>& pre) const;
  // The same without the other covariances, which most outputs do not need.
  NavBelief<Scalar> nav_at(const Preintegrated<Scalar>& pre) const;
  // The biases' own covariance, all through the interval.
  const SquareMatrix<double, 6>& P_bb() const { return P_bb_; }

 private:
  struct Inside;
  Inside inside(const Preintegrated<Scalar>& pre) const;

  bool smoothed_, covariance_reset_;
  SquareMatrix<double, 6> P_bb_;
  NavState<Scalar> X_0_;
  IntervalPull<Scalar> pull_;
  StartAxes<Scalar> axes_;  // without the second half of the gradient, which acts at the end
  // In the coordinates of x_0.
  NavCovariance<Scalar, 6> P_;
  SquareMatrix<Scalar, 6> P_bb_lanes_;
  // M_nn^T and Lambda by rows, M_bn.
  NavRows<Scalar, 9> M_nn_transposed_, Lambda_;
  Eigen::Matrix<Scalar, 6, 9> M_bn_;
  NavRows<Scalar, 1> lambda_, x_0_;
  Vector<Scalar, 6> x_b_;
};

// Up to four samples inside an interval, side by side.
struct SampleLanes {
  std::array<std::size_t, Lanes::kCount> k{};
  int count = 0;
  Preintegrated<Lanes> pre;  // lanes beyond `count` hold whatever they held

  bool full() const { return count == Lanes::kCount; }
  void add(std::size_t sample, const Preintegrated<double>& up_to) {
    k[static_cast<std::size_t>(count)] = sample;
    const auto put = [lane = count](auto& to, const auto& from) { set_lane(to, lane, from); };
    pre.each(up_to, put, put);
    ++count;
  }
};

extern template class InsideInterval<double>;
extern template class InsideInterval<Lanes>;

}  // namespace liealign
