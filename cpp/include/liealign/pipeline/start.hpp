// Where a run starts: from a rest, or in motion.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "liealign/align/coarse.hpp"
#include "liealign/align/rest.hpp"
#include "liealign/align/start_values.hpp"
#include "liealign/pipeline/config.hpp"

namespace liealign {

struct Start {
  bool moving = false;
  RestPeriod rest;     // of a start at rest
  double t_s = 0.0;    // the last instant of rest, or the first fix in motion
  std::string reason;  // one sentence
};

// align.start: "static" wants a rest with fixes, "moving" takes the first fix, "auto" the rest unless the vehicle has moved
// before it. Throws InputError when "static" finds no rest.
Start choose_start(const Config& config, const FlightData& data, const std::vector<RestPeriod>& rests);

// What the first fixes from t_s on and the coarse stage say of a start in motion.
MotionStatistics motion_statistics(const std::vector<GnssFix>& fixes, double t_s, const CoarseAlignment& coarse);

}  // namespace liealign
