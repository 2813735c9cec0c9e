// Filter and smoother of the Lie model, sample by sample.
// SPDX-License-Identifier: Apache-2.0
#include "sample_smoother_impl.hpp"

namespace liealign {

template std::vector<Checkpoint<LieModel<double>>> filter_samples(const FlightData&, const FilterOptions&,
                                                                  const Belief<LieModel<double>>&, const ImuCursor&,
                                                                  const SampleFilterSink<LieModel<double>>&);
template void smooth_samples(const FlightData&, const FilterOptions&, const std::vector<Checkpoint<LieModel<double>>>&,
                             const SampleSmootherSink<LieModel<double>>&, const Progress&);

}  // namespace liealign
