// What the simulated sensors share: the streams of a seed, and the refusal of values out of range.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "liealign/core/error.hpp"

namespace liealign {

// Streams of one seed; none moves another. Those of the flight are in drone_flight.cpp (from 101), those of the drawn
// sizes in pipeline/simulated_flight.cpp (7 and from 51), those of a study in study_case.cpp (from 201).
enum SensorStream : std::uint64_t {
  kGyroNoise = 1,
  kAccelNoise,
  kGyroBias,
  kAccelBias,
  kFix,
  kFixVelocity,
  kOutlier,
  kFixCorrelated = 11,
  kVelocityCorrelated,
  kStampJitter,
  kArrival,
  kFixHeading,
  kGyroVibration,
  kAccelVibration,
  kBaroNoise,
  kBaroBias
};

[[noreturn]] inline void refuse_value(const std::string& name, double value, const std::string& allowed) {
  throw Error("simulate: " + name + " is " + std::to_string(value) + "; expected " + allowed);
}

inline void require_not_negative(const std::string& name, double value) {
  if (!(value >= 0.0) || !std::isfinite(value)) refuse_value(name, value, "a finite number, 0 or more");
}

inline void require_positive(const std::string& name, double value) {
  if (!(value > 0.0) || !std::isfinite(value)) refuse_value(name, value, "a finite number above 0");
}

}  // namespace liealign
