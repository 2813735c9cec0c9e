// Laws of the flight kinds: what each of them promises, over many seeds.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "flights.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"

namespace liealign {
namespace {

constexpr std::array kMoving = {FlightKind::lines, FlightKind::circles, FlightKind::helical, FlightKind::rectangular};
constexpr double kRate = 50.0;  // of the references here: gusts and wobble stay below 3 Hz

// What is looked at of a flight, NED of the pad.
struct Summary {
  double reached_5 = 1e9;                   // s after the take-off
  double across = 0.0, along = 0.0;         // largest acceleration, horizontal and vertical, m/s^2
  double jerk = 0.0;                        // m/s^3
  double lowest = 0.0, home = 0.0;          // m
  double crab_sin = 0.0, crab_cos = 0.0;    // mean direction of heading against course, where it is fast
  double level_min = 1e9, level_max = 0.0;  // height where it is fast
};

DroneFlight drawn(FlightKind kind, bool gentle, std::uint64_t seed) {
  DroneFlight f = random_flight(kind, gentle, seed);
  f.rate_hz = kRate;
  f.oversample = 1;
  f.duration_s = gentle ? 400.0 : 240.0;
  return f;
}

Summary summary(const DroneFlight& f) {
  const std::vector<TruthEpoch> epochs = drone_reference(f);
  const Matrix3d C_e_n = C_n_e(epochs.front().X.p).transpose();
  const Vector3d pad = epochs.front().X.p;
  const double take_off = f.start_time_s + f.parked_before_s;
  Summary s;
  std::size_t fast = 0;
  for (std::size_t k = 1; k + 1 < epochs.size(); ++k) {
    const SE23<double>& X = epochs[k].X;
    const Vector3d v = C_e_n * X.v, p = C_e_n * (X.p - pad);
    const Vector3d a = C_e_n * (epochs[k + 1].X.v - epochs[k - 1].X.v) * (0.5 * kRate);
    const Vector3d j = C_e_n * (epochs[k + 1].X.v - 2.0 * X.v + epochs[k - 1].X.v) * (kRate * kRate);
    const double speed = v.head<2>().norm();
    if (speed >= 5.0) s.reached_5 = std::min(s.reached_5, epochs[k].t_s - take_off);
    s.across = std::max(s.across, a.head<2>().norm());
    s.along = std::max(s.along, std::abs(a.z()));
    s.jerk = std::max(s.jerk, j.norm());
    s.lowest = std::min(s.lowest, -p.z());
    if (speed < 0.9 * f.speed_mps) continue;
    const double crab = rpy_from_C_b_n(C_e_n * X.C)[2] - std::atan2(v.y(), v.x());
    s.crab_sin += std::sin(crab);
    s.crab_cos += std::cos(crab);
    s.level_min = std::min(s.level_min, -p.z());
    s.level_max = std::max(s.level_max, -p.z());
    ++fast;
  }
  s.crab_sin /= static_cast<double>(fast);
  s.crab_cos /= static_cast<double>(fast);
  s.home = (epochs.back().X.p - pad).norm();
  return s;
}

TEST(FlightKinds, brisk_ones_reach_5_mps_within_20_s_and_come_home) {
  for (const FlightKind kind : kMoving) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      SCOPED_TRACE(flight_kind_name(kind) + " of seed " + std::to_string(seed));
      const Summary s = summary(drawn(kind, false, seed));
      EXPECT_LT(s.reached_5, 20.0);
      EXPECT_LT(s.across, 6.5);
      EXPECT_LT(s.jerk, 40.0);
      EXPECT_GT(s.lowest, -0.05);
      EXPECT_LT(s.home, 1e-4);
    }
  }
}

