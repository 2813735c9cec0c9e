// The smoother over intervals with a long tail.
// SPDX-License-Identifier: Apache-2.0
#include "interval_smoother_impl.hpp"

namespace liealign {

template ForwardRun<kLongTail> run_forward(const FlightData&, const FilterOptions&,
                                           const Belief<LieModel<double, kLongTail>>&, const ImuCursor&,
                                           const FilterSink&);
template void smooth_run(const FlightData&, const FilterOptions&, const ForwardRun<kLongTail>&, const SmootherSink&,
                         const Progress&);
template Belief<LieModel<double, kLongTail>> smoothed_at_start(const FlightData&, const FilterOptions&,
                                                               const ForwardRun<kLongTail>&);

}  // namespace liealign
