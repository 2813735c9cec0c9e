// Epochs in the terms of the output, (Eq. 41).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/solution.hpp"

#include <cmath>

#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"

namespace liealign {

NavRow nav_row(const Epoch& e) {
  const Geodetic g = geodetic_from_ecef(e.X.first.p);
  const Matrix3d C_e_n = C_n_e(g.lat_rad, g.lon_rad).transpose();
  const Matrix3d C_b_n = C_e_n * e.X.first.C;
  NavRow row;
  row.t_s = e.t_s;
  row.lat_rad = g.lat_rad;
  row.lon_rad = g.lon_rad;
  row.height_m = g.height_m;
  row.v_n_mps = C_e_n * e.X.first.v;
  row.rpy_rad = rpy_from_C_b_n(C_b_n);
  if (row.rpy_rad[2] < 0.0) row.rpy_rad[2] += 2.0 * kPi;
  if (row.rpy_rad[2] >= 2.0 * kPi) row.rpy_rad[2] = 0.0;  // a rounding below zero
  const auto sigmas = [](const Matrix3d& A, const Matrix3d& P) -> Vector3d {
    return (A * P * A.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  };
  const double sr = std::sin(row.rpy_rad[0]), cr = std::cos(row.rpy_rad[0]), cp = std::cos(row.rpy_rad[1]),
               tp = std::tan(row.rpy_rad[1]);
  Matrix3d euler_by_phi;
  euler_by_phi << 1.0, sr * tp, cr * tp, 0.0, cr, -sr, 0.0, sr / cp, cr / cp;
  row.std_p_n_m = sigmas(C_b_n, e.P_rho);
  row.std_v_n_mps = sigmas(C_b_n, e.P_nu);
  row.std_rpy_rad = sigmas(euler_by_phi, e.P_phi);
  return row;
}

}  // namespace liealign
