// D-LIE-RTS: the Rauch-Tung-Striebel smoother on a Lie group, over any Model.
//
//   G = P_{k|k} F^T P_{k+1|k}^-1,   z_s = log(X_{k+1|k}^-1 X^s_{k+1})                              (Eq. 30)
//   X^s_k = X_{k|k} exp(G z_s)                                                                  (Eq. 31)
//   P^s_k = J_1 [P_{k|k} + G (J_0 P^s_{k+1} J_0^T - P_{k+1|k}) G^T] J_1^T,  J_0 = J_r^-1(z_s),  J_1 = J_r(G z_s)   (Eq. 32)
//
// Source: TAES (15). Beyond it: J_0 carries P^s_{k+1} to the predicted tangent and J_1 carries the result to the
// smoothed one (`covariance_reset`; without it both are the identity).
//
// The forward pass keeps a checkpoint at each event only. The backward pass re-runs an interval from its checkpoint (the
// same arithmetic, hence the same bits) and smooths inside it: memory grows with the events, not with the samples.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "liealign/core/progress.hpp"
#include "liealign/estimate/forward.hpp"

namespace liealign {

// Wants all of them.
inline constexpr auto kEverySample = [](std::size_t) { return true; };

// What the forward pass leaves at an event.
template <typename Model>
struct Checkpoint {
  Belief<Model> updated;    // after the event's updates
  ImuCursor cursor;         // at the event
  Belief<Model> predicted;  // what its updates started from
};

template <typename Model>
struct Smoother {
  using Scalar = typename Model::Scalar;
  using Covariance = typename Model::Covariance;

  Ekf<Model> ekf;

  // One step back: `next` is the smoothed belief at k+1, `predicted` X_{k+1|k} and P_{k+1|k}, `filtered` X_{k|k}, P_{k|k}.
  Belief<Model> step(const Belief<Model>& filtered, const NavTransition<Scalar>& t, const Belief<Model>& predicted,
                     const Belief<Model>& next) const {
    // F P_{k|k}, with F = [F B; 0 I].
    Covariance FP;
    FP.template topRows<9>() = t.F * filtered.P.template topRows<9>() + t.B * filtered.P.template bottomRows<6>();
    FP.template bottomRows<6>() = filtered.P.template bottomRows<6>();
    const Eigen::LLT<Covariance> llt(predicted.P);
    if (llt.info() != Eigen::Success) throw NumericalError("smoother: a predicted covariance is not positive definite");
    const Covariance G = llt.solve(FP).transpose();

    const typename Model::Tangent z_s = Model::local(predicted.X, next.X);
    const typename Model::Tangent eps = G * z_s;
    Covariance P_next = next.P;
    if (ekf.covariance_reset) {
      const Covariance J_0 = Model::right_jacobian_inverse(z_s);
      P_next = (J_0 * next.P * J_0.transpose()).eval();
    }
    Belief<Model> smoothed{Model::retract(filtered.X, eps), filtered.P + G * (P_next - predicted.P) * G.transpose()};
    if (ekf.covariance_reset) {
      const Covariance J_1 = Model::right_jacobian(eps);
      smoothed.P = (J_1 * smoothed.P * J_1.transpose()).eval();
    }
    Ekf<Model>::symmetrise(smoothed.P);
    return smoothed;
  }

  // Smooths the interval from checkpoint `from` to the event at t_next, whose smoothed belief is `next` and whose
  // predicted belief (as its updates used it) is `predicted`. emit(k, belief) is called with the smoothed belief at each
  // IMU stamp inside (from, t_next) that is wanted(k), latest first. Returns the smoothed belief at `from`. Between two of
  // them nothing is measured: their transitions are one, and the step is as long.
  template <typename Wanted, typename Emit>
  Belief<Model> interval(const ImuSeries& imu, const Checkpoint<Model>& from, double t_next,
                         const Belief<Model>& predicted, const Belief<Model>& next, const Wanted& wanted,
                         Emit& emit) const {
    Recorder<Wanted> recorder{wanted};
    Belief<Model> belief = from.updated;
    ImuCursor cursor = from.cursor;
    propagate_to(ekf, imu, t_next, cursor, belief, recorder);
    Belief<Model> smoothed = next;
    for (std::size_t i = recorder.steps.size(); i-- > 0;) {
      const bool last = i + 1 == recorder.steps.size();
      smoothed = step(recorder.steps[i].before, recorder.steps[i].transition,
                      last ? predicted : recorder.steps[i + 1].before, smoothed);
      if (i > 0) emit(recorder.steps[i - 1].k, smoothed);
    }
    return smoothed;
  }

 private:
  // From `before` to the stamp of sample k, or to the end of the interval.
  struct Step {
    Belief<Model> before;
    NavTransition<Scalar> transition;
    std::size_t k;
  };
  template <typename Wanted>
  struct Recorder {
    const Wanted& wanted;
    std::vector<Step> steps = {};
    Belief<Model> held = {};
    bool ended = true;  // the last step
    void before(const Belief<Model>& belief) {
      if (ended) held = belief;
    }
    void after(const Belief<Model>&, const NavTransition<Scalar>& t, std::size_t k, bool whole) {
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
};

// The whole backward pass: `checkpoints` in time order, one per event, the first one the start of the run.
// emit(k, belief) at every IMU stamp from the start to the last event that is wanted(k), latest first;
// at_checkpoint(i, belief) at each checkpoint. A stamp that carries an event is emitted once, from its checkpoint.
template <typename Model, typename Wanted, typename Emit, typename AtCheckpoint>
void smooth(const Ekf<Model>& ekf, const FlightData& data, const std::vector<Checkpoint<Model>>& checkpoints,
            const Wanted& wanted, Emit emit, AtCheckpoint at_checkpoint, const Progress& progress = {}) {
  const Smoother<Model> smoother{ekf};
  Belief<Model> smoothed = checkpoints.back().updated;
  for (std::size_t i = checkpoints.size(); i-- > 0;) {
    const ImuCursor& at = checkpoints[i].cursor;
    const bool last_at_its_time = i + 1 == checkpoints.size() || checkpoints[i + 1].cursor.t_s != at.t_s;
    if (last_at_its_time && data.imu()[at.k - 1].t_s == at.t_s && wanted(at.k - 1)) emit(at.k - 1, smoothed);
    at_checkpoint(i, smoothed);
    if (i == 0) break;
    if (progress && i % (1 + checkpoints.size() / 100) == 0 && !progress(checkpoints.size() - i, checkpoints.size())) {
      throw Cancelled("cancelled");
    }
    smoothed =
        smoother.interval(data.imu(), checkpoints[i - 1], at.t_s, checkpoints[i].predicted, smoothed, wanted, emit);
  }
}

}  // namespace liealign
