// The clock over more of a flight than its heading needs.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "flights.hpp"
#include "liealign/pipeline/clock.hpp"

namespace liealign {
namespace {

using testing::align;

constexpr double kLatency_s = 0.12;

// Five minutes, of which the alignment takes one; the receiver's stamps drift away besides.
SimulatedFlight drifting_flight(double drift, std::uint64_t seed, const Config& config) {
  DroneFlight drone = testing::short_flight();
  drone.duration_s = 330;
  drone.oversample = 4;
  drone.heading_deg = 70.0 * static_cast<double>(seed);
  drone.seed = seed;
  GnssErrors gnss;
  gnss.rate_hz = 2;
  gnss.latency_s = kLatency_s;
  gnss.l_ba_b = Vector3d(0.1, -0.05, -0.3);
  SimulatedFlight s = simulate_flight(drone, gnss, config, seed);
  const double start_s = s.flight.imu.front().t_s;
  for (GnssRecord& record : s.flight.gnss) record.t_s += drift * (record.t_s - start_s);
  return s;
}

Config one_minute() {
  Config config;
  config.imu.noise_scale = config.gnss.std_scale = 1.0;
  config.align.max_time_s = 60.0;
  return config;
}

// Latency minus the true one, in the middle of the flight, by which it is known best.
double latency_error(const SimulatedFlight& s, const PreparedFlight& prepared, const FlightParameters& p,
                     double drift) {
  const double start_s = s.flight.imu.front().t_s, middle_s = s.flight.imu.back().t_s - start_s;
  const double found =
      prepared.latency_s + p.latency_s + p.clock_drift * (start_s + 0.5 * middle_s - prepared.problem.t_start_s);
  return found - kLatency_s - drift * 0.5 * middle_s;
}

TEST(Clock, latency_and_drift_come_from_the_whole_flight) {
  for (const double drift : {0.0, 40e-6}) {
    double squares = 0.0, squares_before = 0.0;
    constexpr std::uint64_t kFlights = 4;
    for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
      const SimulatedFlight s = drifting_flight(drift, seed, one_minute());
      const PreparedFlight prepared = prepare_flight(s.flight);
      const HeadingResult before = align(prepared), after = with_clock_of_flight(prepared, before);
      const FlightParametersStd& std = after.parameters_std;
      ASSERT_TRUE(std.latency_s && std.clock_drift);
      EXPECT_LT(*std.clock_drift, 5e-6);
      if (drift == 0.0) {
        EXPECT_EQ(after.parameters.clock_drift, 0.0) << "seed " << seed;
        EXPECT_LT(*std.latency_s, 0.6 * *before.parameters_std.latency_s);
        EXPECT_LT(std::abs(latency_error(s, prepared, after.parameters, drift)), 3.5 * *std.latency_s);
      } else {
        EXPECT_LT(std::abs(after.parameters.clock_drift - drift), 3.5 * *std.clock_drift) << "seed " << seed;
      }
      squares += std::pow(latency_error(s, prepared, after.parameters, drift), 2);
      squares_before += std::pow(latency_error(s, prepared, before.parameters, drift), 2);
      EXPECT_EQ(after.heading_rad, before.heading_rad);
      EXPECT_GT(after.evaluations, before.evaluations);
    }
    EXPECT_LT(std::sqrt(squares / kFlights), 0.5e-3);
    EXPECT_LT(squares, 0.5 * squares_before);
  }
}

TEST(Clock, stays_where_it_is_given_or_the_alignment_has_seen_the_flight) {
  Config given = one_minute(), whole = one_minute();
  given.gnss.latency_s = kLatency_s;
  whole.align.max_time_s = 300.0;
  for (const Config& config : {given, whole}) {
    const PreparedFlight prepared = prepare_flight(drifting_flight(0.0, 1, config).flight);
    const HeadingResult before = align(prepared);
    EXPECT_EQ(with_clock_of_flight(prepared, before).parameters, before.parameters);
    EXPECT_EQ(with_clock_of_flight(prepared, before).evaluations, before.evaluations);
  }
}

// Carried on to the changed times, intervals score what intervals cut there score.
TEST(Clock, a_small_change_scores_as_if_cut_anew) {
  const PreparedFlight prepared = prepare_flight(drifting_flight(0.0, 2, one_minute()).flight);
  const HeadingResult r = align(prepared);
  HeadingCandidate candidate;
  candidate.heading_rad = r.heading_rad;
  candidate.parameters = r.parameters;
  candidate.parameters.gnss_std_scale = 1.1;
  candidate.parameters.imu_noise_scale = 1.3;
  const std::vector<ClockChange> changes = {{0, 0}, {1e-3, 0}, {-4e-3, 0}, {0, 3e-5}, {2e-3, -5e-5}};
  std::vector<HeadingCandidate> cut_anew(changes.size(), candidate);
  for (std::size_t i = 0; i < changes.size(); ++i) {
    cut_anew[i].parameters.latency_s += changes[i].latency_s;
    cut_anew[i].parameters.clock_drift += changes[i].drift;
  }
  const IntervalSeries intervals = intervals_for(prepared.problem, candidate.parameters);
  const std::vector<CandidateScore> carried = evaluate_clocks(prepared.problem, intervals, candidate, changes);
  const std::vector<CandidateScore> cut = evaluate_candidates(prepared.problem, cut_anew);
  EXPECT_NEAR(carried[0].cost, cut[0].cost, 1e-6);
  for (std::size_t i = 1; i < changes.size(); ++i) {
    EXPECT_GT(std::abs(cut[i].cost - cut[0].cost), 0.5) << i;
    EXPECT_NEAR(carried[i].cost - carried[0].cost, cut[i].cost - cut[0].cost,
                0.02 * std::abs(cut[i].cost - cut[0].cost))
        << i;
  }
}

}  // namespace
}  // namespace liealign
