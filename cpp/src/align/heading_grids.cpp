// The grids of a heading search.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/heading_grids.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/core/units.hpp"

namespace liealign {

std::vector<HeadingCandidate> scale_grid(const HeadingSearchOptions& options) {
  std::vector<HeadingCandidate> at;
  if (options.guess_rad) {
    const double latency = options.seeds.empty() ? 0.0 : options.seeds.front().latency_s;
    at.push_back({*options.guess_rad, options.guess_std_rad, false, {}, {latency}});
  } else {
    for (const HeadingSeed& seed : options.seeds) {
      if (at.size() < 2) at.push_back({seed.heading_rad, options.grid_std_rad, false, {}, {seed.latency_s}});
    }
  }
  for (int i = 0; at.empty() || (options.seeds.empty() && !options.guess_rad && i < 4); ++i)
    at.push_back({0.5 * kPi * i, options.grid_std_rad, false, {}, {}});
  const std::vector<double> one = {1.0};
  const std::vector<double> imu = options.estimate_imu_noise ? std::vector<double>{1.0, 5.0, 25.0, 125.0} : one;
  const std::vector<double> gnss = options.estimate_gnss_std ? std::vector<double>{0.3, 1.0, 3.0} : one;
  const std::vector<double> turn_on = options.estimate_imu_noise ? std::vector<double>{1.0, 8.0, 64.0} : one;
  std::vector<HeadingCandidate> grid;
  for (HeadingCandidate candidate : at) {
    for (double i : imu) {
      for (double g : gnss) {
        for (double t : turn_on) {
          if (t < i && t > 1.0) continue;
          candidate.parameters.imu_noise_scale = i;
          candidate.parameters.gnss_std_scale = g;
          candidate.parameters.turn_on_scale = std::max(1.0, t / i);
          grid.push_back(candidate);
        }
      }
    }
  }
  return grid;
}

std::vector<HeadingCandidate> latency_scan(const HeadingSearchOptions& options, const FlightParameters& parameters) {
  constexpr int kHalf = 8;
  std::vector<HeadingCandidate> candidates;
  for (const HeadingSeed& seed : options.seeds) {
    for (int i = -kHalf; i <= kHalf; ++i) {
      FlightParameters late = parameters;
      late.latency_s = seed.latency_s + kLatencyScan_s * i / kHalf;
      candidates.push_back({seed.heading_rad, options.grid_std_rad, false, {}, late});
    }
  }
  return candidates;
}

std::vector<double> circle_latencies(const HeadingSearchOptions& options) {
  constexpr double kSame_s = 0.1, kFarthest_s = 0.8, kStep_s = 0.2;
  if (!options.estimate_latency) return {0.0};
  std::vector<double> latencies;
  for (const HeadingSeed& seed : options.seeds) {
    const auto same = [&](double latency) { return std::abs(latency - seed.latency_s) < kSame_s; };
    if (std::none_of(latencies.begin(), latencies.end(), same)) latencies.push_back(seed.latency_s);
  }
  for (double latency = -kFarthest_s; options.seeds.empty() && latency < kFarthest_s + 0.5 * kStep_s;
       latency += kStep_s) {
    latencies.push_back(latency);
  }
  return latencies;
}

std::vector<HeadingCandidate> coarse_circle(const HeadingSearchOptions& options, const FlightParameters& parameters) {
  std::vector<HeadingCandidate> candidates;
  const auto add = [&](double heading, double std, double latency) {
    FlightParameters late = parameters;
    late.latency_s = latency;
    candidates.push_back({heading, std, false, {}, late});
  };
  if (options.guess_rad) {
    for (double latency : circle_latencies(options)) add(*options.guess_rad, options.guess_std_rad, latency);
    return candidates;
  }
  for (double latency : circle_latencies(options)) {
    for (std::size_t i = 0; i < kCoarseCircle; ++i)
      add(2.0 * kPi * static_cast<double>(i) / kCoarseCircle, options.grid_std_rad, latency);
  }
  for (const HeadingSeed& seed : options.seeds) add(seed.heading_rad, options.grid_std_rad, seed.latency_s);
  return candidates;
}

std::vector<HeadingCandidate> whole_circle(const HeadingSearchOptions& options, const FlightParameters& parameters) {
  std::vector<HeadingCandidate> candidates;
  const int n = static_cast<int>(std::ceil(2.0 * kPi / options.grid_step_rad - 1e-9));
  candidates.reserve(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) candidates.push_back({i * 2.0 * kPi / n, options.grid_std_rad, false, {}, parameters});
  return candidates;
}

}  // namespace liealign
