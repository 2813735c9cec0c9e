// The IMU series cut at given times and preintegrated piece by piece, for filters that move from fix to fix.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/estimate/forward.hpp"

namespace liealign {

// Samples between two times.
struct Interval {
  double end_s = 0.0;
  Preintegrated<double> pre;
  Vector3d omega_end = Vector3d::Zero();  // rad/s, of the last sample, as measured
};

struct IntervalSeries {
  double begin_s = 0.0;
  std::vector<Interval> intervals;                    // one after the other, none longer than a second
  Vector<double, 6> b_0 = Vector<double, 6>::Zero();  // the biases (accelerometer, gyro) the samples were corrected by
};

// Cuts at `stops` (ascending, inside the series; the first is the begin) and, where they are more than a second apart, in
// between: over a second gravitation and the first order of the biases hold. Threads over the pieces; the result does not
// depend on their number.
IntervalSeries preintegrate(const ImuSeries& imu, const std::vector<double>& stops, const Vector<double, 6>& b_0,
                            const ImuNoise& noise);

// Moves a belief by whole intervals; a pass stops where one ends. See BySamples.
struct ByIntervals {
  const IntervalSeries& series;
  std::size_t next = 0;
  double t_s;

  explicit ByIntervals(const IntervalSeries& of) : series(of), t_s(of.begin_s) {}

  template <typename Model, typename Visitor>
  void move_to(double t_target, const Ekf<Model>& ekf, Belief<Model>& belief, Visitor&) {
    for (; next < series.intervals.size() && series.intervals[next].end_s <= t_target; ++next) {
      const Interval& interval = series.intervals[next];
      ekf.predict(belief, interval.pre, series.b_0);
      t_s = interval.end_s;
    }
  }
  Vector3d omega() const { return series.intervals[next - 1].omega_end; }
  ImuCursor cursor() const { return {0, t_s}; }
};

}  // namespace liealign
