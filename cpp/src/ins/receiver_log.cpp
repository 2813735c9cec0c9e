// Stamps back on the receiver's grid, steps of the columns, made-up standard deviations, classes of fixes.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/ins/receiver_log.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"

namespace liealign {
namespace {

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

// ---- Steps ----------------------------------------------------------------------------------------------------------

constexpr double kLeastResultant = 0.98;  // noise of 0.03 steps: a float in a decimal notation has less
constexpr double kFarthest = 30.0;        // steps; beyond, the error of the step itself counts
constexpr std::size_t kFewest = 20;       // differences that a step is told by: 1 / sqrt(2 * 20) is the noise of R
constexpr std::size_t kMostDifferences = 2000;
constexpr std::size_t kMostCandidates = 100;  // of each kind

// Second differences, and first ones over several lags, sorted, without those that the rounding of doubles explains. At a
// constant speed the differences of one lag are alike without any step; those of the others then add its changes up.
// Differences are brought to [-turn / 2, turn / 2]; those with a NaN do not count.
std::vector<double> sorted_differences(const std::vector<double>& values, double turn) {
  double largest = 0.0;
  for (const double value : values) largest = std::max(largest, std::isnan(value) ? 0.0 : std::abs(value));
  const double resolution = 32.0 * std::numeric_limits<double>::epsilon() * largest;
  std::vector<double> differences;
  const auto add = [&](double d) {
    if (std::abs(d) > resolution) differences.push_back(std::abs(d));
  };
  for (std::size_t i = 1; i < values.size(); ++i) {
    for (const std::size_t lag : {1U, 2U, 4U, 8U, 16U}) {
      if (i >= lag) add(std::remainder(values[i] - values[i - lag], turn));
    }
    if (i < 2) continue;
    add(std::remainder(values[i] - values[i - 1], turn) - std::remainder(values[i - 1] - values[i - 2], turn));
  }
  std::sort(differences.begin(), differences.end());
  // The smallest differences show a small step, an even choice of the others one that is rare among them.
  constexpr std::size_t kKept = kMostDifferences / 4;
  const std::size_t stride = 1 + differences.size() / (kMostDifferences - kKept);
  std::size_t end = std::min(kKept, differences.size());
  for (std::size_t i = end; i < differences.size(); i += stride) differences[end++] = differences[i];
  differences.resize(end);
  return differences;
}

// A difference is a few steps, and the distance of two is a step where all of them are many.
std::vector<double> step_candidates(const std::vector<double>& differences) {
  std::vector<double> candidates;
  const std::size_t half = (differences.size() + 1) / 2;
  const std::size_t stride = std::max<std::size_t>(1, half / kMostCandidates);
  for (std::size_t i = 0; i < half; i += stride) {
    for (const double steps : {1.0, 2.0, 3.0}) candidates.push_back(differences[i] / steps);
  }
  std::vector<double> distances;
  for (std::size_t i = 1; i < half; ++i) {
    const double distance = differences[i] - differences[i - 1];
    if (distance > 1e-3 * differences[i]) distances.push_back(distance);
  }
  for (std::size_t i = 0; i < distances.size(); i += std::max<std::size_t>(1, distances.size() / kMostCandidates)) {
    candidates.push_back(distances[i]);
  }
  std::sort(candidates.begin(), candidates.end(), std::greater<>());
  return candidates;
}

// The differences from half a step to `steps` steps.
struct Span {
  std::vector<double>::const_iterator begin, end;
};

Span span_of(const std::vector<double>& differences, double step, double steps) {
  const auto begin = std::lower_bound(differences.begin(), differences.end(), 0.5 * step);
  return {begin, std::upper_bound(begin, differences.end(), steps * step)};
}

// The candidate brought to the differences near its multiples, farther off each time: q = sum k d / sum k^2, k = round(d / q).
double refined_step(const std::vector<double>& differences, double step) {
  constexpr double kNear = 0.15;
  for (const double steps : {1.5, 5.0, kFarthest}) {
    const Span span = span_of(differences, step, steps);
    double numerator = 0.0, denominator = 0.0;
    for (auto d = span.begin; d != span.end; ++d) {
      const double k = std::round(*d / step);
      if (std::abs(*d / step - k) > kNear) continue;
      numerator += k * *d;
      denominator += k * k;
    }
    if (denominator > 0.0) step = numerator / denominator;
  }
  return step;
}

double resultant(Span span, double step) {
  double sum = 0.0;
  for (auto d = span.begin; d != span.end; ++d) sum += std::cos(2.0 * kPi * *d / step);
  return sum / static_cast<double>(span.end - span.begin);
}

// Whether the differences are multiples of the step but for a noise of this rms at most; R is exp(-2 pi^2 rms^2 / q^2) then.
// Those below half a step must be noise as well, such as the last digit of the decimal notation of a float; they are asked
// together with the others, because in a step too large by far they are all there is.
bool is_step(const std::vector<double>& differences, double step, double noise) {
  const double least = std::max(kLeastResultant, std::exp(-2.0 * kPi * kPi * noise * noise / (step * step)));
  const Span above = span_of(differences, step, kFarthest);
  if (static_cast<std::size_t>(above.end - above.begin) < kFewest || resultant(above, step) < least) {
    return false;
  }
  return resultant({differences.begin(), above.end}, step) >= least;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double column_step(const std::vector<double>& values, double turn = kInfinity, double noise = kInfinity) {
  const std::vector<double> differences = sorted_differences(values, turn);
  if (differences.size() < kFewest) return 0.0;
  for (const double candidate : step_candidates(differences)) {
    const double step = refined_step(differences, candidate);
    if (is_step(differences, step, noise)) return step;
  }
  return 0.0;
}

double horizontal_std(const GnssRecord& r) { return std::sqrt(0.5 * (r.P_n_m2(0, 0) + r.P_n_m2(1, 1))); }

// Receivers state thousands of kilometres before their first fix.
bool has_position(const GnssRecord& r) {
  constexpr double kNowhere_m = 1e4;
  return r.fix != 0 && horizontal_std(r) < kNowhere_m;
}

template <typename Value>
std::vector<double> column(const std::vector<GnssRecord>& records, const Value& value) {
  std::vector<double> values;
  values.reserve(records.size());
  for (const GnssRecord& r : records) {
    values.push_back(has_position(r) ? value(r) : std::numeric_limits<double>::quiet_NaN());
  }
  return values;
}

// Metres a radian of latitude and of longitude there.
Eigen::Vector2d metres_per_radian(const GnssRecord& r) {
  constexpr double kApart_rad = 1e-6;
  const Vector3d p = ecef_from_geodetic({r.lat_rad, r.lon_rad, r.height_m});
  const Vector3d north = ecef_from_geodetic({r.lat_rad + kApart_rad, r.lon_rad, r.height_m});
  const Vector3d east = ecef_from_geodetic({r.lat_rad, r.lon_rad + kApart_rad, r.height_m});
  return Eigen::Vector2d((north - p).norm(), (east - p).norm()) / kApart_rad;
}

// ---- Stamps ---------------------------------------------------------------------------------------------------------

constexpr std::size_t kWindow = 41;

// Records without a pause longer than a window: [begin, end).
struct Stretch {
  std::size_t begin, end;
};

std::vector<Stretch> stretches_of(const std::vector<double>& s, double h) {
  std::vector<Stretch> stretches;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= s.size(); ++i) {
    if (i < s.size() && s[i] - s[i - 1] <= static_cast<double>(kWindow) * h) continue;
    stretches.push_back({begin, i});
    begin = i;
  }
  return stretches;
}

// c_i of a stretch. A stamp that is late by more than half an interval takes the epoch of the next one: it is moved back
// where there is room. False where two records share an epoch.
bool count_epochs(const std::vector<double>& s, Stretch stretch, double h, std::vector<double>& c) {
  constexpr std::size_t kPhases = 21;
  std::vector<double> phases;
  for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
    if (i == stretch.begin) {
      c[i] = 0.0;
    } else {
      const std::size_t first = phases.size() - std::min(phases.size(), kPhases);
      const double phase = median({phases.begin() + static_cast<std::ptrdiff_t>(first), phases.end()});
      c[i] = std::round((s[i] - phase) / h);
      if (c[i] == c[i - 1]) {
        const bool room = i - 1 == stretch.begin || c[i - 1] - c[i - 2] > 1.0;
        if (!room) return false;
        c[i - 1] -= 1.0;
        phases.back() += h;
      } else if (c[i] < c[i - 1]) {
        return false;
      }
    }
    phases.push_back(s[i] - c[i] * h);
  }
  return true;
}

// The interval over many epochs: a median of slopes.
double long_interval(const std::vector<double>& s, const std::vector<Stretch>& stretches,
                     const std::vector<double>& c) {
  std::vector<double> slopes;
  for (const Stretch& stretch : stretches) {
    for (std::size_t i = stretch.begin; i + kWindow - 1 < stretch.end; ++i) {
      const std::size_t j = i + kWindow - 1;
      slopes.push_back((s[j] - s[i]) / (c[j] - c[i]));
    }
  }
  return slopes.empty() ? 0.0 : median(std::move(slopes));
}

// a_i of the line over the window about record i.
double line_at(const std::vector<double>& s, const std::vector<double>& c, Stretch window, std::size_t i) {
  std::vector<double> sizes(window.end - window.begin);
  double a = s[i], slope = 0.0, limit = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 2; ++pass) {
    double n = 0.0, x_sum = 0.0, y_sum = 0.0, xx = 0.0, xy = 0.0;
    for (std::size_t j = window.begin; j < window.end; ++j) {
      const double x = c[j] - c[i], y = s[j] - s[i];
      if (std::abs(s[j] - a - slope * x) > limit) continue;
      n += 1.0;
      x_sum += x;
      y_sum += y;
      xx += x * x;
      xy += x * y;
    }
    slope = (n * xy - x_sum * y_sum) / (n * xx - x_sum * x_sum);
    a = s[i] + (y_sum - slope * x_sum) / n;
    for (std::size_t j = window.begin; j < window.end; ++j) {
      sizes[j - window.begin] = std::abs(s[j] - a - slope * (c[j] - c[i]));
    }
    constexpr double kRounding_s = 1e-6;  // half of the fixes and more stay inside of the limit
    limit = 2.5 * median(sizes) + kRounding_s;
  }
  return a;
}

