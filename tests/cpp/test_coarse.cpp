// Laws of the coarse stage: heading, tilt and latency before any filter runs.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "flights.hpp"
#include "liealign/align/coarse.hpp"
#include "liealign/align/force_vectors.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/earth/wgs84.hpp"

namespace liealign {
namespace {

using testing::table_1_flight;
using testing::true_heading;

constexpr double kDeg = kDegToRad;
const Vector3d kLever(0.1, -0.05, -0.3);  // of table_1_flight()

Config unknown_latency() {
  Config config = testing::with_given_parameters({});
  config.gnss.latency_s.reset();
  return config;
}

// table_1_flight() with its latency to be found.
SimulatedFlight flight_with(double latency_s, double heading_deg, std::uint64_t seed) {
  DroneFlight drone = testing::short_flight();
  drone.heading_deg = heading_deg;
  drone.seed = seed;
  GnssErrors gnss;
  gnss.l_ba_b = kLever;
  gnss.latency_s = latency_s;
  return simulate_flight(drone, gnss, unknown_latency(), seed);
}

// The records as the filter takes them, stamps as they are.
std::vector<GnssFix> fixes_of(const std::vector<GnssRecord>& records) {
  std::vector<GnssFix> fixes;
  for (const GnssRecord& r : records) {
    const Matrix3d C = C_n_e(r.lat_rad, r.lon_rad);
    GnssFix f;
    f.t_s = r.t_s;
    f.p_ea_e = ecef_from_geodetic({r.lat_rad, r.lon_rad, r.height_m});
    f.R_p_e = C * r.P_n_m2 * C.transpose();
    f.has_velocity = r.has_velocity;
    f.v_ea_e = C * r.v_n_mps;
    f.R_v_e = C * r.std_v_n_mps.cwiseAbs2().asDiagonal() * C.transpose();
    fixes.push_back(f);
  }
  return fixes;
}

Vector3d true_rpy(const SimulatedFlight& s, double t) {
  const SE23<double> X = truth_at(s.truth, t);
  return rpy_from_C_b_n(C_n_e(X.p).transpose() * X.C);
}

TEST(Coarse, finds_any_heading_of_the_circle) {
  for (int i = 0; i < 8; ++i) {
    const SimulatedFlight s = table_1_flight(45.0 * i + 3.0, static_cast<std::uint64_t>(i + 1));
    const PreparedFlight p = prepare_flight(s.flight);
    SCOPED_TRACE(45.0 * i + 3.0);
    ASSERT_FALSE(p.coarse.modes.empty());
    const CoarseMode& m = p.coarse.modes.front();
    const double off = wrap_pi(m.heading_rad - true_heading(s, p.problem.t_start_s));
    EXPECT_LT(std::abs(off), 3.0 * m.heading_std_rad);
    EXPECT_LT(std::abs(off), 5.0 * kDeg);
    EXPECT_LT(m.heading_std_rad, 5.0 * kDeg);
    EXPECT_GT(m.weight, 0.9);
    EXPECT_EQ(m.latency_s, 0.0);
  }
}

TEST(Coarse, finds_the_latency_with_its_sign) {
  for (const double latency : {-0.3, 0.0, 0.3}) {
    for (const double heading : {20.0, 200.0}) {
      const SimulatedFlight s = flight_with(latency, heading, 5);
      const PreparedFlight p = prepare_flight(s.flight);
      ASSERT_FALSE(p.coarse.modes.empty());
      const CoarseMode& m = p.coarse.modes.front();
      const double off = wrap_pi(m.heading_rad - true_heading(s, p.problem.t_start_s));
      EXPECT_NEAR(p.latency_s, latency, 0.05);
      EXPECT_EQ(m.latency_s, 0.0);  // what is left of it
      EXPECT_LT(std::abs(off), 5.0 * kDeg);
    }
  }
}

TEST(Coarse, levels_a_start_in_motion) {
  for (const double begin : {1020.0, 1035.0, 1050.0}) {
    for (std::uint64_t seed : {1U, 2U}) {
      const SimulatedFlight s = between(table_1_flight(70.0 * static_cast<double>(seed), seed), begin, 1105.0);
      const PreparedFlight p = prepare_flight(s.flight);
      ASSERT_EQ(p.start, "moving");
      const Vector3d truth = true_rpy(s, p.problem.t_start_s);
      const double roll = wrap_pi(p.coarse.roll_rad - truth[0]), pitch = p.coarse.pitch_rad - truth[1];
      EXPECT_LT(std::hypot(roll, pitch), p.coarse.tilt_std_rad);
    }
  }
}

TEST(Coarse, is_not_sure_of_a_heading_where_nothing_moves) {
  // Noise of fixes looks like acceleration: a window of a minute does not take it for better than some 15 degrees.
  for (const FlightKind kind : {FlightKind::parked, FlightKind::hover}) {
    for (std::uint64_t seed : {1U, 2U, 3U}) {
      DroneFlight drone = random_flight(kind, false, seed);
      drone.rate_hz = 50;
      drone.oversample = 1;
      drone.duration_s = 110;
      const SimulatedFlight s = simulate_flight(drone, {}, unknown_latency(), seed);
      const CoarseAlignment c = coarse_alignment(s.flight.imu, fixes_of(s.flight.gnss), Vector3d::Zero(),
                                                 drone.start_time_s + 2.0, drone.start_time_s + 108.0);
      for (const CoarseMode& m : c.modes) EXPECT_GT(m.heading_std_rad, 9 * kDeg) << flight_kind_name(kind) << seed;
    }
  }
}

// Without noise or biases, fixes at 5 Hz.
struct Perfect {
  Truth truth;
  std::vector<GnssFix> fixes;
};

Perfect perfect_flight(bool velocity, double latency_s) {
  Perfect p;
  p.truth = drone_truth(testing::short_flight(), Mechanization::exact, GravityModel::normal);
  GnssErrors gnss;
  gnss.std_ned_m.setZero();
  gnss.velocity_std_ned.setZero();
  gnss.l_ba_b = kLever;
  gnss.rate_hz = 5.0;
  gnss.velocity = velocity;
  gnss.latency_s = latency_s;
  p.fixes = fixes_of(simulate_gnss(p.truth, gnss, 1));
  for (GnssFix& f : p.fixes) {  // velocities are used where they are the less noisy
    f.R_p_e = 1e-4 * Matrix3d::Identity();
    f.R_v_e = 1e-4 * Matrix3d::Identity();
  }
  return p;
}

// The largest |beta - R alpha|, m/s^2, every 5 s with R of their middle: L stands still against the stars.
double largest_difference(const Perfect& p, double latency_s) {
  constexpr double kRef = 1010.0, kEnd = 1100.0, kPart_s = 5.0;
  const ForceVectors vectors(p.truth.imu, p.fixes, kLever, kRef, kEnd, Vector3d::Zero());
  const SE23<double> X = truth_at(p.truth, kRef);
  const Matrix3d C = C_n_e(X.p);
  const Vector3d turn_n = C.transpose() * wgs84::omega_ie_e<double>();
  double largest = 0.0;
  for (double begin = kRef; begin < kEnd; begin += kPart_s) {
    const Matrix3d R = X.C.transpose() * C * gamma<0>(Vector3d((begin + 0.5 * kPart_s - kRef) * turn_n));
    const std::vector<ForcePair> pairs = vectors.pairs(begin, begin + kPart_s, latency_s);
    EXPECT_GE(pairs.size(), 4u);
    for (const ForcePair& pair : pairs) largest = std::max(largest, (pair.beta - R * pair.alpha).norm());
  }
  return largest;
}

TEST(ForceVectors, of_fixes_and_accelerometers_are_the_same_but_for_the_rotation) {
  for (const double latency : {-0.2, 0.0, 0.3}) {
    const Perfect positions = perfect_flight(false, latency), velocities = perfect_flight(true, latency);
    // Coriolis' 0.001 and what the Earth turns in half a part, 0.002
    EXPECT_LT(largest_difference(positions, latency), 0.004);
    // The lever arm moves with the mean rate of a sample, 10 ms old: 0.3 m times 6 rad/s^2 of wobble
    EXPECT_LT(largest_difference(velocities, latency), 0.03);
    for (const Perfect& p : {positions, velocities}) EXPECT_GT(largest_difference(p, latency + 0.1), 0.2);
  }
}

}  // namespace
}  // namespace liealign
