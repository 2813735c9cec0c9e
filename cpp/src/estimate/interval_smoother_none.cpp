// The smoother over intervals with no tail.
// SPDX-License-Identifier: Apache-2.0
#include "interval_smoother_impl.hpp"

namespace liealign {

template ForwardRun<kNoTail> run_forward(const FlightData&, const FilterOptions&,
                                         const Belief<LieModel<double, kNoTail>>&, const ImuCursor&, const FilterSink&);
template void smooth_run(const FlightData&, const FilterOptions&, const ForwardRun<kNoTail>&, const SmootherSink&,
                         const Progress&);
template Belief<LieModel<double, kNoTail>> smoothed_at_start(const FlightData&, const FilterOptions&,
                                                             const ForwardRun<kNoTail>&);

}  // namespace liealign
