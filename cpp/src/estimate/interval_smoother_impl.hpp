// Instantiated by interval_smoother_*.cpp, one tail each.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/error.hpp"
#include "liealign/estimate/interval_smoother.hpp"
#include "liealign/estimate/parts.hpp"

namespace liealign {
namespace detail {

inline constexpr std::size_t kBlockNodes = 32;

struct SilentRun {
  void updated(const Observation&, const Innovation<double>&) {}
  void inside(std::size_t, const Preintegrated<double>&) {}
};

template <int tail>
struct SmootherProblem {
  using Model = LieModel<double, tail>;
  const FlightData& data;
  const FilterOptions& options;
  const ForwardRun<tail>& run;

  bool reset() const { return options.covariance_reset; }

  // The forward pass through one block again.
  std::vector<IntervalStep<tail>> steps_of(std::size_t block) const {
    std::vector<IntervalStep<tail>> steps;
    steps.reserve(kBlockNodes);
    RunState<tail> state = run.blocks[block];
    SilentRun silent;
    IntervalStep<tail> step;
    while (steps.size() < kBlockNodes && next_node(data, options, state, step, silent)) steps.push_back(step);
    return steps;
  }

  // From what the future says at the end of the block back to its start; keep(i, adjoint) gets what holds at the start of
  // step i.
  template <typename Keep>
  Adjoint<Model> back_through(const std::vector<IntervalStep<tail>>& steps, Adjoint<Model> adjoint, Keep keep) const {
    for (std::size_t i = steps.size(); i-- > 0;) {
      const IntervalStep<tail>& step = steps[i];
      adjoint.back_through(step.changes, reset());
      const SE23<double> d{step.pre.dC, step.pre.dv, step.pre.dp};
      adjoint.back_over(interval_transition(StartAxes<double>(step.before.X.first, step.pre.T), d, step.pre),
                        tail_step(options.tail, step.pre.T));
      keep(i, adjoint);
    }
    return adjoint;
  }

  // What the future says at the end of each block, and at the start of the run in front.
  std::vector<Adjoint<Model>> backward_pass(const Progress& progress) const {
    const std::size_t n = run.blocks.size();
    std::vector<Adjoint<Model>> adjoints(n + 1);
    std::vector<std::vector<IntervalStep<tail>>> steps(part_slots());
    const auto nothing_kept = [](std::size_t, const Adjoint<Model>&) {};
    in_order(
        n, [&](std::size_t part, std::size_t slot) { steps[slot] = steps_of(n - 1 - part); },
        [&](std::size_t part, std::size_t slot) {
          const std::size_t block = n - 1 - part;
          adjoints[block] = back_through(steps[slot], adjoints[block + 1], nothing_kept);
          if (progress && !progress(part, 2 * n)) throw Cancelled("cancelled");
        });
    return adjoints;
  }

  void give_node(const SmootherSink& sink, std::size_t slot, const ImuCursor& at, bool observed, const Matrix3d& root,
                 const Belief<Model>& filtered, const Belief<Model>& smoothed) const {
    const NodeBelief belief = node_belief<tail>(smoothed, root);
    if (observed) sink.node(slot, at.t_s, node_belief<tail>(filtered, root), belief);
    if (data.imu()[at.k - 1].t_s == at.t_s && sink.wanted(at.k - 1)) sink.epoch(slot, at.k - 1, belief);
  }

  // The last node, where the smoother is the filter.
  void give_end(const SmootherSink& sink, std::size_t slot) const {
    give_node(sink, slot, run.end.at, run.end.observed, run.end.root, run.end.belief, run.end.belief);
  }

