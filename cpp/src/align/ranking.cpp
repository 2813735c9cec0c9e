// Filters of one flight ranked by the rms of their innovations.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/ranking.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "liealign/core/error.hpp"

namespace liealign {

std::vector<RankedFilter> rank_by_p_rms(const std::vector<std::vector<FixInnovation>>& filters,
                                        std::size_t first_record, std::size_t last_record) {
  const auto inside = [&](const FixInnovation& fix) { return fix.record >= first_record && fix.record <= last_record; };
  std::map<std::size_t, std::size_t> seen;  // how many filters have seen a record
  std::size_t working = 0;
  for (const std::vector<FixInnovation>& fixes : filters) {
    if (!fixes.empty()) ++working;
    for (const FixInnovation& fix : fixes) {
      if (inside(fix)) ++seen[fix.record];
    }
  }
  std::vector<RankedFilter> ranked;
  for (std::size_t i = 0; i < filters.size(); ++i) {
    double squares = 0.0;
    std::size_t n = 0;
    for (const FixInnovation& fix : filters[i]) {
      if (!inside(fix) || seen[fix.record] < working) continue;
      squares += fix.norm_m * fix.norm_m;
      ++n;
    }
    if (n == 0 && !filters[i].empty()) throw Error("ranking: no fix in the span was seen by every filter; widen it");
    const double mean = squares / static_cast<double>(n);
    ranked.push_back({i, n > 0 ? std::sqrt(mean) : std::numeric_limits<double>::infinity(), n});
  }
  const auto better = [](const RankedFilter& a, const RankedFilter& b) { return a.p_rms_m < b.p_rms_m; };
  std::stable_sort(ranked.begin(), ranked.end(), better);
  return ranked;
}

}  // namespace liealign
