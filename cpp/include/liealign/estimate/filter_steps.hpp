// The steps of the Lie filter, prediction and update, compiled once each: they take the compiler longer than all that calls
// them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/estimate/forward.hpp"
#include "liealign/estimate/lie_model.hpp"

// The model is what follows the keyword, which is `extern` or nothing. No function instantiates by name.
// NOLINTNEXTLINE(cppcoreguidelines-macro-usage)
#define LIEALIGN_FILTER_STEPS(keyword, ...)                                                                            \
  keyword template Innovation<__VA_ARGS__::Scalar> update(const Observation&, const Ekf<__VA_ARGS__>&,                 \
                                                          const FilterOptions&, const ImuReading&, ObservationMemory&, \
                                                          Belief<__VA_ARGS__>&, NodeChanges<__VA_ARGS__>*);            \
  keyword template IntervalPull<__VA_ARGS__::Scalar> Ekf<__VA_ARGS__>::predict(                                        \
      Belief<__VA_ARGS__>&, const Preintegrated<__VA_ARGS__::Scalar>&, const Vector<__VA_ARGS__::Scalar, 6>&) const;

namespace liealign {

LIEALIGN_FILTER_STEPS(extern, LieModel<double, kNoTail>)
LIEALIGN_FILTER_STEPS(extern, LieModel<double, kShortTail>)
LIEALIGN_FILTER_STEPS(extern, LieModel<double, kLongTail>)
LIEALIGN_FILTER_STEPS(extern, LieModel<Lanes, kNoTail>)
extern template NavTransition<double> Ekf<LieModel<double>>::predict(Belief<LieModel<double>>&, const ImuSample&,
                                                                     double) const;

}  // namespace liealign
