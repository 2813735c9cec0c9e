// Gravitation (attraction only) and gravity (with the centrifugal part) in ECEF.
//
//   gamma_e = grad V,  V = GM/r (1 - sum_n J_n (a/r)^n P_n(z/r)), n even                       (Eq. 12)
//   g_e     = gamma_e - omega_ie x (omega_ie x p)                                             (Eq. 13)
//
// `normal` is the field of the WGS 84 ellipsoid, zonal harmonics J2 to J8: within 1e-9 m/s^2 of the published normal
// gravity at equator and pole (tested). The true field differs from it by its anomaly, typically 3e-4 m/s^2.
// `j2` stops at J2, the kind of simplified model the papers use (TAES cites Rogers and prints no formula): within
// 1.5e-4 m/s^2 of `normal`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "liealign/core/types.hpp"
#include "liealign/earth/wgs84.hpp"

namespace liealign {

enum class GravityModel { normal, j2 };

// J_2, J_4, J_6, J_8 of the normal field from J_2 and e^2:
// J_2n = (-1)^(n+1) 3 e^(2n) / ((2n+1)(2n+3)) (1 - n + 5 n J_2 / e^2). Heiskanen & Moritz (1967) 2-92.
inline constexpr double kJ2 = 1.082629821313305e-3;
inline constexpr double zonal_harmonic(int n) {
  double e2n = 1.0;
  for (int i = 0; i < n; ++i) e2n *= wgs84::kE2;
  const double sign = n % 2 == 0 ? -1.0 : 1.0;
  return sign * 3.0 * e2n / ((2.0 * n + 1.0) * (2.0 * n + 3.0)) * (1.0 - n + 5.0 * n * kJ2 / wgs84::kE2);
}

// Gravitation at p_eb_e [m], m/s^2, ECEF axes: (Eq. 12) with s = z/r, u = p/r, z the polar axis,
// gamma_e = -GM/r^2 ((1 - sum J_n (a/r)^n ((n+1) P_n + s P'_n)) u + sum J_n (a/r)^n P'_n z).
template <typename Scalar>
Vector3<Scalar> gravitation_e(const Vector3<Scalar>& p_eb_e, GravityModel model) {
  using std::sqrt;
  constexpr std::array<double, 4> kJ = {kJ2, zonal_harmonic(2), zonal_harmonic(3), zonal_harmonic(4)};
  const Scalar r2 = p_eb_e.squaredNorm();
  const Scalar r = sqrt(r2);
  const Scalar s = p_eb_e[2] / r;
  const Scalar ratio2 = Scalar(wgs84::kA * wgs84::kA) / r2;
  // Legendre polynomials and their derivatives by recurrence: n P_n = (2n-1) s P_{n-1} - (n-1) P_{n-2},
  // P'_n = P'_{n-2} + (2n-1) P_{n-1}.
  Scalar P_before(1), P(s), slope_before(0), slope(1), power(1);
  Scalar radial(1), axial(0);  // gamma = -GM/r^2 (radial u + axial z)
  const int last = model == GravityModel::normal ? 8 : 2;
  for (int n = 2; n <= last; ++n) {
    const double share = 1.0 / n;  // a constant once the loop is unrolled, where a division of Scalars would stay one
    const Scalar P_next = Scalar((2 * n - 1) * share) * s * P - Scalar((n - 1) * share) * P_before;
    const Scalar slope_next = slope_before + Scalar(2 * n - 1) * P;
    P_before = P;
    P = P_next;
    slope_before = slope;
    slope = slope_next;
    if (n % 2 != 0) continue;
    power *= ratio2;
    const Scalar J = Scalar(kJ[static_cast<std::size_t>(n / 2 - 1)]) * power;
    radial -= J * (Scalar(n + 1) * P + s * slope);
    axial += J * slope;
  }
  const Scalar scale = Scalar(wgs84::kGM) / r2;
  Vector3<Scalar> gamma_e = -(scale * radial / r) * p_eb_e;
  gamma_e[2] -= scale * axial;
  return gamma_e;
}

// Gravity at p_eb_e: what a plumb line shows.
template <typename Scalar>
Vector3<Scalar> gravity_e(const Vector3<Scalar>& p_eb_e, GravityModel model) {
  Vector3<Scalar> g_e = gravitation_e(p_eb_e, model);
  const Scalar omega2(wgs84::kOmegaE * wgs84::kOmegaE);
  g_e[0] += omega2 * p_eb_e[0];
  g_e[1] += omega2 * p_eb_e[1];
  return g_e;
}

// d gamma_e / d p_eb_e of a point mass, -GM/r^3 (I - 3 u u^T), 1/s^2: within 1 % of the full gradient, whose
// effect on a fix-aided filter is far below its noise.
template <typename Scalar>
Matrix3<Scalar> gravitation_gradient_e(const Vector3<Scalar>& p_eb_e) {
  using std::sqrt;
  const Scalar r2 = p_eb_e.squaredNorm();
  const Scalar k = Scalar(wgs84::kGM) / (r2 * sqrt(r2));
  return (Scalar(3) * k / r2) * p_eb_e * p_eb_e.transpose() - k * Matrix3<Scalar>::Identity();
}

}  // namespace liealign