  void give_block(const SmootherSink& sink, std::size_t block, std::size_t slot, const Adjoint<Model>& at_end) const {
    const std::vector<IntervalStep<tail>> steps = steps_of(block);
    std::vector<Adjoint<Model>> adjoints(steps.size());
    back_through(steps, at_end, [&](std::size_t i, const Adjoint<Model>& adjoint) { adjoints[i] = adjoint; });
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const IntervalStep<tail>& step = steps[i];
      give_node(sink, slot, step.from, step.from_observed, step.root, step.before,
                adjoints[i].smoothed(step.before, reset()));
      const InsideInterval inside(AtStart<tail>{step, &adjoints[i]}, options);
      SampleLanes samples;
      const auto give = [&] {
        if (samples.count > 0) sink.inside(slot, samples, inside);
        samples.count = 0;
      };
      const auto gather = [&](std::size_t k, const Preintegrated<double>& pre) {
        if (sink.wanted(k)) samples.add(k, pre);
        if (samples.full()) give();
      };
      ImuCursor at = step.from;
      preintegrate_to(step.end_s, data.imu(), biases(step.before.X), options.dynamics.noise, at, gather);
      give();
    }
    if (block + 1 == run.blocks.size()) give_end(sink, slot);
    sink.made(slot);
  }
};

// Passes on what next_node() tells, and keeps the samples inside the interval that are wanted.
struct FilterTeller {
  const FilterSink& sink;
  std::vector<SampleLanes> samples = {};

  void updated(const Observation& o, const Innovation<double>& i) {
    if (sink.updated) sink.updated(o, i);
  }
  void inside(std::size_t k, const Preintegrated<double>& pre) {
    if (!sink.wanted(k)) return;
    if (samples.empty() || samples.back().full()) samples.emplace_back();
    samples.back().add(k, pre);
  }
};

}  // namespace detail

template <int tail>
ForwardRun<tail> run_forward(const FlightData& data, const FilterOptions& options,
                             const Belief<LieModel<double, tail>>& belief, const ImuCursor& start,
                             const FilterSink& sink) {
  const auto give_node = [&](const ImuCursor& at, const Belief<LieModel<double, tail>>& b, const Matrix3d& root) {
    if (data.imu()[at.k - 1].t_s == at.t_s && sink.wanted(at.k - 1)) sink.epoch(at.k - 1, node_belief<tail>(b, root));
  };
  RunState<tail> run = run_from<tail>(data, belief, start);
  ForwardRun<tail> result;
  IntervalStep<tail> step;
  detail::FilterTeller teller{sink};
  for (std::size_t node = 0; run.next < data.observations.size(); ++node) {
    if (node % detail::kBlockNodes == 0) result.blocks.push_back(run);
    next_node(data, options, run, step, teller);
    give_node(step.from, step.before, step.root);
    if (!teller.samples.empty()) {
      const InsideInterval filtered(AtStart<tail>{step, nullptr}, options);
      for (const SampleLanes& samples : teller.samples) sink.inside(samples, filtered);
      teller.samples.clear();
    }
    if (sink.node) sink.node(run.next);
  }
  give_node(run.at, run.belief, run.root);
  result.end = run;
  return result;
}

template <int tail>
void smooth_run(const FlightData& data, const FilterOptions& options, const ForwardRun<tail>& run,
                const SmootherSink& sink, const Progress& progress) {
  const detail::SmootherProblem<tail> problem{data, options, run};
  const std::vector<Adjoint<LieModel<double, tail>>> adjoints = problem.backward_pass(progress);
  const std::size_t n = run.blocks.size();
  if (n == 0) {  // not one observation
    problem.give_end(sink, 0);
    sink.made(0);
    sink.take(0);
    return;
  }
  in_order(
      n, [&](std::size_t block, std::size_t slot) { problem.give_block(sink, block, slot, adjoints[block + 1]); },
      [&](std::size_t block, std::size_t slot) {
        sink.take(slot);
        if (progress && !progress(n + block, 2 * n)) throw Cancelled("cancelled");
      });
}

template <int tail>
Belief<LieModel<double, tail>> smoothed_at_start(const FlightData& data, const FilterOptions& options,
                                                 const ForwardRun<tail>& run) {
  const detail::SmootherProblem<tail> problem{data, options, run};
  const RunState<tail>& start = run.blocks.empty() ? run.end : run.blocks.front();
  return problem.backward_pass({}).front().smoothed(start.belief, options.covariance_reset);
}

}  // namespace liealign
