// Which candidates the first stages of a heading search run: grids of noise scales and of headings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/align/heading_search.hpp"

namespace liealign {

inline constexpr std::size_t kCoarseCircle = 8;  // headings of a ring

// A coarse grid of scales, at the two best headings of the coarse stage or, without any, at four over the circle.
std::vector<HeadingCandidate> scale_grid(const HeadingSearchOptions& options);

// On either side of the latency of each seed: a gentle flight shows it less sharply than the coarse stage takes it for.
inline constexpr double kLatencyScan_s = 0.4;
std::vector<HeadingCandidate> latency_scan(const HeadingSearchOptions& options, const FlightParameters& parameters);

// The latencies of the rings: those of the coarse stage; without it every fifth of a second.
std::vector<double> circle_latencies(const HeadingSearchOptions& options);

// A ring of kCoarseCircle headings for each latency, then the seeds; with a guess that alone for each latency.
std::vector<HeadingCandidate> coarse_circle(const HeadingSearchOptions& options, const FlightParameters& parameters);

// A ring of the whole grid.
std::vector<HeadingCandidate> whole_circle(const HeadingSearchOptions& options, const FlightParameters& parameters);

}  // namespace liealign
