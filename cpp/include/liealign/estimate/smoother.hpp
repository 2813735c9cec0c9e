// D-LIE-RTS sample by sample, over any Model without a tail: the smoother of (Eq. 30)-(Eq. 32) for what has no closed
// form over an interval.
//
// The forward pass keeps a checkpoint at each node only. The backward pass re-runs an interval from its checkpoint (the
// same arithmetic, hence the same bits) and smooths inside it: memory grows with the nodes, not with the samples.
// Source: TAES (15); `covariance_reset` carries lambda and Lambda through the resets of the forward pass.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/core/progress.hpp"
#include "liealign/estimate/forward.hpp"

namespace liealign {

// Wants all of them.
inline constexpr auto kEverySample = [](std::size_t) { return true; };

// What the forward pass leaves at a node.
template <typename Model>
struct Checkpoint {
  Belief<Model> updated;       // after the node's updates
  ImuCursor cursor;            // at the node
  NodeChanges<Model> changes;  // what its updates did
};

// The steps of an interval, from wanted sample to wanted sample: between two of them nothing is measured, and their
// transitions are one.
template <typename Model, typename Wanted>
struct StepRecorder {
  struct Step {
    Belief<Model> before;
    NavTransition<typename Model::Scalar> transition;
    std::size_t k;  // to the stamp of sample k, or to the end of the interval
  };
  const Wanted& wanted;
  std::vector<Step> steps = {};
  Belief<Model> held = {};
  bool ended = true;  // the last step

  void before(const Belief<Model>& belief) {
    if (ended) held = belief;
  }
  void after(const Belief<Model>&, const NavTransition<typename Model::Scalar>& t, std::size_t k, bool whole) {
    if (ended) {
      steps.push_back({held, t, k});
    } else {
      Step& step = steps.back();
      step.transition = {t.F * step.transition.F, t.F * step.transition.B + t.B};
      step.k = k;
    }
    ended = whole && wanted(k);
  }
};

// The whole backward pass: `checkpoints` in time order, one per node, the first one the start of the run.
// emit(k, belief) at every IMU stamp from the start to the last node that is wanted(k), latest first;
// at_checkpoint(i, belief) at each checkpoint. A stamp that carries a node is emitted once, from its checkpoint.
template <typename Model, typename Wanted, typename Emit, typename AtCheckpoint>
void smooth(const Ekf<Model>& ekf, const FlightData& data, const std::vector<Checkpoint<Model>>& checkpoints,
            const Wanted& wanted, Emit emit, AtCheckpoint at_checkpoint, const Progress& progress = {}) {
  const TailStep no_tail = tail_step({}, 0.0);
  Adjoint<Model> adjoint;
  for (std::size_t i = checkpoints.size(); i-- > 0;) {
    const Checkpoint<Model>& at = checkpoints[i];
    const Belief<Model> smoothed = adjoint.smoothed(at.updated, ekf.covariance_reset);
    if (data.imu()[at.cursor.k - 1].t_s == at.cursor.t_s && wanted(at.cursor.k - 1)) emit(at.cursor.k - 1, smoothed);
    at_checkpoint(i, smoothed);
    if (i == 0) break;
    if (progress && i % (1 + checkpoints.size() / 100) == 0 && !progress(checkpoints.size() - i, checkpoints.size())) {
      throw Cancelled("cancelled");
    }
    adjoint.back_through(at.changes, ekf.covariance_reset);
    StepRecorder<Model, Wanted> recorder{wanted};
    Belief<Model> belief = checkpoints[i - 1].updated;
    ImuCursor cursor = checkpoints[i - 1].cursor;
    propagate_to(ekf, data.imu(), at.cursor.t_s, cursor, belief, recorder);
    for (std::size_t j = recorder.steps.size(); j-- > 0;) {
      adjoint.back_over(recorder.steps[j].transition, no_tail);
      if (j > 0) emit(recorder.steps[j - 1].k, adjoint.smoothed(recorder.steps[j].before, ekf.covariance_reset));
    }
  }
}

}  // namespace liealign
