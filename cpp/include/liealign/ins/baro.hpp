// Heights of a barometer: rows as a file gives them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace liealign {

struct BaroRecord {
  double t_s = 0.0;
  double height_m = 0.0;
  double std_m = 0.0;
  bool has_std = false;
  std::size_t line = 0;
};

}  // namespace liealign
