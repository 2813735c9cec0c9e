// Filter and smoother sample by sample, for models and mechanizations that have no closed form over an interval.
// Instantiated for the Lie model, MEKF and Euler, once each.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "liealign/core/progress.hpp"
#include "liealign/estimate/chart_models.hpp"
#include "liealign/estimate/smoother.hpp"

namespace liealign {

// What the filter tells: its epochs at the stamps of wanted samples in the order of time (where something is observed, after its
// updates), and each update.
template <typename Model>
struct SampleFilterSink {
  std::function<bool(std::size_t k)> wanted;
  std::function<void(std::size_t k, const Belief<Model>& filtered)> epoch;
  std::function<void(const Observation& observation, const Innovation<double>& innovation)> updated;
  std::function<void(std::size_t next)> node = {};  // `next`: the first observation to come
};

// What the smoother tells, latest first.
template <typename Model>
struct SampleSmootherSink {
  std::function<bool(std::size_t k)> wanted;
  std::function<void(std::size_t k, const Belief<Model>& smoothed)> epoch;
  std::function<void(const Checkpoint<Model>& at, const Belief<Model>& smoothed)> node = {};
};

// From a belief that holds at `start` through all observations; the checkpoints that the smoother starts from. Throws
// NumericalError.
template <typename Model>
std::vector<Checkpoint<Model>> filter_samples(const FlightData& data, const FilterOptions& options,
                                              const Belief<Model>& belief, const ImuCursor& start,
                                              const SampleFilterSink<Model>& sink);

// Throws NumericalError, Cancelled.
template <typename Model>
void smooth_samples(const FlightData& data, const FilterOptions& options,
                    const std::vector<Checkpoint<Model>>& checkpoints, const SampleSmootherSink<Model>& sink,
                    const Progress& progress = {});

}  // namespace liealign
