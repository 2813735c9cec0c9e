// Progress callback: called from the calling thread only, at most about a hundred times.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace liealign {

// progress(done, total); returning false cancels the work, which then throws Cancelled.
using Progress = std::function<bool(std::size_t done, std::size_t total)>;

}  // namespace liealign
