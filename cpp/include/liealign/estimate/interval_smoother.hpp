// The smoother over intervals, in blocks of nodes: memory grows with the blocks, by some kB for 32 nodes.
//
// Three passes. Forward: the filter, of which the state at the start of each block is kept. Backward: each block is run
// again, and lambda and Lambda of (Eq. 30) go back through it from node to node, of which those at its end are kept. Out: each
// block is run once more, and smoothed inside its intervals, in the order of time. Blocks of the last pass and the runs
// of the second are independent of each other: threads go over them, and the bits do not depend on their number.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "liealign/core/progress.hpp"
#include "liealign/estimate/inside_interval.hpp"

namespace liealign {

// A forward pass as the smoother needs it.
template <int tail>
struct ForwardRun {
  std::vector<RunState<tail>> blocks;  // where each begins
  RunState<tail> end;                  // after the last observation
};

// An epoch at a node, of the vehicle and the receiver's error.
struct NodeBelief {
  Belief<LieModel<double>> belief;
  ErrorCorrelation<double> error;
  Matrix3d root;  // as InsideInterval::root()
};
template <int tail>
NodeBelief node_belief(const Belief<LieModel<double, tail>>& belief, const Matrix3d& root) {
  return {without_tail(belief), error_correlation(belief), root};
}

// What the forward pass tells: updated() of each observation, node() after those of one time, and the filter's epochs at the
// stamps of samples that are wanted(), in the order of time: at a node, and a few inside an interval.
struct FilterSink {
  std::function<bool(std::size_t k)> wanted = [](std::size_t) { return false; };
  std::function<void(std::size_t k, const NodeBelief& filtered)> epoch = {};
  std::function<void(const SampleLanes& samples, const InsideInterval& filtered)> inside = {};
  std::function<void(const Observation& observation, const Innovation<double>& innovation)> updated = {};
  std::function<void(std::size_t next)> node = {};  // `next`: the first observation to come
};

// What the smoother gives, in parts that several threads make: each lies in a slot of its own until it is taken.
struct SmootherSink {
  std::function<bool(std::size_t k)> wanted;  // whether the epoch on the stamp of sample k is
  // In order of time within a part: an epoch at a node, and a few inside an interval, from its samples up to there.
  std::function<void(std::size_t slot, std::size_t k, const NodeBelief& smoothed)> epoch;
  std::function<void(std::size_t slot, const SampleLanes& samples, const InsideInterval& smoothed)> inside;
  // After the updates of a node.
  std::function<void(std::size_t slot, double t_s, const NodeBelief& filtered, const NodeBelief& smoothed)> node;
  std::function<void(std::size_t slot)> made;
  // One at a time, parts in order of time.
  std::function<void(std::size_t slot)> take;
};

// The forward pass from a belief that holds at `start` through all observations; what the smoother needs of it.
// The tails that there are: kNoTail, kShortTail, kLongTail. Throws NumericalError.
template <int tail>
ForwardRun<tail> run_forward(const FlightData& data, const FilterOptions& options,
                             const Belief<LieModel<double, tail>>& belief, const ImuCursor& start,
                             const FilterSink& sink = {});

// Throws NumericalError, Cancelled.
template <int tail>
void smooth_run(const FlightData& data, const FilterOptions& options, const ForwardRun<tail>& run,
                const SmootherSink& sink, const Progress& progress = {});

// The smoothed belief at the start of a run. Throws NumericalError.
template <int tail>
Belief<LieModel<double, tail>> smoothed_at_start(const FlightData& data, const FilterOptions& options,
                                                 const ForwardRun<tail>& run);

}  // namespace liealign
