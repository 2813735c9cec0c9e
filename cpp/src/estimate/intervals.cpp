// Preintegrated pieces of the IMU series.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/intervals.hpp"

#include <algorithm>
#include <cmath>

namespace liealign {
namespace {

constexpr double kLongest_s = 1.0;

Interval interval_over(const ImuSeries& imu, double begin_s, double end_s, const Vector<double, 6>& b_0,
                       const ImuNoise& noise) {
  Interval interval;
  interval.end_s = end_s;
  ImuCursor at = cursor_at(imu, begin_s);
  while (at.k < imu.size() && at.t_s < end_s) {
    const ImuSample& s = imu[at.k];
    const double to = std::min(s.t_s, end_s), dt = to - at.t_s;
    const Vector<double, 6> variance = input_variance(noise, dt, s.gap_s);
    interval.pre.append({s.omega_ib_b - b_0.tail<3>(), s.f_ib_b - b_0.head<3>(), dt}, dt * dt * variance[0],
                        dt * dt * variance[3]);
    interval.omega_end = s.omega_ib_b;
    at.t_s = to;
    if (to == s.t_s) ++at.k;
  }
  return interval;
}

}  // namespace

IntervalSeries preintegrate(const ImuSeries& imu, const std::vector<double>& stops, const Vector<double, 6>& b_0,
                            const ImuNoise& noise) {
  std::vector<double> cuts;
  for (const double stop : stops) {
    const double from = cuts.empty() ? stop : cuts.back();
    const auto pieces = static_cast<int>(std::ceil((stop - from) / kLongest_s));
    for (int i = 1; i < pieces; ++i) cuts.push_back(from + (stop - from) * i / pieces);
    if (cuts.empty() || stop > from) cuts.push_back(stop);
  }
  IntervalSeries series{cuts.front(), std::vector<Interval>(cuts.size() - 1), b_0};
  const auto n = static_cast<std::ptrdiff_t>(series.intervals.size());
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    series.intervals[k] = interval_over(imu, cuts[k], cuts[k + 1], b_0, noise);
  }
  return series;
}

}  // namespace liealign
