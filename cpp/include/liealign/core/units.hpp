// Unit factors for the door (io/, pipeline/config): inside the engine everything is SI and radians.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

namespace liealign {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kDegToRad = kPi / 180.0;
inline constexpr double kRadToDeg = 180.0 / kPi;
inline constexpr double kSecondsPerHour = 3600.0;
inline constexpr double kDegPerHourToRadPerSecond = kDegToRad / kSecondsPerHour;
inline constexpr double kDegPerSqrtHourToRadPerSqrtSecond = kDegToRad / 60.0;  // sqrt(3600 s) = 60
inline constexpr double kMpsPerSqrtHourToMpsPerSqrtSecond = 1.0 / 60.0;
inline constexpr double kStandardGravity = 9.80665;  // m/s^2, CGPM 1901 (unit of accelerometer biases only)
inline constexpr double kMicroGToMps2 = 1e-6 * kStandardGravity;
inline constexpr double kMilliGToMps2 = 1e-3 * kStandardGravity;

}  // namespace liealign
