// The forward pass over intervals that are preintegrated with the filter's own biases; it can be resumed at every node.
//
// A node is where an interval ends: where something is observed, or after a second without. Whoever resumes at a node does the
// same arithmetic, hence gets the same bits: a smoother need not keep what lies between.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/estimate/intervals.hpp"

namespace liealign {

// Where a pass stands: all it takes to go on.
template <int tail>
struct RunState {
  Belief<LieModel<double, tail>> belief;
  ImuCursor at;
  ObservationMemory memory;
  std::size_t next = 0;              // the first observation that has not updated the belief
  bool observed = true;              // whether something was observed here, or the run starts here
  Matrix3d root = Matrix3d::Zero();  // of the last position: what turns the tail's c into a position error in ECEF axes
};

// An interval, from after the updates at its start to before those at its end.
template <int tail>
struct IntervalStep {
  Belief<LieModel<double, tail>> before;
  ImuCursor from;
  double end_s = 0.0;
  Preintegrated<double> pre;
  IntervalPull<double> pull;
  Matrix3d root = Matrix3d::Zero();
  NodeChanges<LieModel<double, tail>> changes;  // what the updates at its end did
  bool from_observed = true;                    // whether something was observed, or the run starts, at its start
};

// To the next node, into `step`; false after the last observation. visitor.updated() as in forward_pass, visitor.inside(k,
// pre) on the stamps of the samples inside.
template <int tail, typename Visitor>
bool next_node(const FlightData& data, const FilterOptions& options, RunState<tail>& run, IntervalStep<tail>& step,
               Visitor& visitor) {
  if (run.next == data.observations.size()) return false;
  const Ekf<LieModel<double, tail>> ekf{options.dynamics, options.covariance_reset, options.tail};
  const double observed_s = data.observations[run.next].t_s;
  step.before = run.belief;
  step.from = run.at;
  step.end_s = interval_end(run.at.t_s, observed_s);
  step.root = run.root;
  step.from_observed = run.observed;
  const auto inside = [&](std::size_t k, const Preintegrated<double>& pre) { visitor.inside(k, pre); };
  const Vector<double, 6> b = biases(run.belief.X);
  step.pre = preintegrate_to(step.end_s, data.imu(), b, options.dynamics.noise, run.at, inside);
  step.pull = ekf.predict(run.belief, step.pre, b);
  run.observed = step.end_s == observed_s;
  step.changes.clear();
  if (!run.observed) return true;
  const std::size_t first = run.next;
  update_at_node(ekf, data, options, reading_at(data.imu(), run.at), run.next, run.memory, run.belief, &step.changes,
                 visitor);
  for (std::size_t i = first; i < run.next; ++i) {
    if (data.observations[i].kind->gate == GateClass::position) run.root = data.observations[i].root;
  }
  return true;
}

// The start of a run: observations up to there have no say.
template <int tail>
RunState<tail> run_from(const FlightData& data, const Belief<LieModel<double, tail>>& belief, const ImuCursor& start) {
  RunState<tail> run{belief, start, {{0, start.t_s}, ObservationMemory::kNone}, 0, true, Matrix3d::Zero()};
  while (run.next < data.observations.size() && data.observations[run.next].t_s <= start.t_s) ++run.next;
  for (const Observation& o : data.observations) {
    if (o.kind->gate != GateClass::position) continue;
    run.root = o.root;
    if (o.t_s > start.t_s) break;
  }
  return run;
}

}  // namespace liealign
