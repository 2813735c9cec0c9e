// The smoother over intervals with a short tail.
// SPDX-License-Identifier: Apache-2.0
#include "interval_smoother_impl.hpp"

namespace liealign {

template ForwardRun<kShortTail> run_forward(const FlightData&, const FilterOptions&,
                                            const Belief<LieModel<double, kShortTail>>&, const ImuCursor&,
                                            const FilterSink&);
template void smooth_run(const FlightData&, const FilterOptions&, const ForwardRun<kShortTail>&, const SmootherSink&,
                         const Progress&);
template Belief<LieModel<double, kShortTail>> smoothed_at_start(const FlightData&, const FilterOptions&,
                                                                const ForwardRun<kShortTail>&);

}  // namespace liealign
