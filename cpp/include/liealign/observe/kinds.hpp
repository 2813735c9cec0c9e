// The list of the kinds of observations.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "liealign/observe/observation.hpp"

namespace liealign {

extern const ObservationKind kGnssPosition, kGnssVelocity, kZeroVelocity, kZeroRate, kExternalHeading, kBarometer;

// All of them, for whoever goes through the list: tests, records, files.
const std::array<const ObservationKind*, 6>& observation_kinds();

}  // namespace liealign
