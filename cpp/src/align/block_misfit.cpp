// Sigmas by blocks of the log, (Eq. 63).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/block_misfit.hpp"

#include <cmath>

namespace liealign {

SurfaceVector block_misfit(const SurfaceMatrix& covariance, const SurfaceVector& steps,
                           const std::vector<CandidateScore>& stencil) {
  constexpr double kBlock_s = 10.0, kFewestBlocks = 10.0;
  const Eigen::Index n = steps.size();
  SurfaceVector squares = SurfaceVector::Zero(n);
  double blocks = 0.0;
  const std::vector<ScoreTerm>& terms = stencil.front().terms;
  std::size_t k = 0;
  const auto whole = [&](std::size_t at) { return stencil[at].terms.size() == terms.size(); };
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t plus = SurfaceSearch::axis_index(i, n);
    if (!whole(plus) || !whole(plus + 1)) return SurfaceVector::Ones(n);
  }
  while (k < terms.size()) {
    const double end_s = terms[k].t_s + kBlock_s;
    SurfaceVector g = SurfaceVector::Zero(n);
    for (; k < terms.size() && terms[k].t_s < end_s; ++k) {
      for (Eigen::Index i = 0; i < n; ++i) {
        const std::size_t plus = SurfaceSearch::axis_index(i, n);
        g[i] += (stencil[plus].terms[k].cost - stencil[plus + 1].terms[k].cost) / (2.0 * steps[i]);
      }
    }
    squares += (covariance * g).cwiseAbs2();
    blocks += 1.0;
  }
  SurfaceVector misfit = SurfaceVector::Ones(n);
  for (Eigen::Index i = 0; i < n && blocks >= kFewestBlocks; ++i) {
    const double ratio = squares[i] / covariance(i, i), chance = 1.0 + 2.0 * std::sqrt(2.0 / blocks);
    if (ratio > chance) misfit[i] = std::sqrt(ratio);
  }
  return misfit;
}

}  // namespace liealign
