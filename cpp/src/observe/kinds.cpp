// The list of the kinds of observations: one line each.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/observe/kinds.hpp"

#include "liealign/observe/barometer.hpp"
#include "liealign/observe/external_heading.hpp"
#include "liealign/observe/gnss_position.hpp"
#include "liealign/observe/gnss_velocity.hpp"
#include "liealign/observe/zero_rate.hpp"
#include "liealign/observe/zero_velocity.hpp"

namespace liealign {

const ObservationKind kGnssPosition = kind_of<GnssPosition>();
const ObservationKind kGnssVelocity = kind_of<GnssVelocity>();
const ObservationKind kZeroVelocity = kind_of<ZeroVelocity>();
const ObservationKind kZeroRate = kind_of<ZeroRate>();
const ObservationKind kExternalHeading = kind_of<ExternalHeading>();
const ObservationKind kBarometer = kind_of<Barometer>();

const std::array<const ObservationKind*, 6>& observation_kinds() {
  static const std::array<const ObservationKind*, 6> all = {&kGnssPosition, &kGnssVelocity,    &kZeroVelocity,
                                                            &kZeroRate,     &kExternalHeading, &kBarometer};
  return all;
}

}  // namespace liealign
