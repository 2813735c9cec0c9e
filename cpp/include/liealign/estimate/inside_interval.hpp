// State and covariance at any sample inside a preintegrated interval, of the filter or of the smoother, from those at its
// start alone: no step from the neighbouring sample.
//
// With lambda and Lambda of (Eq. 30) at the start, x_t = A_t x_0 + w, A_t = [I B_t 0; 0 I 0; 0 0 a_t] and w ~ Q_t of (Eq. 53) and
// (Eq. 79), in the coordinates of (Eq. 53) and with M = P Lambda:
//   x^s = A_t P lambda + Q_t lambda,   P^s_t = A_t P^s A_t^T + Q_t - A_t M Q_t - (A_t M Q_t)^T - Q_t Lambda Q_t          (Eq. 55)
// Equal to the steps of (Eq. 30) sample by sample, to rounding. Source: Bryson & Frazier (1963); Bierman (1973) for the adjoint.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "liealign/core/lanes.hpp"
#include "liealign/estimate/interval_run.hpp"
#include "liealign/estimate/relative.hpp"

namespace liealign {

// A belief at the start of an interval, and what the future says of it.
template <int tail>
struct AtStart {
  const IntervalStep<tail>& step;
  const Adjoint<LieModel<double, tail>>* adjoint;  // null: the filter's
};

// State, and the covariances of the blocks of its left error.
template <typename Scalar>
struct NavBelief {
  NavState<Scalar> X;
  Matrix3<Scalar> P_phi, P_nu, P_rho, P_relative;
  Vector3<Scalar> c;  // of the tail
};

// The same with all covariances of the vehicle, and those with the receiver's error.
template <typename Scalar>
struct WholeBelief {
  Belief<LieModel<Scalar>> belief;
  ErrorCorrelation<Scalar> error;
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

// (Eq. 55), prepared for one interval; it gives four samples at once.
class InsideInterval {
 public:
  template <int tail>
  InsideInterval(const AtStart<tail>& start, const FilterOptions& options);

  // samples.pre: from the start of the interval to the wanted times. What lanes beyond their count hold is of no use.
  WholeBelief<Lanes> at(const SampleLanes& samples) const;
  // The same without the other covariances, which most outputs do not need.
  NavBelief<Lanes> nav_at(const SampleLanes& samples) const;
  // The biases' own covariance, all through the interval.
  const SquareMatrix<double, 6>& P_bb() const { return P_bb_; }
  // What turns c into a position error in ECEF axes; zero without a tail.
  const Matrix3d& root() const { return root_; }

 private:
  using Scalar = Lanes;
  struct Inside;
  // The receiver's error c, and u that drives it, beside the rest: columns (of x_0, or of P Lambda and Lambda).
  struct ErrorColumns {
    NavRows<Scalar, 3> P, M, M_transposed, Lambda;  // with (phi, nu, rho); M_transposed: M of (c, nav), transposed
    Eigen::Matrix<Scalar, 6, 3> P_b, M_b;
    Vector3<Scalar> mean, lambda;
  };
  struct ErrorBlocks {
    Matrix3<Scalar> P, M, Lambda;
  };
  Inside inside(const Preintegrated<Scalar>& pre) const;
  void add_error(const SampleLanes& samples, Inside& in) const;
  template <int tail>
  void set_error(const SquareMatrix<double, kTail + tail>& P, const SquareMatrix<double, kTail + tail>& M,
                 const SquareMatrix<double, kTail + tail>& Lambda, const Vector<double, kTail + tail>& mean,
                 const Vector<double, kTail + tail>& lambda);

  bool smoothed_, covariance_reset_, straight_, has_error_ = false;
  TailModel tail_;
  Matrix3d root_ = Matrix3d::Zero();
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
  ErrorColumns c_, u_;
  ErrorBlocks cc_, cu_, uc_, uu_;
};

extern template InsideInterval::InsideInterval(const AtStart<kNoTail>&, const FilterOptions&);
extern template InsideInterval::InsideInterval(const AtStart<kShortTail>&, const FilterOptions&);
extern template InsideInterval::InsideInterval(const AtStart<kLongTail>&, const FilterOptions&);

}  // namespace liealign
