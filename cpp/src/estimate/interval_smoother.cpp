// The backward pass over blocks, and the pass that gives the epochs.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/interval_smoother.hpp"

#include "liealign/core/error.hpp"
#include "liealign/estimate/parts.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;

struct SilentRun {
  void updated(const Event&, UpdateKind, const Innovation<double>&) {}
  void inside(std::size_t, const Preintegrated<double>&) {}
  static bool wanted(std::size_t) { return false; }
  void epoch(std::size_t, const Belief<Model>&) {}
  void inside(const SampleLanes&, const InsideInterval<Lanes>&) {}
  void node(const RunState&) {}
};

struct Problem {
  const FlightData& data;
  const FilterOptions& options;
  const ForwardRun& run;

  bool reset() const { return options.covariance_reset; }
};

// The forward pass through one block again.
std::vector<IntervalStep> steps_of(const Problem& p, std::size_t block) {
  std::vector<IntervalStep> steps;
  steps.reserve(kBlockNodes);
  RunState run = p.run.blocks[block];
  SilentRun silent;
  IntervalStep step;
  while (steps.size() < kBlockNodes && next_node(p.data, p.options, run, step, silent)) steps.push_back(step);
  return steps;
}

// From `smoothed` at the end of the block back to its start; keep(i, adjoint, belief) gets what holds at the start of step i.
template <typename Keep>
Belief<Model> back_through(const std::vector<IntervalStep>& steps, Belief<Model> smoothed, bool reset, Keep keep) {
  for (std::size_t i = steps.size(); i-- > 0;) {
    const Adjoint adjoint = adjoint_before(steps[i], smoothed, reset);
    smoothed = smoothed_before(steps[i], adjoint, reset);
    keep(i, adjoint, smoothed);
  }
  return smoothed;
}

// Smoothed beliefs at the start of each block, and the filter's at the very end.
std::vector<Belief<Model>> backward_pass(const Problem& p, const Progress& progress) {
  const std::size_t n = p.run.blocks.size();
  std::vector<Belief<Model>> smoothed(n + 1);
  smoothed[n] = p.run.end.belief;
  std::vector<std::vector<IntervalStep>> steps(part_slots());
  const auto nothing_kept = [](std::size_t, const Adjoint&, const Belief<Model>&) {};
  in_order(
      n, [&](std::size_t part, std::size_t slot) { steps[slot] = steps_of(p, n - 1 - part); },
      [&](std::size_t part, std::size_t slot) {
        const std::size_t block = n - 1 - part;
        smoothed[block] = back_through(steps[slot], smoothed[block + 1], p.reset(), nothing_kept);
        if (progress && !progress(part, 2 * n)) throw Cancelled("cancelled");
      });
  return smoothed;
}

void give_node(const Problem& p, const SmootherSink& sink, std::size_t slot, const ImuCursor& at, bool event,
               bool last_at_its_time, const Belief<Model>& filtered, const Belief<Model>& smoothed) {
  if (event) sink.event(slot, at.t_s, filtered, smoothed);
  if (last_at_its_time && p.data.imu()[at.k - 1].t_s == at.t_s && sink.wanted(at.k - 1)) {
    sink.epoch(slot, at.k - 1, smoothed);
  }
}

// Of the last event, where the smoother is the filter.
void give_end(const Problem& p, const SmootherSink& sink, std::size_t slot) {
  const RunState& end = p.run.end;
  give_node(p, sink, slot, end.at, end.at_event, true, end.belief, end.belief);
}

void give_block(const Problem& p, const SmootherSink& sink, std::size_t block, std::size_t slot,
                const Belief<Model>& smoothed_end) {
  const std::vector<IntervalStep> steps = steps_of(p, block);
  std::vector<Adjoint> adjoints(steps.size());
  std::vector<Belief<Model>> smoothed(steps.size());
  back_through(steps, smoothed_end, p.reset(), [&](std::size_t i, const Adjoint& adjoint, const Belief<Model>& s) {
    adjoints[i] = adjoint;
    smoothed[i] = s;
  });
  const ImuNoise& noise = p.options.dynamics.noise;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const IntervalStep& step = steps[i];
    give_node(p, sink, slot, step.from, step.from_event, step.pre.T > 0.0, step.before, smoothed[i]);
    if (step.pre.T == 0.0) continue;
    const InsideInterval<Lanes> inside(step, 0.5 * bias_variance(noise, step.pre.T), &adjoints[i], p.reset());
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
    preintegrate_to(step.end_s, p.data.imu(), step.before.X.second.x, noise, at, gather);
    give();
  }
  if (block + 1 == p.run.blocks.size()) give_end(p, sink, slot);
  sink.made(slot);
}

}  // namespace

void smooth_run(const FlightData& data, const FilterOptions& options, const ForwardRun& run, const SmootherSink& sink,
                const Progress& progress) {
  const Problem p{data, options, run};
  const std::vector<Belief<Model>> smoothed = backward_pass(p, progress);
  const std::size_t n = run.blocks.size();
  if (n == 0) {  // not one event
    give_end(p, sink, 0);
    sink.made(0);
    sink.take(0);
    return;
  }
  in_order(
      n, [&](std::size_t block, std::size_t slot) { give_block(p, sink, block, slot, smoothed[block + 1]); },
      [&](std::size_t block, std::size_t slot) {
        sink.take(slot);
        if (progress && !progress(n + block, 2 * n)) throw Cancelled("cancelled");
      });
}

Belief<Model> smoothed_at_start(const FlightData& data, const FilterOptions& options, const Belief<Model>& belief,
                                const ImuCursor& start) {
  SilentRun silent;
  const ForwardRun run = run_forward(data, options, {belief, start, {0, start.t_s}, 0, true}, silent);
  return backward_pass({data, options, run}, {}).front();
}

}  // namespace liealign
