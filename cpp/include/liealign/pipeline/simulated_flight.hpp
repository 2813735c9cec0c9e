// A simulated flight with the sensors of TAES table I, as a Flight and as native files: for the demo and the tests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "liealign/pipeline/flight.hpp"
#include "liealign/simulate/sensors.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {

struct SimulatedFlight {
  Flight flight;  // its config has the lever arm and the IMU profile; file names stay empty
  Truth truth;
};

// IMU noise of the profile in `config`, Ornstein-Uhlenbeck biases with its instability around a turn-on value of 10 deg/h
// and 500 ug on each axis (sign by the seed), GNSS as given. TAES V-B and table I.
SimulatedFlight simulate_flight(const DroneFlight& drone, const GnssErrors& gnss, const Config& config,
                                std::uint64_t seed);

// Writes imu.csv, gnss.csv, truth.csv (the columns of trajectory.csv without std) and FLIGHT.toml into the folder.
void write_flight(const std::string& folder, const SimulatedFlight& simulated);

}  // namespace liealign
