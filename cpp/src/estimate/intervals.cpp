// Preintegrated pieces of the IMU series.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/intervals.hpp"

namespace liealign {

IntervalSeries preintegrate(const ImuSeries& imu, const std::vector<double>& stops, const Vector<double, 6>& b_0,
                            const ImuNoise& noise) {
  std::vector<double> cuts = {stops.front()};
  for (const double stop : stops) {
    while (cuts.back() < stop) cuts.push_back(interval_end(cuts.back(), stop));
  }
  IntervalSeries series{cuts.front(), std::vector<Interval>(cuts.size() - 1), b_0, noise};
  const auto n = static_cast<std::ptrdiff_t>(series.intervals.size());
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    ImuCursor at = cursor_at(imu, cuts[k]);
    const auto nothing_inside = [](std::size_t, const Preintegrated<double>&) {};
    Interval& interval = series.intervals[k];
    interval.end_s = cuts[k + 1];
    interval.pre = preintegrate_to(interval.end_s, imu, b_0, noise, at, nothing_inside);
    interval.omega_end = omega_at(imu, at);
    for (std::size_t j = cursor_at(imu, cuts[k]).k; j < imu.size() && imu[j - 1].t_s < interval.end_s; ++j)
      interval.bridges_gap = interval.bridges_gap || imu[j].gap_s > 0.0;
  }
  return series;
}

}  // namespace liealign
