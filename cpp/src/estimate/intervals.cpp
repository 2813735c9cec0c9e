// Preintegrated pieces of the IMU series.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/intervals.hpp"

#include <utility>

namespace liealign {
namespace {

constexpr auto kNothingInside = [](std::size_t, const Preintegrated<double>&) {};

}  // namespace

SampleBlocks::SampleBlocks(const ImuSeries& imu, double from_s, double to_s, const Vector<double, 6>& b, ImuNoise with)
    : b_0(b), noise(std::move(with)) {
  first = cursor_at(imu, from_s).k / kSamples;
  const std::size_t last = std::min(cursor_at(imu, to_s).k, imu.size() - 1) / kSamples;
  blocks.resize(last > first ? last - first : 0);
  const auto n = static_cast<std::ptrdiff_t>(blocks.size());
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const std::size_t begin = (first + static_cast<std::size_t>(i)) * kSamples;
    ImuCursor at{begin + 1, imu[begin].t_s};
    append_samples(blocks[static_cast<std::size_t>(i)], imu[begin + kSamples].t_s, imu, b_0, noise, at, kNothingInside);
  }
}

Preintegrated<double> SampleBlocks::preintegrate_to(double end_s, const ImuSeries& imu, ImuCursor& at) const {
  Preintegrated<double> pre;
  // The block that begins next: on the stamp before the sample of the cursor, or later.
  const std::size_t stamp = at.t_s == imu[at.k - 1].t_s ? at.k - 1 : at.k;
  std::size_t block = std::max((stamp + kSamples - 1) / kSamples, first);
  const auto ends_by = [&](std::size_t j) { return j < first + blocks.size() && imu[(j + 1) * kSamples].t_s <= end_s; };
  if (ends_by(block)) {
    append_samples(pre, imu[block * kSamples].t_s, imu, b_0, noise, at, kNothingInside);
    for (; ends_by(block); ++block) pre.append(blocks[block - first]);
    at = {block * kSamples + 1, imu[block * kSamples].t_s};
  }
  append_samples(pre, end_s, imu, b_0, noise, at, kNothingInside);
  return pre;
}

IntervalSeries preintegrate(const ImuSeries& imu, const SampleBlocks& blocks, const std::vector<double>& stops) {
  std::vector<double> cuts = {stops.front()};
  for (const double stop : stops) {
    while (cuts.back() < stop) cuts.push_back(interval_end(cuts.back(), stop));
  }
  IntervalSeries series{cuts.front(), std::vector<Interval>(cuts.size() - 1), blocks.b_0, blocks.noise};
  const auto n = static_cast<std::ptrdiff_t>(series.intervals.size());
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    ImuCursor at = cursor_at(imu, cuts[k]);
    Interval& interval = series.intervals[k];
    interval.end_s = cuts[k + 1];
    interval.pre = blocks.preintegrate_to(interval.end_s, imu, at);
    interval.end = reading_at(imu, at);
    for (std::size_t j = cursor_at(imu, cuts[k]).k; j < imu.size() && imu[j - 1].t_s < interval.end_s; ++j)
      interval.bridges_gap = interval.bridges_gap || imu[j].gap_s > 0.0;
  }
  return series;
}

Preintegrated<double> ByRescaledIntervals::take() {
  const Interval& interval = as.series.intervals[as.next++];
  Preintegrated<double> pre = interval.pre;
  if (interval.bridges_gap) {
    ImuCursor at = cursor_at(imu, as.t_s);
    pre = preintegrate_to(interval.end_s, imu, as.series.b_0, noise, at, kNothingInside);
  } else {
    const WhiteDensity was = white_density(as.series.noise, 0.0), is = white_density(noise, 0.0);
    pre.rescale_noise(is.gyro / was.gyro, is.accel / was.accel);
  }
  as.t_s = interval.end_s;
  return pre;
}

}  // namespace liealign
