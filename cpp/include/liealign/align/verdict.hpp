// What a user is told of a heading: the verdict, and which motion would help.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/align/heading_search.hpp"

namespace liealign {

// Sets verdict and advice; takes the sigma away where the data say nothing. `best`: the lowest score of the fit.
void judge(HeadingResult& result, const CandidateScore& best, const HeadingSearchOptions& options);

}  // namespace liealign
