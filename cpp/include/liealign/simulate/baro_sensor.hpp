// A barometer along a truth: heights with white noise and an offset that wanders.
//
//   y = h + b + eps,   b a Gauss-Markov process (Eq. 71)                                            (Eq. 76)
//
// h is the ellipsoidal height of the IMU. The offset has the weather, the reference pressure and the draught of the body in
// it. Source: Groves (2013) 6.2.1.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "liealign/ins/baro.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {

struct BaroErrors {
  double std_m = 0.2;  // white, and what the records state
  double rate_hz = 10.0;
  double bias_sigma_m = 1.0;  // stationary
  double bias_correlation_time_s = 600.0;
};

// At the multiples of 1 / rate_hz inside the truth. Throws Error for a truth without two epochs, a negative sigma, or a
// rate or correlation time that is not positive.
std::vector<BaroRecord> simulate_baro(const Truth& truth, const BaroErrors& errors, std::uint64_t seed);

}  // namespace liealign
