// How far the curvature of a score can be trusted.
//
// Where the model holds, the gradients g_b of the score over blocks of the log are independent and their squares add up to
// the information. Else
//   cov = H^-1 (sum_b g_b g_b^T) H^-1                                                            (Eq. 63)
// Source: White (1982).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/align/candidate.hpp"
#include "liealign/align/surface_search.hpp"

namespace liealign {

// The ratio of the sigmas of (Eq. 63) to those of H^-1, one per variable; 1 where chance explains it or the log is short.
// `stencil`: the scores of the last round of a SurfaceSearch with these steps.
SurfaceVector block_misfit(const SurfaceMatrix& covariance, const SurfaceVector& steps,
                           const std::vector<CandidateScore>& stencil);

}  // namespace liealign
