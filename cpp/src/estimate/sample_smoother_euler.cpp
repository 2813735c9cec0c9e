// Filter and smoother of Euler angles, sample by sample.
// SPDX-License-Identifier: Apache-2.0
#include "sample_smoother_impl.hpp"

namespace liealign {

template std::vector<Checkpoint<EulerModel>> filter_samples(const FlightData&, const FilterOptions&,
                                                            const Belief<EulerModel>&, const ImuCursor&,
                                                            const SampleFilterSink<EulerModel>&);
template void smooth_samples(const FlightData&, const FilterOptions&, const std::vector<Checkpoint<EulerModel>>&,
                             const SampleSmootherSink<EulerModel>&, const Progress&);

}  // namespace liealign