// The peak of a change of speed is drawn from 0.1 to 0.3 m/s^2; a turned course changes it by up to sqrt(2) speeds,
// and gusts come on top.
TEST(FlightKinds, gentle_ones_accelerate_gently) {
  for (const FlightKind kind : kMoving) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      SCOPED_TRACE(flight_kind_name(kind) + " of seed " + std::to_string(seed));
      const DroneFlight f = drawn(kind, true, seed);
      const Summary s = summary(f);
      EXPECT_GE(f.acceleration_mps2, 0.1);
      EXPECT_LE(f.acceleration_mps2, 0.3);
      EXPECT_LT(s.across, 0.45);
      EXPECT_GT(s.across, 0.05);
      EXPECT_LT(s.along, 0.4);
      EXPECT_LT(s.home, 1e-4);
    }
  }
}

TEST(FlightKinds, hover_shows_nothing_and_parked_does_not_move) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Summary s = summary(drawn(FlightKind::hover, seed % 2 == 0, seed));
    EXPECT_LT(s.across, 0.005);
    EXPECT_GT(s.along, 0.01);  // it does take off
    const std::vector<TruthEpoch> parked = drone_reference(drawn(FlightKind::parked, false, seed));
    EXPECT_EQ((parked.back().X.p - parked.front().X.p).norm(), 0.0);
    EXPECT_EQ((parked.back().X.C - parked.front().X.C).norm(), 0.0);
    EXPECT_EQ(parked.back().X.v.norm(), 0.0);
  }
}

// Drawn headings are all over the circle, at the start and against the course.
TEST(FlightKinds, the_heading_has_nothing_to_do_with_the_course) {
  double start_sin = 0, start_cos = 0, crab_sin = 0, crab_cos = 0;
  constexpr int kFlights = 200;
  for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
    const DroneFlight f = random_flight(FlightKind::lines, false, seed);
    start_sin += std::sin(f.heading_deg * kDegToRad) / kFlights;
    start_cos += std::cos(f.heading_deg * kDegToRad) / kFlights;
    crab_sin += std::sin(f.crab_deg * kDegToRad) / kFlights;
    crab_cos += std::cos(f.crab_deg * kDegToRad) / kFlights;
  }
  const double four_sigma = 4.0 / std::sqrt(2.0 * kFlights);
  for (const double mean : {start_sin, start_cos, crab_sin, crab_cos}) EXPECT_NEAR(mean, 0.0, four_sigma);
}

TEST(FlightKinds, each_has_its_shape) {
  DroneFlight f;
  f.rate_hz = kRate;
  f.oversample = 1;
  f.gust_mps2 = f.attitude_wobble_deg = 0.0;
  f.crab_deg = 70.0;
  f.duration_s = 240.0;
  f.altitude_m = 10.0;
  // The nose follows a circle's course at its angle; with nose_follows = 0 it stays, and the angle goes all round.
  f.kind = FlightKind::circles;
  Summary s = summary(f);
  EXPECT_NEAR(s.level_max - s.level_min, 0.0, 0.3);
  EXPECT_NEAR(std::atan2(s.crab_sin, s.crab_cos) * kRadToDeg, 70.0, 5.0);
  EXPECT_GT(std::hypot(s.crab_sin, s.crab_cos), 0.9);
  f.nose_follows = 0.0;
  s = summary(f);
  EXPECT_LT(std::hypot(s.crab_sin, s.crab_cos), 0.2);
  f.kind = FlightKind::helical;
  s = summary(f);
  EXPECT_GT(s.level_max - s.level_min, 40.0);
  f.kind = FlightKind::rectangular;
  f.line_spacing_m = 40.0;
  f.nose_follows = 1.0;
  s = summary(f);
  EXPECT_NEAR(s.level_max - s.level_min, 0.0, 0.3);
  EXPECT_NEAR(std::atan2(s.crab_sin, s.crab_cos) * kRadToDeg, 70.0, 20.0);
}

