// Parts in batches of one slot each.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/parts.hpp"

#include <algorithm>
#include <exception>
#include <vector>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace liealign {

std::size_t part_slots() {
#ifdef _OPENMP
  const int threads = omp_get_max_threads();
#else
  const int threads = 1;
#endif
  constexpr std::size_t kPartsPerThread = 4;  // so that a slow one does not keep the others waiting
  return kPartsPerThread * static_cast<std::size_t>(threads);
}

void in_order(std::size_t parts, const PartWork& make, const PartWork& take) {
  const std::size_t slots = part_slots();
  std::vector<std::exception_ptr> failures(slots);
  for (std::size_t first = 0; first < parts; first += slots) {
    const auto n = static_cast<std::ptrdiff_t>(std::min(slots, parts - first));
#pragma omp parallel for schedule(dynamic, 1)
    for (std::ptrdiff_t i = 0; i < n; ++i) {
      const auto slot = static_cast<std::size_t>(i);
      try {
        make(first + slot, slot);
      } catch (...) {
        failures[slot] = std::current_exception();  // none may leave a parallel region
      }
    }
    for (std::size_t slot = 0; slot < static_cast<std::size_t>(n); ++slot) {
      if (failures[slot]) std::rethrow_exception(failures[slot]);
      take(first + slot, slot);
    }
  }
}

}  // namespace liealign
