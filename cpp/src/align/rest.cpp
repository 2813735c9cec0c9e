// Rest detection and averages over a rest.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/rest.hpp"

#include <algorithm>
#include <cmath>

namespace liealign {
namespace {

constexpr double kWindow_s = 0.5;

struct Window {
  double begin_s, end_s, samples;
  Vector3d mean_omega, mean_f, std_omega, std_f;
};

Window summarise(const ImuSeries& imu, std::size_t first, std::size_t last) {
  const auto n = static_cast<double>(last - first);
  Vector3d sum_w = Vector3d::Zero(), sum_f = Vector3d::Zero(), square_w = Vector3d::Zero(), square_f = Vector3d::Zero();
  for (std::size_t k = first; k < last; ++k) {
    // against the first sample, so that the squares keep their digits
    const Vector3d w = imu[k].omega_ib_b - imu[first].omega_ib_b, f = imu[k].f_ib_b - imu[first].f_ib_b;
    sum_w += w;
    sum_f += f;
    square_w += w.cwiseAbs2();
    square_f += f.cwiseAbs2();
  }
  const auto deviation = [n](const Vector3d& sum, const Vector3d& square) -> Vector3d {
    return (square / n - (sum / n).cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  };
  return {imu[first - 1].t_s,
          imu[last - 1].t_s,
          n,
          imu[first].omega_ib_b + sum_w / n,
          imu[first].f_ib_b + sum_f / n,
          deviation(sum_w, square_w),
          deviation(sum_f, square_f)};
}

std::vector<Window> windows(const ImuSeries& imu) {
  std::vector<Window> out;
  std::size_t first = 1;
  for (std::size_t k = 1; k < imu.size(); ++k) {
    if (imu[k].t_s - imu[first - 1].t_s < kWindow_s && k + 1 < imu.size()) continue;
    // A window that spans a gap of the log has too few samples to say anything.
    if (imu[k].t_s - imu[first - 1].t_s < 2.0 * kWindow_s && k + 1 - first >= 5)
      out.push_back(summarise(imu, first, k + 1));
    first = k + 1;
  }
  return out;
}

// The rest so far.
struct Reference {
  Vector3d omega = Vector3d::Zero(), f = Vector3d::Zero();  // slow averages, so that a warming sensor may drift
  // The mean of its first fixes: a mean that follows would follow a drift.
  Vector3d p = Vector3d::Zero();
  double fixes = 0.0;
  double last_fix_s = 0.0;
  int disagreeing = 0;  // fixes in a row

  void follow(const Window& w) {
    omega += 0.2 * (w.mean_omega - omega);
    f += 0.2 * (w.mean_f - f);
  }
};

// Away from where the rest began, or with a velocity of its own.
bool shows_motion(const GnssFix& fix, const Reference& reference, double sigmas) {
  if (fix.has_velocity && fix.v_ea_e.norm() > sigmas * std::sqrt(fix.R_v_e.trace())) return true;
  return reference.fixes > 0.0 && (fix.p_ea_e - reference.p).norm() > sigmas * std::sqrt(fix.R_p_e.trace());
}

// Whether the rest goes on after this fix. Three in a row that show motion end it: one or two may be outliers.
bool fix_stays(const GnssFix& fix, Reference& reference, double sigmas) {
  constexpr double kFirstFixes = 5.0;
  constexpr int kOutliers = 2;
  if (shows_motion(fix, reference, sigmas)) return ++reference.disagreeing <= kOutliers;
  if (reference.fixes < kFirstFixes) reference.p += (fix.p_ea_e - reference.p) / (reference.fixes + 1.0);
  reference.fixes += 1.0;
  reference.disagreeing = 0;
  reference.last_fix_s = fix.t_s;
  return true;
}

// The fixes of a period without those far from their median.
std::vector<GnssFix> typical_fixes(const std::vector<GnssFix>& fixes, const RestPeriod& period) {
  constexpr double kFar = 5.0;  // standard deviations of a fix
  std::vector<GnssFix> inside;
  for (const GnssFix& f : fixes) {
    if (f.t_s >= period.begin_s && f.t_s <= period.end_s) inside.push_back(f);
  }
  if (inside.empty()) return inside;
  Vector3d median;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(inside.size());
    for (const GnssFix& f : inside) values.push_back(f.p_ea_e[axis]);
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    median[axis] = values[values.size() / 2];
  }
  std::erase_if(inside,
                [&](const GnssFix& f) { return (f.p_ea_e - median).norm() > kFar * std::sqrt(f.R_p_e.trace()); });
  return inside;
}

// The first sample of a prepared series whose interval ends after t.
ImuSeries::const_iterator first_after(const ImuSeries& imu, double t_s) {
  return std::upper_bound(imu.begin() + 1, imu.end(), t_s, [](double t, const ImuSample& s) { return t < s.t_s; });
}

// A component of the window means within a rest: its level next to one end, and what it scatters by about a slow drift.
struct Level {
  double median, scatter;
};

template <typename Component>
Level level_of(const std::vector<Window>& rest, std::size_t from, std::size_t to, Component component) {
  std::vector<double> values, jumps;
  for (std::size_t i = from; i < to; ++i) {
    values.push_back(component(rest[i]));
    if (i > from) jumps.push_back(std::abs(values[i - from] - values[i - from - 1]));
  }
  const auto median = [](std::vector<double>& v) {
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
  };
  constexpr double kSigmaOfJumps = 1.0 / (0.6745 * 1.4142);  // of a normal law, from the median of |x_i - x_j|
  return {median(values), kSigmaOfJumps * median(jumps)};
}

// How many windows at the end of a rest, next to its last one, are no longer at its level: a gentle take-off begins long before
// it leaves the limits of a rest. Half of the rest at most.
std::size_t leaving(const std::vector<Window>& rest) {
  constexpr std::size_t kNear = 60, kInARow = 3;
  constexpr double kSigmas = 5.0, kFloor_mps2 = 0.003, kFloor_rps = 5e-4;
  const std::size_t n = rest.size(), from = n > kNear ? n - kNear : 0;
  if (n < 4 * kInARow) return 0;
  std::size_t last_away = 0, level = 0;
  std::vector<bool> away(n, false);
  for (int axis = 0; axis < 3; ++axis) {
    const Level f = level_of(rest, from, n, [&](const Window& w) { return w.mean_f[axis]; });
    const Level omega = level_of(rest, from, n, [&](const Window& w) { return w.mean_omega[axis]; });
    for (std::size_t i = from; i < n; ++i) {
      if (std::abs(rest[i].mean_f[axis] - f.median) > kFloor_mps2 + kSigmas * f.scatter ||
          std::abs(rest[i].mean_omega[axis] - omega.median) > kFloor_rps + kSigmas * omega.scatter)
        away[i] = true;
    }
  }
  for (std::size_t back = 1; back <= n / 2 && level < kInARow; ++back) {
    level = away[n - back] ? 0 : level + 1;
    if (away[n - back]) last_away = back;
  }
  return level < kInARow ? n / 2 : last_away;
}

// The part of a rest that is at its level, without a window more at either end that the log does not end itself: motion that
// begins inside a window leaves it calm.
RestPeriod without_its_ends(const RestPeriod& rest, const std::vector<Window>& all, const ImuSeries& imu) {
  std::vector<Window> inside;
  for (const Window& w : all) {
    if (w.begin_s >= rest.begin_s && w.end_s <= rest.end_s + 1e-9) inside.push_back(w);
  }
  RestPeriod out = rest;
  if (inside.empty()) return out;
  const std::size_t after = leaving(inside);
  if (after > 0) out.end_s = inside[inside.size() - after].begin_s;
  std::reverse(inside.begin(), inside.end());
  const std::size_t before = leaving(inside);
  if (before > 0) out.begin_s = inside[inside.size() - before].end_s;
  if (rest.begin_s > imu.front().t_s + kWindow_s) out.begin_s += kWindow_s;
  if (rest.end_s < imu.back().t_s - kWindow_s) out.end_s -= kWindow_s;
  return out;
}

bool calm(const Window& w, const RestLimits& limits) {
  return w.std_omega.maxCoeff() <= limits.gyro_std_rps && w.std_f.maxCoeff() <= limits.accel_std_mps2;
}

}  // namespace

std::vector<RestPeriod> find_rests(const ImuSeries& imu, const std::vector<GnssFix>& fixes, const RestLimits& limits) {
  std::vector<RestPeriod> rests;
  bool open = false;
  RestPeriod period;
  Reference reference;
  std::size_t next_fix = 0;
  const auto close = [&] {
    // A calm IMU does not tell rest from steady motion: where there are fixes, a rest lasts as long as they say so.
    if (open && !fixes.empty()) period.end_s = std::min(period.end_s, reference.last_fix_s);
    if (open && period.end_s - period.begin_s >= limits.min_duration_s) rests.push_back(period);
    open = false;
  };
  const std::vector<Window> all = windows(imu);
  for (const Window& w : all) {
    const bool connected = open && w.begin_s - period.end_s < kWindow_s;
    bool still = calm(w, limits);
    if (still && connected) {
      // what the window's own noise moves its mean by is no motion
      const double noise = 4.0 / std::sqrt(w.samples);
      still = (w.mean_omega - reference.omega).norm() <= limits.gyro_mean_rps + noise * w.std_omega.norm() &&
              (w.mean_f - reference.f).norm() <= limits.accel_mean_mps2 + noise * w.std_f.norm();
    }
    Reference trial = connected ? reference : Reference{w.mean_omega, w.mean_f, Vector3d::Zero(), 0.0, w.begin_s, 0};
    while (next_fix < fixes.size() && fixes[next_fix].t_s <= w.begin_s) ++next_fix;
    for (std::size_t i = next_fix; still && i < fixes.size() && fixes[i].t_s <= w.end_s; ++i) {
      still = fix_stays(fixes[i], trial, limits.gnss_drift_sigma);
    }
    if (!still || !connected) close();
    if (!still) continue;
    if (!open) period = {w.begin_s, w.end_s};
    open = true;
    period.end_s = w.end_s;
    reference = trial;
    reference.follow(w);
  }
  close();
  std::vector<RestPeriod> trimmed;
  for (const RestPeriod& r : rests) {
    const RestPeriod inner = without_its_ends(r, all, imu);
    if (inner.end_s - inner.begin_s >= limits.min_duration_s) trimmed.push_back(inner);
  }
  return trimmed;
}

RestStatistics rest_statistics(const ImuSeries& imu, const std::vector<GnssFix>& fixes, const RestPeriod& period) {
  RestStatistics s;
  s.period = period;
  double samples = 0.0;
  for (auto sample = first_after(imu, period.begin_s); sample != imu.end() && sample->t_s <= period.end_s; ++sample) {
    s.mean_omega_ib_b += sample->omega_ib_b;
    s.mean_f_ib_b += sample->f_ib_b;
    samples += 1.0;
  }
  s.mean_omega_ib_b /= samples;
  s.mean_f_ib_b /= samples;
  for (const GnssFix& fix : typical_fixes(fixes, period)) {
    ++s.fixes;
    const auto n = static_cast<double>(s.fixes);
    s.p_ea_e += (fix.p_ea_e - s.p_ea_e) / n;
    s.R_p_e += (fix.R_p_e - s.R_p_e) / n;
  }
  return s;
}

std::vector<RestUpdate> rest_updates(const ImuSeries& imu, const RestPeriod& period, double interval_s) {
  std::vector<RestUpdate> updates;
  auto first = first_after(imu, period.begin_s);
  for (double begin = period.begin_s; begin + interval_s <= period.end_s + 1e-9; begin += interval_s) {
    const double end = begin + interval_s;
    RestUpdate u{end, interval_s, Vector3d::Zero(), Vector3d::Zero()};
    double samples = 0.0;
    for (; first != imu.end() && first->t_s <= end; ++first) {
      u.mean_omega_ib_b += first->omega_ib_b;
      samples += 1.0;
    }
    if (samples < 1.0) continue;
    u.mean_omega_ib_b /= samples;
    updates.push_back(u);
  }
  if (updates.size() < 3) return updates;
  // Scatter about a drifting mean: from successive differences, so that a warming sensor does not count as rocking.
  Vector3d squares = Vector3d::Zero();
  for (std::size_t i = 1; i < updates.size(); ++i) {
    squares += (updates[i].mean_omega_ib_b - updates[i - 1].mean_omega_ib_b).cwiseAbs2();
  }
  const Vector3d std = (squares / (2.0 * static_cast<double>(updates.size() - 1))).cwiseSqrt();
  for (RestUpdate& u : updates) u.std_omega_ib_b = std;
  return updates;
}

}  // namespace liealign
