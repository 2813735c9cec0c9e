// WGS 84: defining and derived constants.
// Source: NGA.STND.0036 (2014), tables 3.1, 3.3, 3.6 (ellipsoid, GM, rotation, normal gravity).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/types.hpp"

namespace liealign::wgs84 {

inline constexpr double kA = 6378137.0;  // m, semi-major axis
inline constexpr double kFlattening = 1.0 / 298.257223563;
inline constexpr double kB = kA * (1.0 - kFlattening);            // m, semi-minor axis
inline constexpr double kE2 = kFlattening * (2.0 - kFlattening);  // first eccentricity squared
inline constexpr double kGM = 3.986004418e14;                     // m^3/s^2, with the atmosphere
inline constexpr double kOmegaE = 7.292115e-5;                    // rad/s, Earth rotation rate
inline constexpr double kGravityEquator = 9.7803253359;           // m/s^2, theoretical normal gravity
inline constexpr double kGravityPole = 9.8321849378;              // m/s^2

// omega_ie_e: Earth rotation in ECEF axes. (The papers print its NED form: TAES (16), DRONES (1).)
template <typename Scalar = double>
Vector3<Scalar> omega_ie_e() {
  return Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(kOmegaE));
}

}  // namespace liealign::wgs84