// a_i; NaN in a piece between two pauses that is too short for a line.
std::vector<double> grid_times(const std::vector<double>& s, const std::vector<Stretch>& stretches,
                               const std::vector<double>& c) {
  constexpr std::size_t kShortest = 10;
  std::vector<double> a(s.size(), std::numeric_limits<double>::quiet_NaN());
  for (const Stretch& stretch : stretches) {
    const std::size_t window = std::min(kWindow, stretch.end - stretch.begin);
    if (window < kShortest) continue;
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
      const std::size_t before = std::min(i - stretch.begin, window / 2);
      const std::size_t begin = std::min(i - before, stretch.end - window);
      a[i] = line_at(s, c, {begin, begin + window}, i);
    }
  }
  return a;
}

// Rounding of the stamps to a step q errs by q / sqrt(12) rms. The interval itself is no such step where the stamps jitter
// about its multiples.
double rounding_rms(const std::vector<double>& s, double jitter_s) {
  return column_step(s, kInfinity, 0.1 * jitter_s) / std::sqrt(12.0);
}

// Lines to grid times with their jitter: the mean of stamp minus grid goes to zero, and stamps without a line stay. False
// where there is no grid.
bool settle(const std::vector<double>& s, StampGrid& grid) {
  std::vector<double> e;
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (!std::isnan(grid.t_s[i])) e.push_back(s[i] - grid.t_s[i]);
  }
  if (e.empty()) return false;
  const double mean = std::accumulate(e.begin(), e.end(), 0.0) / static_cast<double>(e.size());
  for (std::size_t i = 0; i < s.size(); ++i) grid.t_s[i] = std::isnan(grid.t_s[i]) ? s[i] : grid.t_s[i] + mean;
  const double middle = median(e), limit = grid.interval_s / 3.0;
  for (double& size : e) size = std::abs(size - middle);
  grid.jitter_s = quantile(e, 0.8) / 1.2816;  // Phi^-1(0.9); the median would not see that a quarter of them is late
  const auto far = std::count_if(e.begin(), e.end(), [&](double size) { return size > limit; });
  const bool increasing =
      std::adjacent_find(grid.t_s.begin(), grid.t_s.end(), std::greater_equal<>()) == grid.t_s.end();
  return increasing && 20 * static_cast<std::size_t>(far) <= e.size() && grid.jitter_s < limit;
}

}  // namespace

