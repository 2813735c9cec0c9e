// The clock of the IMU against that of the fixes, over more of the flight than its heading needs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/pipeline/flight.hpp"

namespace liealign {

// `found` with the latency and the drift of the clock, where they are asked for, from up to half an hour of the flight: in the
// minutes that show the heading they are found to parts of a millisecond, which at 6 m/s is several millimetres, and a drift
// goes on after them. The rest of `found`, noise scales too, stays as it is, as all of it does where the alignment has used
// most of the flight or has not settled.
HeadingResult with_clock_of_flight(const PreparedFlight& flight, HeadingResult found);

}  // namespace liealign
