// Units and axes: what the log itself says against what was declared. A wrong unit is refused with the key that mends it.
//
// At rest |f| tells m/s^2 from g, and the sign of f_z tells z down from z up. Rates in deg/s taken for rad/s cannot be told
// at rest; where the body turns, the attitude they give takes the specific force away from the vertical:
//   e(s)^2 = mean over 1 s windows of (f_D + g)^2,  f_D the down component of C f
// C begins at the rest and is integrated with the rates s w, slowly levelled by f, over the whole log; the windows are
// those whose rates are large as declared. e is compared between s = 1 and s = pi/180. Flight has f_D = -g on average,
// whatever the vehicle; rates 57 times too large tumble.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "liealign/align/rest.hpp"

namespace liealign {

// Throws InputError `file: ...` naming what is wrong and the key (and flag) that mends it. Returns warnings about what is
// odd but possible. `bias_std_mps2`: of the accelerometers at power-up, four of which are no fault.
std::vector<std::string> check_force_at_rest(const RestStatistics& rest, double bias_std_mps2, const std::string& file);

// True when the motion of `imu` (prepared, body axes) after the rest is explained far better by rates 57.3 times smaller.
bool rates_look_like_degrees(const ImuSeries& imu, const RestStatistics& rest);

}  // namespace liealign
