// Geodetic coordinates to ECEF and back. Source: Groves (2013) 2.4.3, Bowring (1976).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/earth/geodesy.hpp"

#include <cmath>

#include "liealign/earth/wgs84.hpp"

namespace liealign {

Vector3d ecef_from_geodetic(const Geodetic& g) {
  const double s = std::sin(g.lat_rad), c = std::cos(g.lat_rad);
  const double R_E = wgs84::kA / std::sqrt(1.0 - wgs84::kE2 * s * s);  // transverse radius of curvature
  return {(R_E + g.height_m) * c * std::cos(g.lon_rad), (R_E + g.height_m) * c * std::sin(g.lon_rad),
          ((1.0 - wgs84::kE2) * R_E + g.height_m) * s};
}

Geodetic geodetic_from_ecef(const Vector3d& p_eb_e) {
  const double beta_p = std::hypot(p_eb_e.x(), p_eb_e.y()), z = p_eb_e.z();
  // Bowring: tan L = (z + e'^2 b sin^3 beta) / (p - e^2 a cos^3 beta), tan beta = (1 - f) tan L. Each turn gains about
  // five digits near the ground; four settle to rounding up to satellite heights.
  const double e_prime2 = wgs84::kE2 / (1.0 - wgs84::kE2);
  double beta = std::atan2(z, (1.0 - wgs84::kFlattening) * beta_p);
  double lat = 0.0;
  for (int turn = 0; turn < 4; ++turn) {
    const double s = std::sin(beta), c = std::cos(beta);
    lat = std::atan2(z + e_prime2 * wgs84::kB * s * s * s, beta_p - wgs84::kE2 * wgs84::kA * c * c * c);
    beta = std::atan2((1.0 - wgs84::kFlattening) * std::sin(lat), std::cos(lat));
  }
  const double s = std::sin(lat), c = std::cos(lat);
  // Projection on the normal: good at the poles as well, where beta_p / cos(lat) is not.
  const double height = beta_p * c + z * s - wgs84::kA * std::sqrt(1.0 - wgs84::kE2 * s * s);
  return {lat, std::atan2(p_eb_e.y(), p_eb_e.x()), height};
}

Matrix3d C_n_e(double lat_rad, double lon_rad) {
  const double sl = std::sin(lat_rad), cl = std::cos(lat_rad), so = std::sin(lon_rad), co = std::cos(lon_rad);
  Matrix3d C;
  C << -sl * co, -so, -cl * co,  //
      -sl * so, co, -cl * so,    //
      cl, 0.0, -sl;
  return C;
}

Matrix3d C_n_e(const Vector3d& p_eb_e) {
  const Geodetic g = geodetic_from_ecef(p_eb_e);
  return C_n_e(g.lat_rad, g.lon_rad);
}

Vector3d rpy_from_C_b_n(const Matrix3d& C) {
  return {std::atan2(C(2, 1), C(2, 2)), std::atan2(-C(2, 0), std::hypot(C(2, 1), C(2, 2))),
          std::atan2(C(1, 0), C(0, 0))};
}

Matrix3d C_b_n_from_rpy(const Vector3d& rpy) {
  const double sr = std::sin(rpy[0]), cr = std::cos(rpy[0]), sp = std::sin(rpy[1]), cp = std::cos(rpy[1]);
  const double sy = std::sin(rpy[2]), cy = std::cos(rpy[2]);
  Matrix3d C;
  C << cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy,  //
      cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy,   //
      -sp, sr * cp, cr * cp;
  return C;
}

}  // namespace liealign
