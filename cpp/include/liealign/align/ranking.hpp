// Which of several filters F(p_1), F(p_2), ... of one flight predicts the fixes best: their P_RMS over the same fixes.
//
//   P_RMS,i = sqrt( 1/n sum_k |z_k,i|^2 ),  the best is arg min_i                                (Eq. 34)
//
// A fix is known by its row in the GNSS log, for its true time may differ from filter to filter (latency). k runs over the
// rows N_1..N_2 that every filter has seen, n of them. Source: DRONES 2.3.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "liealign/align/candidate.hpp"

namespace liealign {

struct RankedFilter {
  std::size_t filter = 0;  // which one, in the order given
  double p_rms_m = 0.0;    // +infinity when it failed
  std::size_t fixes = 0;   // n; the same for all that did not fail
};

// The filters, the best first; equals in the order given. One without innovations has failed: it comes last and does not
// take part in what all have seen. Throws Error when no fix of first_record..last_record was seen by all others.
std::vector<RankedFilter> rank_by_p_rms(const std::vector<std::vector<FixInnovation>>& filters,
                                        std::size_t first_record = 0,
                                        std::size_t last_record = std::numeric_limits<std::size_t>::max());

}  // namespace liealign
