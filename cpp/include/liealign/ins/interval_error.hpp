// The left error over a preintegrated interval, block by block, without a dense transition.
//
// In axes that stay those of the start, with nu' as in (Eq. 50) and time t into the interval:
//   x_0 = (phi, nu + (W + k) rho, rho),  W = hat(C^T omega_ie), k = T/2 C^T (grad gamma) C
//   x_t = D_t x_0 + B_t b + w,           D_t: rho drifts by t nu';  B_t of (Eq. 51);  w ~ Q_t
//   rho = dC^T y, nu = dC^T (z - (W - k) y), phi = dC^T phi_t,  y = rho_t - hat(dp) phi_t, z = nu'_t - hat(dv) phi_t   (Eq. 53)
// The gradient of gravitation acts half at the start, half at the end of the interval (at its end alone k counts in the
// last line): within it nothing but drift is left.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/ins/preintegration.hpp"

namespace liealign {

// Matrices of nine columns (phi, nu, rho), whose rows stand for anything. Operations on columns are vectorised over rows.
template <typename Scalar, int rows>
using NavColumns = Eigen::Matrix<Scalar, rows, 9>;
// A 9x9 one with three rows of zeros, so that columns divide into whole registers.
template <typename Scalar>
using NavSquare = NavColumns<Scalar, 12>;

namespace detail {

// M.cols(to) += M.cols(from) A^T.
template <typename Scalar, int rows, int cols>
void add_columns(Eigen::Matrix<Scalar, rows, cols>& M, int to, int from, const Matrix3<Scalar>& A) {
  const Eigen::Matrix<Scalar, rows, 3> source = M.template middleCols<3>(from);
  M.template middleCols<3>(to) += source.lazyProduct(A.transpose());
}

// M.cols(to) -= M.cols(from) hat(x)^T.
template <typename Scalar, int rows, int cols>
void subtract_cross_columns(Eigen::Matrix<Scalar, rows, cols>& M, int to, int from, const Vector3<Scalar>& x) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    M.col(to + i) += x[k] * M.col(from + j) - x[j] * M.col(from + k);
  }
}

template <typename Scalar>
void transpose(NavSquare<Scalar>& M) {
  for (int j = 1; j < 9; ++j)
    for (int i = 0; i < j; ++i) std::swap(M(i, j), M(j, i));
}

// S + Y + Y^T, exactly symmetric where S is.
template <typename Scalar>
void symmetric_sum(NavSquare<Scalar>& S, const NavSquare<Scalar>& Y) {
  S += Y;
  S.template topRows<9>() += Y.template topRows<9>().transpose();
}

}  // namespace detail

// What (Eq. 53) needs of the state at the start.
template <typename Scalar>
struct StartAxes {
  Vector3<Scalar> omega_ie_b;  // C^T omega_ie, rad/s
  Matrix3<Scalar> kick;        // k, 1/s

  StartAxes(const SE23<Scalar>& X, double T)
      : omega_ie_b(X.C.transpose() * wgs84::omega_ie_e<Scalar>()),
        kick(Scalar(0.5 * T) * (X.C.transpose() * gravitation_gradient_e(X.p) * X.C)) {}
};

// M <- M K^T, K: (phi, nu, rho) to x_0.
template <typename Scalar, int rows>
void enter_interval(NavColumns<Scalar, rows>& M, const StartAxes<Scalar>& a) {
  constexpr int kNu = SE23<Scalar>::kNu, kRho = SE23<Scalar>::kRho;
  detail::add_columns<Scalar>(M, kNu, kRho, hat(a.omega_ie_b) + a.kick);
}

// M <- M D^T.
template <typename Scalar, int rows>
void drift(NavColumns<Scalar, rows>& M, const Scalar& t) {
  constexpr int kNu = SE23<Scalar>::kNu, kRho = SE23<Scalar>::kRho;
  M.template middleCols<3>(kRho) += t * M.template middleCols<3>(kNu);
}

