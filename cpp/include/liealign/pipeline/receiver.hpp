// The receiver's own errors in the final run: which model, its observations, and what is asked of fit_receiver().
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/align/receiver_fit.hpp"
#include "liealign/pipeline/flight.hpp"

namespace liealign {

// Whether the final run models them: gnss.error_model, and "auto" where the filter can.
bool models_receiver(const Config& config);

// The observations of the final run by their stamps (less clock drift), and the problem of fit_receiver(). The fixes of the rest
// that the run starts from are among them.
ReceiverProblem receiver_problem(const PreparedFlight& flight, const HeadingResult& heading,
                                 const FilterOptions& filter, const Belief<LieModel<double>>& start,
                                 const ImuCursor& cursor);

// External headings and barometer heights, at the times that this latency gives the first.
void add_other_observations(const PreparedFlight& flight, double latency_s, std::vector<Observation>& to);

}  // namespace liealign
