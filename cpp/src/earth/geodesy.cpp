// Geodetic coordinates to ECEF and back. Source: Groves (2013) 2.4.3, Bowring (1976).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/earth/geodesy.hpp"

#include <cmath>

#include "liealign/earth/wgs84.hpp"

namespace liealign {
namespace {

// Where the normal of the ellipsoid through a point is directed.
struct Normal {
  double sin_lat, cos_lat, sin_lon, cos_lon;
  double beta_p;  // distance from the axis of the Earth, m
};

Normal normal_at(const Vector3d& p_eb_e) {
  const double x = p_eb_e.x(), y = p_eb_e.y(), z = p_eb_e.z(), beta_p = std::sqrt(x * x + y * y);
  // Bowring: tan L = (z + e'^2 b sin^3 beta) / (p - e^2 a cos^3 beta), tan beta = (1 - f) tan L, each angle by two legs
  // of a triangle. A turn squares the error: near the ground two settle to rounding, three down to 400 km from the
  // centre.
  const double e_prime2 = wgs84::kE2 / (1.0 - wgs84::kE2);
  double across = z, along = (1.0 - wgs84::kFlattening) * beta_p;  // tan beta = across / along
  double up = 0.0, out = 0.0;                                      // tan L = up / out
  for (int turn = 0; turn < 3; ++turn) {
    const double length = std::sqrt(across * across + along * along);
    const double s = across / length, c = along / length;
    up = z + e_prime2 * wgs84::kB * s * s * s;
    out = beta_p - wgs84::kE2 * wgs84::kA * c * c * c;
    across = (1.0 - wgs84::kFlattening) * up;
    along = out;
  }
  const double length = std::sqrt(up * up + out * out);
  const bool pole = beta_p == 0.0;  // longitude 0, as std::atan2 has it
  return {up / length, out / length, pole ? 0.0 : y / beta_p, pole ? 1.0 : x / beta_p, beta_p};
}

Geodetic position_at(const Vector3d& p_eb_e, const Normal& n) {
  // Projection on the normal: good at the poles as well, where beta_p / cos(lat) is not.
  const double height =
      n.beta_p * n.cos_lat + p_eb_e.z() * n.sin_lat - wgs84::kA * std::sqrt(1.0 - wgs84::kE2 * n.sin_lat * n.sin_lat);
  return {std::atan2(n.sin_lat, n.cos_lat), std::atan2(p_eb_e.y(), p_eb_e.x()), height};
}

Matrix3d axes(double sl, double cl, double so, double co) {
  Matrix3d C;
  C << -sl * co, -so, -cl * co,  //
      -sl * so, co, -cl * so,    //
      cl, 0.0, -sl;
  return C;
}

}  // namespace

Vector3d ecef_from_geodetic(const Geodetic& g) {
  const double s = std::sin(g.lat_rad), c = std::cos(g.lat_rad);
  const double R_E = wgs84::kA / std::sqrt(1.0 - wgs84::kE2 * s * s);  // transverse radius of curvature
  return {(R_E + g.height_m) * c * std::cos(g.lon_rad), (R_E + g.height_m) * c * std::sin(g.lon_rad),
          ((1.0 - wgs84::kE2) * R_E + g.height_m) * s};
}

LocalFrame local_frame(const Vector3d& p_eb_e) {
  const Normal n = normal_at(p_eb_e);
  return {position_at(p_eb_e, n), axes(n.sin_lat, n.cos_lat, n.sin_lon, n.cos_lon)};
}

Geodetic geodetic_from_ecef(const Vector3d& p_eb_e) { return position_at(p_eb_e, normal_at(p_eb_e)); }

Matrix3d C_n_e(double lat_rad, double lon_rad) {
  return axes(std::sin(lat_rad), std::cos(lat_rad), std::sin(lon_rad), std::cos(lon_rad));
}

Matrix3d C_n_e(const Vector3d& p_eb_e) {
  const Normal n = normal_at(p_eb_e);
  return axes(n.sin_lat, n.cos_lat, n.sin_lon, n.cos_lon);
}

Vector3d rpy_from_C_b_n(const Matrix3d& C) {
  return {std::atan2(C(2, 1), C(2, 2)), std::atan2(-C(2, 0), std::sqrt(C(2, 1) * C(2, 1) + C(2, 2) * C(2, 2))),
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