// M <- M L^T, L: x_T to (phi, nu, rho) at the end.
template <typename Scalar, int rows>
void leave_interval(NavColumns<Scalar, rows>& M, const SE23<Scalar>& d, const StartAxes<Scalar>& a) {
  constexpr int kPhi = SE23<Scalar>::kPhi, kNu = SE23<Scalar>::kNu, kRho = SE23<Scalar>::kRho;
  detail::subtract_cross_columns<Scalar>(M, kRho, kPhi, d.p);
  detail::subtract_cross_columns<Scalar>(M, kNu, kPhi, d.v);
  detail::add_columns<Scalar>(M, kNu, kRho, a.kick - hat(a.omega_ie_b));
  for (const int block : {kPhi, kNu, kRho}) {
    const Eigen::Matrix<Scalar, rows, 3> source = M.template middleCols<3>(block);
    M.template middleCols<3>(block) = source.lazyProduct(d.C);
  }
}

// The transition (F, B) of the left error over the whole interval, as matrices.
template <typename Scalar>
NavTransition<Scalar> interval_transition(const StartAxes<Scalar>& axes, const SE23<Scalar>& d,
                                          const Preintegrated<Scalar>& pre) {
  NavColumns<Scalar, 9> F_transposed = NavColumns<Scalar, 9>::Identity();
  enter_interval(F_transposed, axes);
  drift(F_transposed, Scalar(pre.T));
  leave_interval(F_transposed, d, axes);
  NavColumns<Scalar, 6> B_transposed = pre.B.template topRows<9>().transpose();
  leave_interval(B_transposed, d, axes);
  return {F_transposed.transpose(), B_transposed.transpose()};
}

// P (15x15, of the left error) over the whole interval; half_walk is what the biases gain in one half of it: they walk on
// half before and half after, which leaves the mean of their products with the rest right.
template <typename Scalar>
void propagate_interval(SquareMatrix<Scalar, 15>& P, const StartAxes<Scalar>& axes, const SE23<Scalar>& d,
                        const Preintegrated<Scalar>& pre, const Vector<Scalar, 6>& half_walk) {
  constexpr int kNav = 9, kBias = 6;
  P.diagonal().template tail<kBias>() += half_walk;
  const SquareMatrix<Scalar, kBias> P_bb = P.template bottomRightCorner<kBias, kBias>();
  NavColumns<Scalar, kBias> P_bn = P.template bottomLeftCorner<kBias, kNav>();
  NavSquare<Scalar> S;
  S.template topRows<kNav>() = P.template topLeftCorner<kNav, kNav>();
  S.template bottomRows<3>().setZero();

  const Scalar T(pre.T);
  for (int side = 0; side < 2; ++side) {
    enter_interval(S, axes);
    drift(S, T);
    if (side == 0) detail::transpose(S);
  }
  enter_interval(P_bn, axes);
  drift(P_bn, T);

  const Eigen::Matrix<Scalar, kBias, kNav> B_transposed = pre.B.template topRows<kNav>().transpose();
  const Eigen::Matrix<Scalar, 12, kBias> B_bb = pre.B.lazyProduct(P_bb);
  // S + B P_bn + P_nb B^T + B P_bb B^T + Q = S + Y + Y^T + Q
  Eigen::Matrix<Scalar, 12, kBias> half = Scalar(0.5) * B_bb;
  half.template topRows<kNav>() += P_bn.transpose();
  const NavSquare<Scalar> Y = half.lazyProduct(B_transposed);
  S += pre.Q;
  detail::symmetric_sum(S, Y);
  P_bn += B_bb.template topRows<kNav>().transpose();

  leave_interval(S, d, axes);
  detail::transpose(S);
  leave_interval(S, d, axes);
  leave_interval(P_bn, d, axes);
  for (int j = 0; j < kNav; ++j)
    for (int i = j; i < kNav; ++i) P(i, j) = P(j, i) = Scalar(0.5) * (S(i, j) + S(j, i));
  P.template bottomLeftCorner<kBias, kNav>() = P_bn;
  P.template topRightCorner<kNav, kBias>() = P_bn.transpose();
  P.diagonal().template tail<kBias>() += half_walk;
}

}  // namespace liealign