StampGrid stamp_grid(const std::vector<GnssRecord>& records) {
  StampGrid none;
  for (const GnssRecord& r : records) none.t_s.push_back(r.t_s);
  const std::vector<double>& s = none.t_s;
  if (s.size() < kWindow) return none;
  std::vector<double> intervals(s.size());
  std::adjacent_difference(s.begin(), s.end(), intervals.begin());
  double h = median({intervals.begin() + 1, intervals.end()});
  if (!(h > 0.0)) return none;

  StampGrid grid;
  std::vector<double> c(s.size());
  // The median interval of two stamps is near enough to count, the one over many epochs does not run away from it.
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<Stretch> stretches = stretches_of(s, h);
    for (const Stretch& stretch : stretches) {
      if (!count_epochs(s, stretch, h, c)) return none;
    }
    grid.interval_s = long_interval(s, stretches, c);
    if (!(grid.interval_s > 0.0)) return none;
    h = grid.interval_s;
    if (pass == 1) grid.t_s = grid_times(s, stretches, c);
  }
  if (!settle(s, grid)) return none;
  constexpr double kLeastJitter_s = 1e-5;  // a tenth of a millimetre at 10 m/s
  grid.arrival = grid.jitter_s > kLeastJitter_s && grid.jitter_s > 2.0 * rounding_rms(s, grid.jitter_s);
  if (!grid.arrival) grid.t_s = s;
  return grid;
}

