// Prediction and update of the Lie filter.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/filter_steps.hpp"

namespace liealign {

LIEALIGN_FILTER_STEPS(, LieModel<double, kNoTail>)
LIEALIGN_FILTER_STEPS(, LieModel<double, kShortTail>)
LIEALIGN_FILTER_STEPS(, LieModel<double, kLongTail>)
template NavTransition<double> Ekf<LieModel<double>>::predict(Belief<LieModel<double>>&, const ImuSample&,
                                                              double) const;

}  // namespace liealign
