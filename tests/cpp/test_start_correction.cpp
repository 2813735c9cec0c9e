// A start that the flight itself corrects.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "flights.hpp"
#include "liealign/align/initial.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

using testing::align;
using testing::true_heading;

const Vector3d kLever(0.1, -0.05, -0.3);

NavState<double> state(const Vector3d& rpy, double bias) {
  NavState<double> X;
  SE23<double>& nav = X.first;
  const Vector3d p_ea_e = ecef_from_geodetic({0.8, 0.2, 400.0});
  nav.C = C_n_e(p_ea_e) * C_b_n_from_rpy(rpy);
  nav.p = p_ea_e - nav.C * kLever;
  X.second.x << Vector3d::Constant(bias), Vector3d::Constant(1e-3 * bias);
  return X;
}

TEST(StartCorrection, leads_from_one_start_to_the_other_and_keeps_the_heading) {
  const NavState<double> from = state({0.02, -0.01, 2.0}, 0.0), to = state({-0.03, 0.04, 2.0}, 0.2);
  const StartCorrection correction = correction_between(from, to);
  const NavState<double> there = corrected(from, correction, kLever);
  EXPECT_LT((there.first.C - to.first.C).cwiseAbs().maxCoeff(),
            1e-6);  // north-east-down of the IMU, that of the antenna
  EXPECT_LT((there.first.p - to.first.p).norm(), 1e-6);
  EXPECT_LT((there.second.x - to.second.x).norm(), 1e-15);
  const NavState<double> other = corrected(state({0.02, -0.01, -1.0}, 0.0), correction, kLever);
  EXPECT_NEAR(heading_of(other), -1.0, 1e-6);
  EXPECT_LT((other.first.p - state({-0.03, 0.04, -1.0}, 0.0).first.p).norm(), 1e-6);
}

// Accelerometers so biased that gravity levels the body to a few degrees: beyond the first order of a filter.
SimulatedFlight badly_levelled(double bias_mg, double heading_deg, std::uint64_t seed) {
  DroneFlight drone = testing::short_flight();
  drone.oversample = 4;
  drone.heading_deg = heading_deg;
  drone.seed = seed;
  GnssErrors gnss;
  gnss.l_ba_b = kLever;
  ImuErrorSizes imu;
  imu.accel_turn_on_ug = 1e3 * bias_mg;
  imu.turn_on = "fixed";
  Config config = testing::with_given_parameters({});
  config.imu.accel_bias_turn_on_mg = bias_mg;
  return simulate_flight(drone, gnss, config, seed, imu);
}

TEST(StartCorrection, a_heading_is_found_from_a_start_that_is_level_to_degrees) {
  double most_deg = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const SimulatedFlight s = badly_levelled(50.0, 90.0 * static_cast<double>(seed), seed);
    const PreparedFlight prepared = prepare_flight(s.flight);
    const HeadingResult r = align(prepared);
    const double t = prepared.problem.t_start_s;
    EXPECT_NEAR(wrap_pi(r.heading_rad - true_heading(s, t)) / kDegToRad, 0.0, 0.15) << "seed " << seed;
    // roll and pitch of the corrected start are the true ones
    const StartCorrection& c = r.start;
    const Belief<LieModel<double>> b = start_belief(prepared.problem, prepared.problem.initial, r.heading_rad, 0.1, c);
    const SE23<double>& nav = b.X.first;
    const Vector3d rpy = rpy_from_C_b_n(C_n_e(nav.p).transpose() * nav.C);
    const SE23<double> truth = truth_at(s.truth, t);
    const Vector3d true_rpy = rpy_from_C_b_n(C_n_e(truth.p).transpose() * truth.C);
    EXPECT_NEAR((rpy[0] - true_rpy[0]) / kDegToRad, 0.0, 0.2) << "seed " << seed;
    EXPECT_NEAR((rpy[1] - true_rpy[1]) / kDegToRad, 0.0, 0.2) << "seed " << seed;
    most_deg = std::max(most_deg, std::hypot(c.roll_rad, c.pitch_rad) / kDegToRad);
  }
  EXPECT_GT(most_deg, 1.0);  // there was something to correct
}

TEST(StartCorrection, a_start_that_is_level_stays_as_it_is) {
  const SimulatedFlight s = testing::table_1_flight(137.0, 3);
  EXPECT_EQ(align(prepare_flight(s.flight)).start, StartCorrection{});
}

}  // namespace
}  // namespace liealign
