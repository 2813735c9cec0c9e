// Test instruments: simulated flights with the sensors of TAES table I, and the five lines that drive an alignment.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/estimate/output_frame.hpp"
#include "liealign/pipeline/process.hpp"
#include "liealign/pipeline/settings.hpp"
#include "liealign/pipeline/simulated_flight.hpp"
#include "numeric.hpp"

namespace liealign::testing {

inline DroneFlight short_flight() {
  DroneFlight drone;
  drone.rate_hz = 50;
  drone.oversample = 1;  // the samples are the rates the mechanization takes: no sampling error in the comparison
  drone.duration_s = 110;
  drone.parked_before_s = 12;
  drone.parked_after_s = 5;
  return drone;
}

inline HeadingResult align(const PreparedFlight& prepared) {
  HeadingSearch search(heading_search_options(prepared));
  while (!search.done()) search.tell(evaluate_candidates(prepared.problem, search.ask()));
  return search.result();
}

// The same with latency and noise scales as simulated where they are not given: a test of something else shall not search.
inline Config with_given_parameters(Config config) {
  config.gnss.latency_s = config.gnss.latency_s.value_or(0.0);
  config.imu.noise_scale = config.imu.noise_scale.value_or(1.0);
  config.gnss.std_scale = config.gnss.std_scale.value_or(1.0);
  config.gnss.error_model = "white";
  return config;
}

inline SimulatedFlight table_1_flight(double heading_deg, std::uint64_t seed, const Config& config = {},
                                      const GnssErrors& errors = {}) {
  DroneFlight drone = short_flight();
  drone.oversample = 4;
  drone.heading_deg = heading_deg;
  drone.seed = seed;
  GnssErrors gnss = errors;
  gnss.l_ba_b = Vector3d(0.1, -0.05, -0.3);
  ImuErrorSizes imu;
  imu.turn_on = "fixed";  // the table has a size, and no distribution
  return simulate_flight(drone, gnss, with_given_parameters(config), seed, imu);
}

inline double true_heading(const SimulatedFlight& s, double t) {
  return heading_of(NavState<double>{truth_at(s.truth, t), {}});
}

}  // namespace liealign::testing
