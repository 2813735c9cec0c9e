// Are the stated sigmas true? Flights whose truth is known, from starts drawn from P_0, through the final run: errors of the
// smoothed trajectory beside what it states of them.
//
//   X_hat = X_true exp(-eps),   eps ~ N(0, P_0),                                                         (Eq. 85)
//   z = error / sigma,   NEES = eps^T P^-1 eps:   rms z = 1 and NEES = its dimension in the mean where a sigma is true.
//
// P_0 is that after a rest of rest_s seconds: the tilt is the one that levelling makes of the accelerometer's bias,
//   phi = -[g]x b_a / |g|^2 + w   (g in the body, w of tilt_std_deg),
// and the gyro's bias is its instability and the mean of its noise over the rest. The start is in motion, so that no update of a
// standing vehicle is in the numbers. Source: Bar-Shalom et al. (2001) 5.4.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "liealign/core/progress.hpp"
#include "liealign/pipeline/process.hpp"
#include "liealign/pipeline/simulated_flight.hpp"

namespace liealign {

struct HonestCase {
  // The profile of the IMU, whose turn-on biases are drawn, and what the run is told. The lever arm is that of gnss.
  Config config;
  GnssErrors gnss;
  std::vector<FlightKind> kinds = {FlightKind::survey, FlightKind::lines, FlightKind::circles, FlightKind::rectangular,
                                   FlightKind::helical};  // flown in turn by the seed
  double rate_hz = 100.0;                                 // of the IMU
  double parked_s = 30.0, flight_s = 275.0;
  double start_after_s = 3.0;         // the run begins so long after the take-off
  double latency_start_std_s = 0.05;  // of what the fit of an automatic latency begins from
  // P_0.
  double rest_s = 30.0;
  double tilt_std_deg = 1.0 / 3.0;
  double heading_std_deg = 2.0;
  double velocity_std_mps = 0.1;
  double settle_s = 20.0;  // errors count so long after the start and later
  double every_s = 10.0;   // and this far apart
};

// relative: in the receiver's own datum. Biases are of the body's axes.
inline constexpr std::array<const char*, 18> kHonestChannels = {"roll_deg",
                                                                "pitch_deg",
                                                                "heading_deg",
                                                                "vn_mps",
                                                                "ve_mps",
                                                                "vd_mps",
                                                                "north_m",
                                                                "east_m",
                                                                "down_m",
                                                                "relative_n_m",
                                                                "relative_e_m",
                                                                "relative_d_m",
                                                                "accel_bias_x_ug",
                                                                "accel_bias_y_ug",
                                                                "accel_bias_z_ug",
                                                                "gyro_bias_x_deg_h",
                                                                "gyro_bias_y_deg_h",
                                                                "gyro_bias_z_deg_h"};
using HonestValues = std::array<double, kHonestChannels.size()>;

// Blocks of the left error whose NEES is taken, three each; of the biases by their variances alone.
inline constexpr std::array<const char*, 6> kHonestBlocks = {"attitude", "velocity",   "position",
                                                             "relative", "accel_bias", "gyro_bias"};

struct HonestEpoch {
  double t_s = 0.0;
  HonestValues error{}, sigma{};
  std::array<double, kHonestBlocks.size()> nees{};
};

struct HonestRun {
  std::uint64_t seed = 0;
  std::string kind;
  std::string failure;  // why there is nothing else; empty for a run that went through
  std::vector<HonestEpoch> epochs;
  bool fitted = false;  // what follows is of the fit
  ReceiverParameters parameters;
  bool settled = false;
  int evaluations = 0;
  // Found minus true, and one sigma; the velocity's are 0 without velocities.
  double latency_error_s = 0.0, latency_std_s = 0.0, velocity_latency_error_s = 0.0, velocity_latency_std_s = 0.0;
  double simulate_s = 0.0, run_s = 0.0;  // time taken
};

// A start of (Eq. 85).
struct HonestStart {
  Belief<LieModel<double>> belief;
  ImuCursor cursor;
};
HonestStart honest_start(const HonestCase& honest, const SimulatedFlight& simulated, const PreparedFlight& flight,
                         double take_off_s, std::uint64_t seed);

// The flight of a seed; take-off parked_s after its first sample.
SimulatedFlight honest_flight(const HonestCase& honest, std::uint64_t seed);

// One flight from (Eq. 85) through run_start() and process(). Throws Error for a field out of range; a filter that fails is a
// failure in the HonestRun.
HonestRun honest_run(const HonestCase& honest, std::uint64_t seed);

// Those of seeds first_seed ... first_seed + count - 1, by threads; the numbers do not depend on how many.
std::vector<HonestRun> honest_runs(const HonestCase& honest, std::uint64_t first_seed, std::size_t count,
                                   const Progress& progress = {});

}  // namespace liealign
