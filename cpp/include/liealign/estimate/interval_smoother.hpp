// The smoother over intervals, in blocks of nodes: memory grows with the blocks, by some 2 kB for 32 nodes.
//
// Three passes. Forward: the filter, of which the state at the start of each block is kept. Backward: each block is run
// again and smoothed from node to node, of which the smoothed belief at the start of each block is kept. Out: each block is
// run and smoothed once more, and smoothed inside its intervals, in the order of time. Blocks of the last pass and the runs
// of the second are independent of each other: threads go over them, and the bits do not depend on their number.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "liealign/core/progress.hpp"
#include "liealign/estimate/inside_interval.hpp"

namespace liealign {

// A forward pass as the smoother needs it.
struct ForwardRun {
  std::vector<RunState> blocks;  // where each begins
  RunState end;                  // after the last event
};

inline constexpr std::size_t kBlockNodes = 32;

// Passes on what next_node() tells, and keeps the samples inside the interval that are wanted.
template <typename Visitor>
struct WantedSamples {
  Visitor& visitor;
  std::vector<SampleLanes> samples = {};

  void updated(const Event& event, UpdateKind kind, const Innovation<double>& i) { visitor.updated(event, kind, i); }
  void inside(std::size_t k, const Preintegrated<double>& pre) {
    if (!visitor.wanted(k)) return;
    if (samples.empty() || samples.back().full()) samples.emplace_back();
    samples.back().add(k, pre);
  }
};

// From `run` through all events. The visitor gets updated() as in next_node(), node(run) after each, and for the stamps
// of samples k that are wanted(k) the filter's epochs in the order of time: epoch(k, belief) at a node,
// inside(samples, InsideInterval) between two.
template <typename Visitor>
ForwardRun run_forward(const FlightData& data, const FilterOptions& options, RunState run, Visitor& visitor) {
  const auto give_node = [&](const ImuCursor& at, const Belief<LieModel<double>>& belief) {
    if (data.imu()[at.k - 1].t_s == at.t_s && visitor.wanted(at.k - 1)) visitor.epoch(at.k - 1, belief);
  };
  ForwardRun result;
  IntervalStep step;
  WantedSamples<Visitor> inside{visitor};
  for (std::size_t node = 0; run.next_event < data.events.size(); ++node) {
    if (node % kBlockNodes == 0) result.blocks.push_back(run);
    next_node(data, options, run, step, inside);
    if (step.pre.T > 0.0) give_node(step.from, step.before);
    if (!inside.samples.empty()) {
      const Vector<double, 6> half_walk = 0.5 * bias_variance(options.dynamics.noise, step.pre.T);
      const InsideInterval<Lanes> filtered(step, half_walk, nullptr, options.covariance_reset);
      for (const SampleLanes& samples : inside.samples) visitor.inside(samples, filtered);
      inside.samples.clear();
    }
    visitor.node(run);
  }
  give_node(run.at, run.belief);
  result.end = run;
  return result;
}

// What the smoother gives, in parts that several threads make: each lies in a slot of its own until it is taken.
struct SmootherSink {
  using BeliefAt = Belief<LieModel<double>>;
  std::function<bool(std::size_t k)> wanted;  // whether the epoch on the stamp of sample k is
  // In order of time within a part: an epoch at a node, and a few inside an interval, from its samples up to there.
  std::function<void(std::size_t slot, std::size_t k, const BeliefAt& smoothed)> epoch;
  std::function<void(std::size_t slot, const SampleLanes& samples, const InsideInterval<Lanes>& smoothed)> inside;
  std::function<void(std::size_t slot, double t_s, const BeliefAt& filtered, const BeliefAt& smoothed)> event;
  std::function<void(std::size_t slot)> made;
  // One at a time, parts in order of time.
  std::function<void(std::size_t slot)> take;
};

// Throws NumericalError, Cancelled.
void smooth_run(const FlightData& data, const FilterOptions& options, const ForwardRun& run, const SmootherSink& sink,
                const Progress& progress = {});

// Filter from `belief`, which holds at `start`, through all events, and the smoothed belief back there. Throws NumericalError.
Belief<LieModel<double>> smoothed_at_start(const FlightData& data, const FilterOptions& options,
                                           const Belief<LieModel<double>>& belief, const ImuCursor& start);

}  // namespace liealign
