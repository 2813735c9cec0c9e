// The IMU series cut at given times and preintegrated piece by piece, for filters that move from fix to fix.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "liealign/estimate/filter_steps.hpp"

namespace liealign {

// Where an interval that begins at from_s on the way to `stop_s` ends: over more than a second gravitation and the first
// order of the biases would not hold. Pieces of one length, whoever resumes between them.
inline double interval_end(double from_s, double stop_s) {
  constexpr double kLongest_s = 1.0;
  const double pieces = std::ceil((stop_s - from_s) / kLongest_s);
  return pieces <= 1.0 ? stop_s : from_s + (stop_s - from_s) / pieces;
}

// Appends the samples from `at` to end_s, corrected by the biases b (accelerometer first). inside(k, pre) is called on the
// stamp of each sample k before the end.
template <typename Inside>
void append_samples(Preintegrated<double>& pre, double end_s, const ImuSeries& imu, const Vector<double, 6>& b,
                    const ImuNoise& noise, ImuCursor& at, Inside& inside) {
  while (at.k < imu.size() && at.t_s < end_s) {
    const ImuSample& s = imu[at.k];
    const double to = std::min(s.t_s, end_s), dt = to - at.t_s;
    const WhiteDensity white = white_density(noise, s);
    pre.append({s.omega_ib_b - b.tail<3>(), s.f_ib_b - b.head<3>(), dt}, white.accel * dt, white.gyro * dt);
    at.t_s = to;
    if (to == s.t_s) {
      if (to < end_s) inside(at.k, pre);
      ++at.k;
    }
  }
}

template <typename Inside>
Preintegrated<double> preintegrate_to(double end_s, const ImuSeries& imu, const Vector<double, 6>& b,
                                      const ImuNoise& noise, ImuCursor& at, Inside& inside) {
  Preintegrated<double> pre;
  append_samples(pre, end_s, imu, b, noise, at, inside);
  return pre;
}

// Samples gathered in short runs, once, for whoever cuts the same samples at other times again and again.
struct SampleBlocks {
  static constexpr std::size_t kSamples = 16;
  std::size_t first = 0;  // block i spans the samples after stamp (first + i) kSamples
  std::vector<Preintegrated<double>> blocks;
  Vector<double, 6> b_0 = Vector<double, 6>::Zero();  // the biases (accelerometer, gyro) the samples were corrected by
  ImuNoise noise;                                     // that they were gathered with

  SampleBlocks() = default;
  // Those that lie between from_s and to_s. Threads over the blocks.
  SampleBlocks(const ImuSeries& imu, double from_s, double to_s, const Vector<double, 6>& b, ImuNoise with);

  // The samples of `imu`, the same, from `at` to end_s: by blocks (Eq. 65) where there are any.
  Preintegrated<double> preintegrate_to(double end_s, const ImuSeries& imu, ImuCursor& at) const;
};

// Samples between two times.
struct Interval {
  double end_s = 0.0;
  Preintegrated<double> pre;
  ImuReading end;            // what the IMU reads at its end
  bool bridges_gap = false;  // a gap of the log reaches into it
};

struct IntervalSeries {
  double begin_s = 0.0;
  std::vector<Interval> intervals;                    // one after the other, none longer than a second
  Vector<double, 6> b_0 = Vector<double, 6>::Zero();  // the biases (accelerometer, gyro) the samples were corrected by
  ImuNoise noise;                                     // that they were gathered with
};

// Cuts at `stops` (ascending, inside the series; the first is the begin) and, by interval_end, in between. Threads over
// the pieces; the result does not depend on their number.
IntervalSeries preintegrate(const ImuSeries& imu, const SampleBlocks& blocks, const std::vector<double>& stops);

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
      using Scalar = typename Model::Scalar;
      ekf.predict(belief, interval.pre.template cast<Scalar>(), series.b_0.template cast<Scalar>());
      t_s = interval.end_s;
    }
  }
  ImuReading reading() const { return series.intervals[next - 1].end; }
  ImuCursor cursor() const { return {0, t_s}; }
};

// The same with another noise: the increments do not depend on it. Only where a gap adds its own are the samples gone
// through again.
struct ByRescaledIntervals {
  ByIntervals as;
  const ImuSeries& imu;
  ImuNoise noise;

  bool reaches(double t_target) const {
    return as.next < as.series.intervals.size() && as.series.intervals[as.next].end_s <= t_target;
  }

  // The next interval.
  Preintegrated<double> take();

  template <typename Model, typename Visitor>
  void move_to(double t_target, const Ekf<Model>& ekf, Belief<Model>& belief, Visitor&) {
    using Scalar = typename Model::Scalar;
    while (reaches(t_target))
      ekf.predict(belief, take().template cast<Scalar>(), as.series.b_0.template cast<Scalar>());
  }
  ImuReading reading() const { return as.reading(); }
  ImuCursor cursor() const { return as.cursor(); }
};

// The same by a clock that is a little off that of the intervals, another in each lane: at an event after t_ref_s the belief
// is ahead of the intervals by ahead_s + drift (t - t_ref_s), which is to be short against the motion's changes.
template <typename Scalar>
struct ByShiftedIntervals {
  ByRescaledIntervals by;
  Scalar ahead_s, drift;
  double t_ref_s;
  Scalar is_ahead_s{0};

  template <typename Model, typename Visitor>
  void move_to(double t_target, const Ekf<Model>& ekf, Belief<Model>& belief, Visitor&) {
    while (by.reaches(t_target)) {
      Preintegrated<Scalar> pre = on_from(by.as.t_s, -is_ahead_s);
      pre.append(by.take().template cast<Scalar>());
      is_ahead_s = Scalar(0);
      if (!by.reaches(t_target) && t_target > t_ref_s) {
        is_ahead_s = ahead_s + drift * Scalar(t_target - t_ref_s);
        pre.append(on_from(by.as.t_s, is_ahead_s));
      }
      ekf.predict(belief, pre, by.as.series.b_0.template cast<Scalar>());
    }
  }
  ImuReading reading() const { return by.reading(); }
  ImuCursor cursor() const { return by.cursor(); }

 private:
  // `dt` from t_s on, or back: as the sample there, without noise.
  Preintegrated<Scalar> on_from(double t_s, const Scalar& dt) const {
    const ImuSample& s = by.imu[std::min(cursor_at(by.imu, t_s).k, by.imu.size() - 1)];
    const Vector<double, 6>& b = by.as.series.b_0;
    const Vector3d omega = s.omega_ib_b - b.tail<3>(), f = s.f_ib_b - b.head<3>();
    Preintegrated<Scalar> pre;
    pre.append({omega.template cast<Scalar>(), f.template cast<Scalar>(), dt}, 0.0, 0.0);
    return pre;
  }
};

}  // namespace liealign
