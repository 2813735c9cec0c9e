// Laws of the candidate bank: over preintegrated intervals it finds what it finds sample by sample.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <ostream>

#include "flights.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

using namespace testing;

struct Place {
  double lat_deg, speed_mps, rate_hz;  // of the pad, of the flight, of the fixes
};

// So that gtest prints the place instead of its bytes.
void PrintTo(const Place& place, std::ostream* out) {
  *out << place.lat_deg << " deg, " << place.speed_mps << " m/s, " << place.rate_hz << " Hz";
}

PreparedFlight prepared_at(const Place& place) {
  DroneFlight drone;
  drone.rate_hz = 100.0;
  drone.oversample = 4;
  drone.duration_s = 180.0;
  drone.parked_before_s = 15.0;
  drone.parked_after_s = 5.0;
  drone.lat_deg = place.lat_deg;
  drone.speed_mps = place.speed_mps;
  drone.line_length_m = 20.0 * place.speed_mps;
  drone.drag_per_s = 0.05;
  drone.max_tilt_deg = 45.0;
  GnssErrors gnss;
  gnss.l_ba_b = Vector3d(0.1, -0.05, -0.3);
  gnss.rate_hz = place.rate_hz;
  gnss.velocity = place.rate_hz > 1.0;
  Config config;
  config.align.heading_guess_deg = drone.heading_deg + 5.0;
  return prepare_flight(simulate_flight(drone, gnss, testing::with_given_parameters(config), 7).flight);
}

class Bank : public ::testing::TestWithParam<Place> {};

TEST_P(Bank, over_intervals_gives_the_heading_the_sigma_and_the_curve_of_the_samples) {
  const PreparedFlight by_intervals = prepared_at(GetParam());
  ASSERT_FALSE(by_intervals.problem.intervals.intervals.empty());
  PreparedFlight by_samples = by_intervals;
  by_samples.problem.intervals = {};
  const HeadingResult at_once = align(by_intervals), one_by_one = align(by_samples);
  ASSERT_TRUE(at_once.sigma_rad && one_by_one.sigma_rad);
  EXPECT_NEAR(at_once.heading_rad * kRadToDeg, one_by_one.heading_rad * kRadToDeg, 0.002);
  EXPECT_NEAR(*at_once.sigma_rad / *one_by_one.sigma_rad, 1.0, 0.02);

  std::vector<HeadingCandidate> curve;
  for (const double sigmas : {0.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0})
    curve.push_back({one_by_one.heading_rad + sigmas * *one_by_one.sigma_rad, 0.0, true, one_by_one.gate_scales});
  const std::vector<CandidateScore> a = evaluate_candidates(by_intervals.problem, curve),
                                    b = evaluate_candidates(by_samples.problem, curve);
  for (std::size_t i = 1; i < curve.size(); ++i) EXPECT_NEAR(a[i].cost - a[0].cost, b[i].cost - b[0].cost, 0.1) << i;
}

INSTANTIATE_TEST_SUITE_P(Flights, Bank,
                         ::testing::Values(Place{48.2, 6.0, 1.0}, Place{78.0, 15.0, 1.0}, Place{-30.0, 25.0, 10.0}));

// Four go through the filter at once: to each the others must be as if they were not there, down to the bits.
TEST(BankLanes, a_candidate_scores_the_same_whoever_goes_beside_it) {
  const PreparedFlight flight = prepared_at({48.2, 6.0, 10.0});
  std::vector<HeadingCandidate> all;
  for (int i = 0; i < 7; ++i) all.push_back({0.9 * i, i % 2 == 0 ? 0.0 : 0.2, false, {}});
  all[2].heading_rad = std::numeric_limits<double>::quiet_NaN();  // its filter fails
  all[4].gated = true;
  all[5].parameters.gnss_std_scale = 2.0;
  const std::vector<CandidateScore> together = evaluate_candidates(flight.problem, all);
  ASSERT_EQ(together.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const CandidateScore alone = evaluate_candidates(flight.problem, {all[i]}).front();
    EXPECT_EQ(together[i].cost, alone.cost) << i;
    EXPECT_EQ(together[i].nis_90, alone.nis_90) << i;
    EXPECT_EQ(together[i].fixes, alone.fixes) << i;
    EXPECT_EQ(std::isfinite(together[i].cost), i != 2) << i;
  }
}

}  // namespace
}  // namespace liealign
