// The navigation part of a covariance, (phi, nu, rho), by its 3x3 blocks: which block meets which is written out once, zeros and
// symmetry cost nothing, and nothing but sums and small products is left, which is what scalars of several lanes are quick with.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/types.hpp"
#include "liealign/lie/se23.hpp"

namespace liealign {

// The symmetric covariance of (phi, nu, rho), by the blocks on and below its diagonal, and that of n other errors with it.
template <typename Scalar, int n>
struct NavCovariance {
  Matrix3<Scalar> phi_phi, nu_phi, nu_nu, rho_phi, rho_nu, rho_rho;
  Eigen::Matrix<Scalar, n, 3> b_phi, b_nu, b_rho;

  // nu += A rho.
  void add_to_nu(const Matrix3<Scalar>& A) {
    nu_phi += A * rho_phi;
    nu_nu += A * rho_nu;
    rho_nu += rho_rho * A.transpose();
    nu_nu += (A * rho_nu).transpose();
    b_nu += b_rho.lazyProduct(A.transpose());
  }
};

// To other axes, by C^T.
template <typename Scalar, int n>
void turn(NavCovariance<Scalar, n>& P, const Matrix3<Scalar>& C) {
  for (Matrix3<Scalar>* block : {&P.phi_phi, &P.nu_phi, &P.nu_nu, &P.rho_phi, &P.rho_nu, &P.rho_rho})
    *block = C.transpose() * Matrix3<Scalar>(*block * C);
  for (Eigen::Matrix<Scalar, n, 3>* block : {&P.b_phi, &P.b_nu, &P.b_rho}) *block = block->lazyProduct(C).eval();
}

// What carries an error to the tangent of another state: phi <- J phi, nu <- R nu + Q_nu phi, rho <- R rho + Q_rho phi.
template <typename Scalar>
struct ResetBlocks {
  Matrix3<Scalar> J, R, Q_nu, Q_rho;
};

template <typename Scalar, int n>
void apply_reset(NavCovariance<Scalar, n>& P, const ResetBlocks<Scalar>& j) {
  const Matrix3<Scalar> Jt = j.J.transpose(), Rt = j.R.transpose(), Q_nu_t = j.Q_nu.transpose(),
                        Q_rho_t = j.Q_rho.transpose();
  // From the left first.
  const Matrix3<Scalar> phi_phi = j.J * P.phi_phi, nu_phi = j.R * P.nu_phi + j.Q_nu * P.phi_phi,
                        rho_phi = j.R * P.rho_phi + j.Q_rho * P.phi_phi,
                        nu_nu = j.R * P.nu_nu + j.Q_nu * P.nu_phi.transpose(),
                        rho_nu = j.R * P.rho_nu + j.Q_rho * P.nu_phi.transpose(),
                        rho_rho = j.R * P.rho_rho + j.Q_rho * P.rho_phi.transpose();
  P.phi_phi = phi_phi * Jt;
  P.nu_phi = nu_phi * Jt;
  P.rho_phi = rho_phi * Jt;
  P.nu_nu = nu_nu * Rt + nu_phi * Q_nu_t;
  P.rho_nu = rho_nu * Rt + rho_phi * Q_nu_t;
  P.rho_rho = rho_rho * Rt + rho_phi * Q_rho_t;
  P.b_nu = P.b_nu.lazyProduct(Rt).eval() + P.b_phi.lazyProduct(Q_nu_t);
  P.b_rho = P.b_rho.lazyProduct(Rt).eval() + P.b_phi.lazyProduct(Q_rho_t);
  P.b_phi = P.b_phi.lazyProduct(Jt).eval();
}

// Rows (phi, nu, rho) of a matrix.
template <typename Scalar, int cols>
struct NavRows {
  Eigen::Matrix<Scalar, 3, cols> phi, nu, rho;
};

// P <- P + Y + Y^T, Y by its columns (phi, nu, rho).
template <typename Scalar, int n>
void add_symmetric(NavCovariance<Scalar, n>& P, const NavRows<Scalar, 3>& Y_phi, const NavRows<Scalar, 3>& Y_nu,
                   const NavRows<Scalar, 3>& Y_rho) {
  P.phi_phi += Y_phi.phi + Y_phi.phi.transpose();
  P.nu_phi += Y_phi.nu + Y_nu.phi.transpose();
  P.nu_nu += Y_nu.nu + Y_nu.nu.transpose();
  P.rho_phi += Y_phi.rho + Y_rho.phi.transpose();
  P.rho_nu += Y_nu.rho + Y_rho.nu.transpose();
  P.rho_rho += Y_rho.rho + Y_rho.rho.transpose();
}

// ---- As a part of the whole covariance ----------------------------------------------------------------------------

// The blocks of a covariance of the left error with its biases and tail.
template <typename Scalar, int dim>
NavCovariance<Scalar, dim - 9> nav_covariance(const SquareMatrix<Scalar, dim>& P) {
  const auto block = [&](int row, int col) -> Matrix3<Scalar> { return P.template block<3, 3>(row, col); };
  return {block(0, 0),
          block(3, 0),
          block(3, 3),
          block(6, 0),
          block(6, 3),
          block(6, 6),
          P.template block<dim - 9, 3>(9, 0),
          P.template block<dim - 9, 3>(9, 3),
          P.template block<dim - 9, 3>(9, 6)};
}

// The other way round, on and below the diagonal. The covariance of biases and tail stays.
template <typename Scalar, int dim>
void set_nav_covariance(SquareMatrix<Scalar, dim>& P, const NavCovariance<Scalar, dim - 9>& nav) {
  P.template block<3, 3>(0, 0) = nav.phi_phi;
  P.template block<3, 3>(3, 0) = nav.nu_phi;
  P.template block<3, 3>(3, 3) = nav.nu_nu;
  P.template block<3, 3>(6, 0) = nav.rho_phi;
  P.template block<3, 3>(6, 3) = nav.rho_nu;
  P.template block<3, 3>(6, 6) = nav.rho_rho;
  P.template block<dim - 9, 3>(9, 0) = nav.b_phi;
  P.template block<dim - 9, 3>(9, 3) = nav.b_nu;
  P.template block<dim - 9, 3>(9, 6) = nav.b_rho;
}

// The half above the diagonal from the one below.
template <typename Scalar, int n>
void mirror(SquareMatrix<Scalar, n>& P) {
  for (int j = 1; j < n; ++j)
    for (int i = 0; i < j; ++i) P(i, j) = P(j, i);
}

}  // namespace liealign
