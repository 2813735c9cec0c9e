// Barometer data: rows of baro.csv as the file gives them, heights above a level of the barometer's own.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace liealign {

// One row of baro.csv, in SI.
struct BaroRecord {
  double t_s = 0.0;
  double height_m = 0.0;
  double std_m = 0.0;
  bool has_std = false;
  std::size_t line = 0;
};

}  // namespace liealign
