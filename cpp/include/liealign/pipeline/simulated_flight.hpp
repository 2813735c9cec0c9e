// A simulated flight with the sensors of TAES table I, as a Flight and as native files: for the demo and the tests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "liealign/pipeline/flight.hpp"
#include "liealign/simulate/sensors.hpp"
#include "liealign/simulate/track_reference.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {

// Sizes of the IMU errors of a simulated flight; TAES table I.
struct ImuErrorSizes {
  double gyro_turn_on_deg_h = 10.0;  // on each axis, sign by the seed
  double accel_turn_on_ug = 500.0;   // likewise
  double noise_scale = 1.0;          // of the white noise and the drift of the profile; the config says nothing of it
};

// The errors of the IMU that `config` names, with Ornstein-Uhlenbeck biases; the signs of the turn-on biases by the seed.
ImuErrors imu_errors(const Config& config, const ImuErrorSizes& sizes, std::uint64_t seed);

struct SimulatedFlight {
  Flight flight;  // its config has the lever arm and the IMU profile; file names stay empty
  Truth truth;
};

// The sensors along a truth: IMU noise of the profile in `config`, Ornstein-Uhlenbeck biases with its instability around
// the turn-on values, GNSS as given. TAES V-B and table I.
SimulatedFlight simulate_flight(Truth truth, const GnssErrors& gnss, const Config& config, std::uint64_t seed,
                                const ImuErrorSizes& imu = {});

// The same of a drone flight, and along a track (Eq. 67). Both truths are of the exact mechanization and normal gravity.
SimulatedFlight simulate_flight(const DroneFlight& drone, const GnssErrors& gnss, const Config& config,
                                std::uint64_t seed, const ImuErrorSizes& imu = {});
SimulatedFlight simulate_track(const std::vector<TrackPoint>& track, double rate_hz, int oversample,
                               const GnssErrors& gnss, const Config& config, std::uint64_t seed,
                               const ImuErrorSizes& imu = {});

// Of the same recording, samples, fixes and truth with stamps from begin_s to end_s. Throws Error when fewer than two
// samples are left.
SimulatedFlight between(SimulatedFlight simulated, double begin_s, double end_s);

// Writes imu.csv, gnss.csv, truth.csv (the columns of trajectory.csv without std) and FLIGHT.toml into the folder.
void write_flight(const std::string& folder, const SimulatedFlight& simulated);

}  // namespace liealign
