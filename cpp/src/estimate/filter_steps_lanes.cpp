// Prediction and update of the Lie filter, several headings at a time.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/filter_steps.hpp"

namespace liealign {

LIEALIGN_FILTER_STEPS(, LieModel<Lanes, kNoTail>)

}  // namespace liealign
