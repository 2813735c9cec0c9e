// Filter and smoother of MEKF, sample by sample.
// SPDX-License-Identifier: Apache-2.0
#include "sample_smoother_impl.hpp"

namespace liealign {

template std::vector<Checkpoint<MekfModel>> filter_samples(const FlightData&, const FilterOptions&,
                                                           const Belief<MekfModel>&, const ImuCursor&,
                                                           const SampleFilterSink<MekfModel>&);
template void smooth_samples(const FlightData&, const FilterOptions&, const std::vector<Checkpoint<MekfModel>>&,
                             const SampleSmootherSink<MekfModel>&, const Progress&);

}  // namespace liealign
