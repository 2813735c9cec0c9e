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

// Sizes of the IMU errors of a simulated flight; TAES table I. Those above the noise scale are of each axis, drawn by the
// seed: from N(0, size^2), or, "fixed", of just that size with a sign by the seed, as the papers have them.
struct ImuErrorSizes {
  double gyro_turn_on_deg_h = 10.0;
  double accel_turn_on_ug = 500.0;
  double gyro_scale_ppm = 0.0;  // (Eq. 75)
  double accel_scale_ppm = 0.0;
  double gyro_misalignment_deg = 0.0;
  double accel_misalignment_deg = 0.0;
  std::string turn_on = "drawn";  // drawn | fixed
  double noise_scale = 1.0;       // of the white noise and the drift of the profile; the config says nothing of it
  // Of the body's axes, as they stand in the samples from the first motion to the last.
  Vector3d gyro_vibration_deg_s = Vector3d::Zero();
  Vector3d accel_vibration_mps2 = Vector3d::Zero();
  double vibration_correlation_time_s = 0.01;
};

// The errors of the IMU that `config` names, with Ornstein-Uhlenbeck biases; what is drawn by the seed. Throws Error for a
// size that is negative, or another word than those of turn_on.
ImuErrors imu_errors(const Config& config, const ImuErrorSizes& sizes, std::uint64_t seed);

// By how much what is typed into the config is off: one sigma each.
struct TypedInErrors {
  double lever_arm_std_m = 0.0;  // of each axis
  double latency_std_s = 0.0;    // 0: the config says of the latency what it said before
};

// Lever arm and, with a latency_std_s, latency of the config: those of `gnss` and a draw about them, by the seed. Throws
// Error for a negative sigma.
void type_in(Config& config, const GnssErrors& gnss, const TypedInErrors& errors, std::uint64_t seed);

struct SimulatedFlight {
  Flight flight;  // its config has the lever arm and the IMU profile; file names stay empty
  Truth truth;
  std::vector<Vector3d> b_a, b_g;  // true biases at the epochs of the truth: with all that they have drifted
  ImuErrors imu_errors;            // what was drawn
};

// The sensors along a truth: IMU noise of the profile in `config`, Ornstein-Uhlenbeck biases with its instability around
// the turn-on values, GNSS as given. TAES V-B and table I.
SimulatedFlight simulate_flight(Truth truth, const GnssErrors& gnss, const Config& config, std::uint64_t seed,
                                const ImuErrorSizes& imu = {}, const TypedInErrors& typed_in = {});

// The same of a drone flight, and along a track (Eq. 67). Both truths are of the exact mechanization and normal gravity.
SimulatedFlight simulate_flight(const DroneFlight& drone, const GnssErrors& gnss, const Config& config,
                                std::uint64_t seed, const ImuErrorSizes& imu = {}, const TypedInErrors& typed_in = {});
SimulatedFlight simulate_track(const std::vector<TrackPoint>& track, double rate_hz, int oversample,
                               const GnssErrors& gnss, const Config& config, std::uint64_t seed,
                               const ImuErrorSizes& imu = {}, const TypedInErrors& typed_in = {});

// Of the same recording, samples, fixes, truth and its biases with stamps from begin_s to end_s. Throws Error when fewer
// than two samples are left.
SimulatedFlight between(SimulatedFlight simulated, double begin_s, double end_s);

// Writes imu.csv, gnss.csv, truth.csv (the columns of trajectory.csv without std) and FLIGHT.toml into the folder.
void write_flight(const std::string& folder, const SimulatedFlight& simulated);

}  // namespace liealign