double stamp_walk(const StampGrid& grid) {
  if (!grid.arrival) return 0.0;
  return grid.jitter_s / static_cast<double>(kWindow) * std::sqrt(3.0 / grid.interval_s);
}

QuantisationSteps quantisation_steps(const std::vector<GnssRecord>& records) {
  QuantisationSteps steps;
  const auto known = std::find_if(records.rbegin(), records.rend(), has_position);
  if (known == records.rend()) return steps;
  // In degrees, as files have them: their decimals are exact there.
  const Eigen::Vector2d metres_per_degree = kDegToRad * metres_per_radian(*known);
  constexpr double kTurn_deg = 360.0;
  const auto lat_deg = [](const GnssRecord& r) { return r.lat_rad * kRadToDeg; };
  const auto lon_deg = [](const GnssRecord& r) { return r.lon_rad * kRadToDeg; };
  steps.position_n_m = {metres_per_degree(0) * column_step(column(records, lat_deg)),
                        metres_per_degree(1) * column_step(column(records, lon_deg), kTurn_deg),
                        column_step(column(records, [](const GnssRecord& r) { return r.height_m; }))};
  for (int axis = 0; axis < 3; ++axis) {
    const auto velocity = [&](const GnssRecord& r) {
      return r.has_velocity ? r.v_n_mps(axis) : std::numeric_limits<double>::quiet_NaN();
    };
    steps.velocity_n_mps(axis) = column_step(column(records, velocity));
  }
  return steps;
}

bool stated_std_is_constant(const std::vector<GnssRecord>& records) {
  constexpr double kSame = 1e-6;  // relative; files round
  const auto first = std::find_if(records.begin(), records.end(), has_position);
  if (first == records.end()) return false;
  const Vector3d P = first->P_n_m2.diagonal();
  return std::all_of(first, records.end(), [&](const GnssRecord& r) {
    return !has_position(r) || ((r.P_n_m2.diagonal() - P).cwiseAbs().array() <= kSame * P.array()).all();
  });
}

FixClass fix_class(const GnssRecord& record) {
  const double std_m = horizontal_std(record);
  constexpr double kMetres = 1.0;  // whole ambiguities leave centimetres, whatever a column says
  if (record.fix >= 0 && !(record.fix == 1 && std_m >= kMetres)) {
    return record.fix == 1 ? FixClass::fixed : record.fix == 5 ? FixClass::single : FixClass::other;
  }
  return std_m < 0.1 ? FixClass::fixed : std_m < 1.0 ? FixClass::other : FixClass::single;
}

}  // namespace liealign
