// The choice between a start at rest and one in motion.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/start.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

constexpr double kNudge_m = 0.5;  // a vehicle pushed about on its place

std::string seconds_text(double t) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", t);
  return text;
}

double reach_of(const RestStatistics& at, const Config& config) {
  return kNudge_m + config.rest.gnss_drift_sigma * std::sqrt(at.R_p_e.trace());
}

// The last rest before the first motion: tilt, biases and position come from it.
std::optional<RestStatistics> last_rest_before_motion(const Config& config, const FlightData& data,
                                                      const std::vector<RestPeriod>& rests) {
  std::optional<RestStatistics> chosen;
  for (const RestPeriod& r : rests) {
    const RestStatistics statistics = rest_statistics(data.imu(), data.fixes, r);
    if (statistics.fixes == 0) continue;
    // A nudge ends a rest without a motion: go on to the next one while no fix in between has left the place.
    const auto left = [&](const GnssFix& f) {
      return f.t_s > chosen->period.end_s && f.t_s <= r.end_s &&
             (f.p_ea_e - chosen->p_ea_e).norm() > reach_of(*chosen, config);
    };
    if (chosen && std::any_of(data.fixes.begin(), data.fixes.end(), left)) break;
    chosen = statistics;
  }
  return chosen;
}

// Three fixes in a row away from the rest: one or two may be outliers.
bool moved_before(const RestStatistics& rest, const Config& config, const std::vector<GnssFix>& fixes) {
  int away = 0;
  for (const GnssFix& f : fixes) {
    if (f.t_s >= rest.period.begin_s) return false;
    away = (f.p_ea_e - rest.p_ea_e).norm() > reach_of(rest, config) ? away + 1 : 0;
    if (away == 3) return true;
  }
  return false;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Start choose_start(const Config& config, const FlightData& data, const std::vector<RestPeriod>& rests) {
  const double first_fix_s = data.fixes.front().t_s;
  if (config.align.start == "moving") return {true, {}, first_fix_s, "align.start is \"moving\""};
  const std::optional<RestStatistics> rest = last_rest_before_motion(config, data, rests);
  if (config.align.start == "static") {
    if (rest) return {false, rest->period, rest->period.end_s, "align.start is \"static\""};
    throw InputError("align.start is \"static\" and the log holds no rest of at least " +
                     seconds_text(config.rest.min_duration_s) +
                     " s with fixes; see the keys of [rest], or set align.start = \"auto\" (--start auto)");
  }
  if (!rest) return {true, {}, first_fix_s, "the log holds no rest with fixes"};
  const std::string span = seconds_text(rest->period.begin_s) + " s to " + seconds_text(rest->period.end_s) + " s";
  if (moved_before(*rest, config, data.fixes))
    return {true, {}, first_fix_s, "the vehicle moves before its first rest, " + span};
  return {false, rest->period, rest->period.end_s, "the vehicle rests from " + span};
}

// Velocity from the first fix that has one, or the median slope of the first fixes; its spread is how uncertain it is.
MotionStatistics motion_statistics(const std::vector<GnssFix>& fixes, double t_s, const CoarseAlignment& coarse) {
  constexpr double kSpan_s = 2.0;
  constexpr std::size_t kFewest = 4;
  constexpr double kPositionStd_m = 3.0,
                   kVelocityStd_mps = 2.0;  // at least: a latency and the first fixes are uncertain
  MotionStatistics m;
  m.t_s = t_s;
  m.roll_rad = coarse.roll_rad;
  m.pitch_rad = coarse.pitch_rad;
  m.tilt_std_rad = coarse.tilt_std_rad;
  m.b_g_rps = coarse.b_g_rps;
  m.gyro_bias_std_rps = coarse.b_g_std_rps;
  std::vector<GnssFix> first;
  for (const GnssFix& f : fixes) {
    if (f.t_s < t_s) continue;
    if (first.size() >= kFewest && f.t_s > t_s + kSpan_s) break;
    first.push_back(f);
  }
  double spread = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> slopes, positions;
    for (std::size_t i = 0; i < first.size(); ++i) {
      if (first[i].has_velocity) slopes.push_back(first[i].v_ea_e[axis]);
      for (std::size_t j = 0; j < i && !first[i].has_velocity; ++j)
        slopes.push_back((first[i].p_ea_e[axis] - first[j].p_ea_e[axis]) / (first[i].t_s - first[j].t_s));
    }
    m.v_ea_e[axis] = slopes.empty() ? 0.0 : median_of(slopes);
    for (double& s : slopes) s = std::abs(s - m.v_ea_e[axis]);
    spread = std::max(spread, slopes.empty() ? 0.0 : 1.5 * median_of(slopes));
    for (const GnssFix& f : first) positions.push_back(f.p_ea_e[axis] - m.v_ea_e[axis] * (f.t_s - t_s));
    m.p_ea_e[axis] = median_of(positions);
  }
  m.velocity_std_mps = std::max(kVelocityStd_mps, 2.0 * spread);
  m.position_std_m = std::max(kPositionStd_m, kSpan_s * spread) + std::sqrt(first.front().R_p_e.trace());
  return m;
}

}  // namespace liealign
