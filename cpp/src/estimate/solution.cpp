// Epochs in the terms of the output, (Eq. 41).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/solution.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"

namespace liealign {

namespace {

// Of A eps, eps ~ N(0, P): the roots of the diagonal of A P A^T.
Vector3d sigmas(const Matrix3d& A, const Matrix3d& P) {
  const Matrix3d AP = A * P;
  const Vector3d variances = AP.cwiseProduct(A).rowwise().sum();
  if (!(variances.minCoeff() >= 0.0)) throw NumericalError("a variance of the trajectory is negative or not a number");
  return variances.cwiseSqrt();
}

}  // namespace

Epoch epoch_of(double t_s, const NodeBelief& b) {
  const SquareMatrix<double, kTail>& P = b.belief.P;
  const Matrix3d P_rho = P.block<3, 3>(kRho, kRho), S = b.belief.X.first.C.transpose() * b.root;
  return {t_s,
          b.belief.X,
          P.block<3, 3>(kPhi, kPhi),
          P.block<3, 3>(kNu, kNu),
          P_rho,
          relative_covariance<double>(P_rho, b.error.G.rho, b.error.V, S),
          b.root * b.error.c,
          P.diagonal().segment<3>(kBa),
          P.diagonal().segment<3>(kBg)};
}

Epoch epoch_of(double t_s, const NavBelief<Lanes>& b, int i, const InsideInterval& inside) {
  return {t_s,
          lane(b.X, i),
          lane(b.P_phi, i),
          lane(b.P_nu, i),
          lane(b.P_rho, i),
          lane(b.P_relative, i),
          inside.root() * lane(b.c, i),
          inside.P_bb().diagonal().head<3>(),
          inside.P_bb().diagonal().tail<3>()};
}

NavRow nav_row(const Epoch& e) {
  const LocalFrame local = local_frame(e.X.first.p);
  const Matrix3d C_b_n = local.C_n_e.transpose() * e.X.first.C;
  NavRow row;
  row.t_s = e.t_s;
  row.lat_rad = local.position.lat_rad;
  row.lon_rad = local.position.lon_rad;
  row.height_m = local.position.height_m;
  row.v_n_mps = local.C_n_e.transpose() * e.X.first.v;
  row.rpy_rad = rpy_from_C_b_n(C_b_n);
  if (row.rpy_rad[2] < 0.0) row.rpy_rad[2] += 2.0 * kPi;
  if (row.rpy_rad[2] >= 2.0 * kPi) row.rpy_rad[2] = 0.0;  // a rounding below zero

  // Sines and cosines of roll and pitch stand in the last row of C_b_n: (-s_p, s_r c_p, c_r c_p).
  constexpr double kLeastCos = 1e-16;  // straight up or down: huge, but numbers
  const double cp_sr = C_b_n(2, 1), cp_cr = C_b_n(2, 2);
  const double cp = std::max(std::sqrt(cp_sr * cp_sr + cp_cr * cp_cr), kLeastCos);
  const double sr = cp_sr / cp, cr = cp > kLeastCos ? cp_cr / cp : 1.0, tp = -C_b_n(2, 0) / cp;
  Matrix3d euler_by_phi;
  euler_by_phi << 1.0, sr * tp, cr * tp, 0.0, cr, -sr, 0.0, sr / cp, cr / cp;
  row.std_p_n_m = sigmas(C_b_n, e.P_rho);
  row.relative_std_p_n_m = sigmas(C_b_n, e.P_relative);
  row.std_v_n_mps = sigmas(C_b_n, e.P_nu);
  row.std_rpy_rad = sigmas(euler_by_phi, e.P_phi);
  return row;
}

}  // namespace liealign
