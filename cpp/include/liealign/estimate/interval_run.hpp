// The forward pass over intervals that are preintegrated with the filter's own biases; it can be resumed at every node.
//
// A node is where an interval ends: at an event, or after a second without one. Whoever resumes at a node does the same
// arithmetic, hence gets the same bits: a smoother need not keep what lies between.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/estimate/intervals.hpp"
#include "liealign/estimate/lie_model.hpp"

namespace liealign {

// Where a pass stands: all it takes to go on.
struct RunState {
  Belief<LieModel<double>> belief;
  ImuCursor at;
  Reacquisition reacquisition;
  std::size_t next_event = 0;  // the first one that has not updated the belief
  bool at_event = true;        // whether an event, or the start of the run, stands here
};

// An interval, from after the updates at its start to before those at its end.
struct IntervalStep {
  Belief<LieModel<double>> before;
  ImuCursor from;
  double end_s = 0.0;
  Preintegrated<double> pre;  // T = 0 between two events at one time
  IntervalPull<double> pull;
  Belief<LieModel<double>> predicted;
  bool from_event = true;  // whether an event, or the start of the run, stands at its start
};

// To the next node, into `step`; false after the last event. visitor.updated() as in forward_pass;
template <typename Visitor>
bool next_node(const FlightData& data, const FilterOptions& options, RunState& run, IntervalStep& step,
               Visitor& visitor) {
  if (run.next_event == data.events.size()) return false;
  const Ekf<LieModel<double>> ekf{options.dynamics, options.covariance_reset};
  const double event_s = data.events[run.next_event].t_s;
  step.before = run.belief;
  step.from = run.at;
  step.end_s = interval_end(run.at.t_s, event_s);
  step.pull = {};
  step.from_event = run.at_event;
  const auto inside = [&](std::size_t k, const Preintegrated<double>& pre) { visitor.inside(k, pre); };
  step.pre = preintegrate_to(step.end_s, data.imu(), run.belief.X.second.x, options.dynamics.noise, run.at, inside);
  if (step.pre.T > 0.0) {
    step.pull = ekf.predict(run.belief, step.pre, run.belief.X.second.x);
  }
  step.predicted = run.belief;
  run.at_event = step.end_s == event_s;
  if (run.at_event) {
    update_at_event(ekf, data, options, run.next_event++, omega_at(data.imu(), run.at), run.reacquisition, run.belief,
                    step.predicted.P, visitor);
  }
  return true;
}

}  // namespace liealign
