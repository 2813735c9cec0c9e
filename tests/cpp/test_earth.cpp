// Laws of the Earth floor: published values, round trips, gradients.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/earth/gravity.hpp"

namespace liealign {
namespace {

TEST(Geodesy, ecef_round_trip_is_below_five_nanometres) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> lat(-90, 90), lon(-180, 180);
  for (double height : {-10e3, -100.0, 0.0, 500.0, 9e3, 100e3, 10000e3}) {
    for (int i = 0; i < 2000; ++i) {
      double latitude = lat(rng);
      if (i == 0) latitude = 90;
      if (i == 1) latitude = -90;
      if (i == 2) latitude = 0;
      const Geodetic g{latitude * kDegToRad, lon(rng) * kDegToRad, height};
      const Vector3d p = ecef_from_geodetic(g);
      EXPECT_LT((ecef_from_geodetic(geodetic_from_ecef(p)) - p).norm(), 5e-9 * std::max(1.0, height / 1e6))
          << latitude << " " << height;
      EXPECT_NEAR(geodetic_from_ecef(p).height_m, height, 5e-9 * std::max(1.0, height / 1e6));
    }
  }
}

// Bowring's turns against their fixed point, in long double: where the heights of the round trip do not reach.
TEST(Geodesy, latitude_settles_from_400_km_off_the_centre_to_a_million_kilometres) {
  for (double radius : {400e3, 1000e3, 3000e3, 6350e3, 7000e3, 42e6, 1e9}) {
    for (double angle = -90.0; angle <= 90.0; angle += 0.5) {
      const Vector3d p(0.6 * radius * std::cos(angle * kDegToRad), -0.8 * radius * std::cos(angle * kDegToRad),
                       radius * std::sin(angle * kDegToRad));
      const long double f = wgs84::kFlattening, a = wgs84::kA, b = a * (1 - f), e2 = f * (2 - f);
      const long double out = std::hypot<long double>(p.x(), p.y()), up = p.z();
      long double beta = std::atan2(up, (1 - f) * out), lat = 0;
      for (int turn = 0; turn < 30; ++turn) {
        const long double s = std::sin(beta), c = std::cos(beta);
        lat = std::atan2(up + e2 / (1 - e2) * b * s * s * s, out - e2 * a * c * c * c);
        beta = std::atan2((1 - f) * std::sin(lat), std::cos(lat));
      }
      EXPECT_NEAR(geodetic_from_ecef(p).lat_rad, static_cast<double>(lat), 1e-15) << radius << " " << angle;
    }
  }
}

TEST(Geodesy, position_and_axes_found_together_are_those_found_alone) {
  for (const Vector3d& p : {Vector3d(4e6, -3e6, 4.1e6), Vector3d(-6.4e6, 0, -10), Vector3d(0, 0, -6.36e6)}) {
    const LocalFrame local = local_frame(p);
    const Geodetic g = geodetic_from_ecef(p);
    EXPECT_EQ(local.position.lat_rad, g.lat_rad);
    EXPECT_EQ(local.position.lon_rad, g.lon_rad);
    EXPECT_EQ(local.position.height_m, g.height_m);
    EXPECT_EQ(local.C_n_e, C_n_e(p));
    EXPECT_LT((local.C_n_e - C_n_e(g.lat_rad, g.lon_rad)).cwiseAbs().maxCoeff(), 4e-16);
  }
}

TEST(Geodesy, known_points) {
  EXPECT_LT((ecef_from_geodetic({0, 0, 0}) - Vector3d(6378137.0, 0, 0)).norm(), 1e-9);
  EXPECT_NEAR(ecef_from_geodetic({kPi / 2, 0, 0}).z(), 6356752.3142451793, 2e-9);  // b, NGA.STND.0036 table 3.3
}

TEST(Geodesy, ned_axes_are_the_derivatives_of_position) {
  const Geodetic g{48.2 * kDegToRad, 16.37 * kDegToRad, 200};
  const double h = 1e-6;
  const auto axis = [](const Vector3d& a, const Vector3d& b) { return ((b - a) / (b - a).norm()).eval(); };
  Matrix3d C;
  C.col(0) = axis(ecef_from_geodetic({g.lat_rad - h, g.lon_rad, g.height_m}),
                  ecef_from_geodetic({g.lat_rad + h, g.lon_rad, g.height_m}));
  C.col(1) = axis(ecef_from_geodetic({g.lat_rad, g.lon_rad - h, g.height_m}),
                  ecef_from_geodetic({g.lat_rad, g.lon_rad + h, g.height_m}));
  C.col(2) = axis(ecef_from_geodetic({g.lat_rad, g.lon_rad, g.height_m + 1}),
                  ecef_from_geodetic({g.lat_rad, g.lon_rad, g.height_m - 1}));
  EXPECT_LT((C - C_n_e(g.lat_rad, g.lon_rad)).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR(C_n_e(ecef_from_geodetic(g)).determinant(), 1.0, 1e-14);
}

TEST(Geodesy, euler_angles_round_trip) {
  for (double roll = -170; roll < 180; roll += 37)
    for (double pitch = -89; pitch < 90; pitch += 25)
      for (double yaw = -179; yaw < 180; yaw += 31) {
        const Vector3d rpy = Vector3d(roll, pitch, yaw) * kDegToRad;
        EXPECT_LT((rpy_from_C_b_n(C_b_n_from_rpy(rpy)) - rpy).cwiseAbs().maxCoeff(), 2e-14);
      }
}

// Somigliana's closed formula: normal gravity on the ellipsoid. NGA.STND.0036 (4-1).
double somigliana(double lat) {
  const double s2 = std::sin(lat) * std::sin(lat), c2 = 1 - s2;
  return (wgs84::kA * wgs84::kGravityEquator * c2 + wgs84::kB * wgs84::kGravityPole * s2) /
         std::sqrt(wgs84::kA * wgs84::kA * c2 + wgs84::kB * wgs84::kB * s2);
}

TEST(Gravity, normal_model_equals_somigliana_on_the_ellipsoid) {
  double worst = 0, worst_j2 = 0;
  for (double lat = -90; lat <= 90; lat += 2.5) {
    const Vector3d p = ecef_from_geodetic({lat * kDegToRad, 0.3, 0});
    const Matrix3d C = C_n_e(lat * kDegToRad, 0.3);
    const Vector3d g_n = C.transpose() * gravity_e(p, GravityModel::normal);
    worst = std::max(worst, (g_n - Vector3d(0, 0, somigliana(lat * kDegToRad))).norm());
    worst_j2 = std::max(worst_j2, (gravity_e(p, GravityModel::j2) - gravity_e(p, GravityModel::normal)).norm());
  }
  EXPECT_LT(worst, 1e-9);       // stated in gravity.hpp
  EXPECT_LT(worst_j2, 1.5e-4);  // stated in gravity.hpp
  EXPECT_GT(worst_j2, 1e-6);    // the models do differ
}

TEST(Gravity, falls_with_height_as_the_published_series) {
  // NGA.STND.0036 (4-3): free-air formula, of first order in the flattening: f^2 of 3.1e-6 1/s^2 is left out.
  const double lat = 48.2 * kDegToRad, s2 = std::sin(lat) * std::sin(lat), m = 0.00344978650684;
  for (double h : {100.0, 500.0, 2000.0}) {
    const double published =
        somigliana(lat) * (1 - 2 / wgs84::kA * (1 + wgs84::kFlattening + m - 2 * wgs84::kFlattening * s2) * h +
                           3 / (wgs84::kA * wgs84::kA) * h * h);
    const Vector3d g_n = C_n_e(lat, 0).transpose() * gravity_e(ecef_from_geodetic({lat, 0, h}), GravityModel::normal);
    EXPECT_NEAR(g_n.z(), published, 5e-11 * h) << h;
  }
}

TEST(Gravity, gradient_is_within_one_percent_of_the_numeric_one) {
  for (double lat : {0.0, 0.8, 1.5}) {
    const Vector3d p = ecef_from_geodetic({lat, 1.0, 300});
    const Matrix3d analytic = gravitation_gradient_e(p);
    Matrix3d numeric;
    for (int i = 0; i < 3; ++i) {
      const Vector3d d = 100 * Vector3d::Unit(i);
      numeric.col(i) =
          (gravitation_e<double>(p + d, GravityModel::normal) - gravitation_e<double>(p - d, GravityModel::normal)) /
          200;
    }
    EXPECT_LT((analytic - numeric).norm(), 0.01 * numeric.norm());
  }
}

}  // namespace
}  // namespace liealign
