// Facts that a GNSS log shows of its receiver: whether stamps are arrival times, the steps that its columns are rounded
// to, whether its standard deviations are made up, and the class of a fix.
//
// Stamps. A receiver measures at t_i = t_0 + c_i h with whole c_i; a logger that stamps the arrival writes
//   s_i = t_i + delay + e_i,   c_i = round((s_i - p_i) / h),
// h the interval, p_i the running median of s_j - c_j h, e_i the jitter. The two clocks drift against each other, so the
// grid is a line over 41 fixes about each one, fitted twice, the second time without those beyond 2.5 medians of abs(e):
//   (a_i, h_i) = argmin sum_j (s_j - a - (c_j - c_i) h)^2,   t_i = a_i + mean(s - a).
// A delay that is always there is left in it: it belongs to the latency.
//
// Steps. Values rounded to a step q have differences d = k q with whole k, between neighbours and over lags, so that
//   R(q) = mean cos(2 pi d / q)
// over the differences from q/2 to 30 q is near 1; for values that are not rounded it is near 0. The step is the largest q
// with R above 0.98. Rounding to q adds the variance q^2 / 12 (Widrow & Kollar, Quantization Noise, 2008).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/core/types.hpp"
#include "liealign/ins/gnss.hpp"

namespace liealign {

struct StampGrid {
  std::vector<double> t_s;  // per record: the stamp put back on the grid; the stamp itself where that is not warranted
  double interval_s = 0.0;  // of the grid, on the clock of the stamps; 0 where there is none
  double jitter_s = 0.0;    // robust rms of stamp minus grid (80 % point of abs / 1.2816); 0 without a grid
  bool arrival = false;     // the stamps are arrival times of measurements on a uniform grid
};

// Arrival stamps are those that jitter by more than twice what the rounding of the stamps makes, by less than a third of
// the interval, and where at most one in twenty is a third of it away from its epoch. Missed epochs are counted and change
// nothing. Two records for one epoch, stamps at random or a log of fewer than 41 records have no grid.
StampGrid stamp_grid(const std::vector<GnssRecord>& records);

// How stamps that were put back on the grid wander, as a random walk [s/sqrt(s)]: a line over n fixes is off by jitter / sqrt(n),
// two lines that share n - k of them differ by the square root of 2 k / n times that, and by half as much variance again because
// the fixes that are left out as too far change from line to line:
//   q^2 = 3 jitter^2 / (n^2 h).
// 0 where they are as they were.
double stamp_walk(const StampGrid& grid);

// Steps of the columns; 0 where none is seen. The step of latitude is given along north and so on.
struct QuantisationSteps {
  Vector3d position_n_m = Vector3d::Zero();    // NED
  Vector3d velocity_n_mps = Vector3d::Zero();  // NED
};

// Rows without a position, such as those before the first fix, do not count.
QuantisationSteps quantisation_steps(const std::vector<GnssRecord>& records);

// Whether all rows with a position state the same standard deviations: then somebody made them up, or the receiver has
// reached the smallest that it states.
bool stated_std_is_constant(const std::vector<GnssRecord>& records);

// What a fix rests on: carrier phases with whole ambiguities, something between, code alone.
enum class FixClass { fixed, other, single };

// By the fix column (RTKLIB's Q): 1 fixed, 5 single, all else other. Without it, and where it says fixed beside a
// metre, by the stated horizontal standard deviation sqrt((P_NN + P_EE) / 2): below 0.1 m fixed, below 1 m other, else
// single.
FixClass fix_class(const GnssRecord& record);

}  // namespace liealign