// Wind tilts a hovering drone by drag over g against itself and moves it not at all.
TEST(FlightKinds, the_tilt_holds_against_the_wind) {
  DroneFlight f = drawn(FlightKind::hover, false, 4);
  f.attitude_wobble_deg = f.gust_mps2 = 0.0;
  f.lat_deg = 45.0;
  f.heading_deg = 0.0;
  f.wind_mps = 5.0;
  f.wind_from_deg = 0.0;
  const std::vector<TruthEpoch> epochs = drone_reference(f);
  const TruthEpoch& e = epochs[static_cast<std::size_t>((f.parked_before_s + 60.0) * kRate)];
  const Matrix3d C_b_n = C_n_e(e.X.p).transpose() * e.X.C;
  EXPECT_NEAR(rpy_from_C_b_n(C_b_n)[1], -std::atan2(5.0 * f.drag_per_s, 9.806), 1e-3);  // nose down into the north wind
  EXPECT_LT(e.X.v.norm(), 1e-9);
}

TEST(FlightKinds, names_go_both_ways_and_others_are_refused) {
  for (const FlightKind kind : kMoving) EXPECT_EQ(flight_kind(flight_kind_name(kind)), kind);
  EXPECT_THROW(flight_kind("loop"), Error);
  DroneFlight f = drawn(FlightKind::circles, false, 1);
  f.duration_s = 60.0;
  EXPECT_THROW(drone_reference(f), Error);
  f.kind = FlightKind::hover;
  f.duration_s = 51.0;
  EXPECT_THROW(drone_reference(f), Error);
}

TEST(FlightKinds, a_part_of_a_recording_is_that_part) {
  DroneFlight f = drawn(FlightKind::lines, false, 2);
  f.duration_s = 120.0;
  const SimulatedFlight whole = simulate_flight(f, GnssErrors{}, Config{}, 2);
  const SimulatedFlight part = between(whole, 1040.0, 1100.0);
  EXPECT_EQ(part.flight.gnss.size(), 61u);
  EXPECT_EQ(part.flight.imu.size(), 60u * 50u + 1u);
  EXPECT_EQ(part.truth.epochs.size(), part.flight.imu.size());
  EXPECT_EQ(part.truth.imu.size(), part.flight.imu.size());
  EXPECT_EQ(part.flight.imu.front().t_s, 1040.0);
  EXPECT_EQ(part.flight.imu.front().f_ib_b, whole.flight.imu[40 * 50].f_ib_b);
  EXPECT_THROW(between(whole, 2000.0, 3000.0), Error);
}

// Turn-on biases show in the mean of a parked recording, white noise in its scatter.
TEST(FlightKinds, the_imu_has_the_errors_it_is_given) {
  DroneFlight f = drawn(FlightKind::parked, false, 5);
  f.duration_s = 60.0;
  ImuErrorSizes sizes;
  sizes.turn_on = "fixed";
  const SimulatedFlight usual = simulate_flight(f, GnssErrors{}, Config{}, 5, sizes);
  sizes.accel_turn_on_ug = 20e3;
  sizes.noise_scale = 3.0;
  const SimulatedFlight s = simulate_flight(f, GnssErrors{}, Config{}, 5, sizes);
  Vector3d mean = Vector3d::Zero(), square = Vector3d::Zero(), usual_square = Vector3d::Zero();
  const auto n = static_cast<double>(s.flight.imu.size());
  for (std::size_t k = 0; k < s.flight.imu.size(); ++k) {
    const Vector3d error = s.flight.imu[k].f_ib_b - s.truth.imu[k].f_ib_b;
    mean += error / n;
    square += (s.flight.imu[k].omega_ib_b - s.truth.imu[k].omega_ib_b).cwiseAbs2();
    usual_square += (usual.flight.imu[k].omega_ib_b - usual.truth.imu[k].omega_ib_b).cwiseAbs2();
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::abs(mean[i]), 20.0 * kMilliGToMps2, 0.05 * kMilliGToMps2);
    EXPECT_NEAR(std::sqrt(square[i] / usual_square[i]), 3.0, 0.3);  // the turn-on bias of the gyro is not scaled
  }
}

}  // namespace
}  // namespace liealign
