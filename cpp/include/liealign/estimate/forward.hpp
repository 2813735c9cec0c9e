// The forward pass: from node to node through the IMU samples, with the observations of one time at each node.
//
// An observation between two samples splits the sample. The pass tells a visitor what it does; the smoother re-runs the same
// functions from its checkpoints, so both see the same bits.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include "liealign/estimate/adjoint.hpp"
#include "liealign/estimate/ekf.hpp"
#include "liealign/estimate/filter_options.hpp"
#include "liealign/estimate/flight_data.hpp"

namespace liealign {

// Where a pass stands in the IMU series: at time t_s, inside or at the start of sample k.
struct ImuCursor {
  std::size_t k = 1;
  double t_s = 0.0;
};

// The cursor of a pass that starts at t_s, not before the first sample.
inline ImuCursor cursor_at(const ImuSeries& imu, double t_s) {
  const auto later = [](double t, const ImuSample& s) { return t < s.t_s; };
  return {static_cast<std::size_t>(std::upper_bound(imu.begin() + 1, imu.end(), t_s, later) - imu.begin()), t_s};
}

// What the IMU reads at a time, as measured.
struct ImuReading {
  Vector3d omega_ib_b, f_ib_b;  // rad/s, m/s^2
};

// At the time of the cursor: samples are means, between the middles of two of them it is in between. A step from sample to
// sample would be one of the score as well, when a latency moves all fixes over their stamps at once.
inline ImuReading reading_at(const ImuSeries& imu, const ImuCursor& at) {
  const std::size_t k = std::min(at.k, imu.size() - 1);
  const auto middle = [&](std::size_t j) { return 0.5 * (imu[j - 1].t_s + imu[j].t_s); };
  const std::size_t after = at.t_s < middle(k) ? k : std::min(k + 1, imu.size() - 1), before = after - 1;
  if (before == 0) return {imu[after].omega_ib_b, imu[after].f_ib_b};
  const double share = std::clamp((at.t_s - middle(before)) / (middle(after) - middle(before)), 0.0, 1.0);
  return {imu[before].omega_ib_b + share * (imu[after].omega_ib_b - imu[before].omega_ib_b),
          imu[before].f_ib_b + share * (imu[after].f_ib_b - imu[before].f_ib_b)};
}

// Moves the belief to t_target. visitor.before(belief) precedes each step, visitor.after(belief, transition, k, whole)
// follows it; `whole` says that the step ended on the stamp of sample k.
template <typename Model, typename Visitor>
void propagate_to(const Ekf<Model>& ekf, const ImuSeries& imu, double t_target, ImuCursor& cursor,
                  Belief<Model>& belief, Visitor& visitor) {
  while (cursor.k < imu.size() && cursor.t_s < t_target) {
    const ImuSample& sample = imu[cursor.k];
    const bool whole = sample.t_s <= t_target;
    const double end = whole ? sample.t_s : t_target;
    visitor.before(belief);
    const NavTransition<typename Model::Scalar> t = ekf.predict(belief, sample, end - cursor.t_s);
    visitor.after(belief, t, cursor.k, whole);
    cursor.t_s = end;
    if (whole) ++cursor.k;
  }
}

// The re-acquisition rule: after `reacquire_after` positions beyond the gate in a row, over three seconds at least (a
// fast receiver has as many in a turn that the model of its errors does not know), the filter, not the receiver, is
// taken to be wrong. It is off by z, gathered since the last position inside the gate, tau ago: position variance grows
// by |z|^2, velocity variance by |z|^2/tau^2, and the fix is used in full.
struct Reacquisition {
  int beyond = 0;  // positions beyond the gate in a row
  double last_inside_s = 0.0;
};

// What a run remembers from observation to observation.
struct ObservationMemory {
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  Reacquisition reacquisition;
  std::size_t message = kNone;  // whose jitter is in the tail
};

// What an observation says of the error of a model.
template <typename Model>
Sighting<typename Model::Scalar> sight(const Observation& o, const FilterOptions& options, const ImuReading& imu,
                                       bool jitter_is_state, const Belief<Model>& belief,
                                       typename Ekf<Model>::Tall& Ht) {
  using Scalar = typename Model::Scalar;
  constexpr bool kHasTail = Model::kTailDim > 0;
  const Vector<Scalar, 6> b = biases(belief.X);
  StateView<Scalar> view{belief.X.first,
                         imu.omega_ib_b.cast<Scalar>() - b.template tail<3>(),
                         imu.f_ib_b.cast<Scalar>() - b.template head<3>(),
                         b.template tail<3>(),
                         TailVector<Scalar>::Zero(),
                         kHasTail,
                         options.dynamics.noise.gyro_arw,
                         jitter_is_state ? 0.0 : options.tail.jitter_s * options.tail.jitter_s};
  if constexpr (kHasTail) {
    view.tail.template head<Model::kTailDim>() = belief.X.second.x.template tail<Model::kTailDim>();
    if (!jitter_is_state) view.tail[kTailJitter] = Scalar(0);
  }
  Sighting<Scalar> seen;
  see(view, o, seen);
  Model::error_columns(belief.X, seen.H);
  Ht.template topRows<kTail>() = seen.H.transpose();
  if constexpr (kHasTail) {
    if (!jitter_is_state) seen.H_tail.col(kTailJitter).setZero();
    Ht.template bottomRows<Model::kTailDim>() = seen.H_tail.template leftCols<Model::kTailDim>().transpose();
  }
  return seen;
}

// The parts of the tail that start anew with this observation. Returns whether the jitter of its message is a state.
template <typename Model>
bool redraw_for(const Observation& o, const Ekf<Model>& ekf, const FilterOptions& options, ObservationMemory& memory,
                Belief<Model>& belief, NodeChanges<Model>* changes) {
  if constexpr (Model::kTailDim == 0) {
    return false;
  } else {
    using Kind = typename NodeChange<Model>::Kind;
    const auto note = [&](Kind kind) {
      if (changes == nullptr) return;
      changes->emplace_back();
      changes->back().kind = kind;
    };
    if (o.new_datum) {
      const SquareMatrix<double, kLongTail> prior = tail_prior(options.tail);
      ekf.forget_tail(belief, kTailC, 3);
      belief.P.template block<3, 3>(kTail + kTailC, kTail + kTailC) = prior.block<3, 3>(kTailC, kTailC);
      if constexpr (Model::kTailDim == kLongTail) {
        ekf.forget_tail(belief, kTailU, 3);
        belief.P.template block<3, 3>(kTail + kTailU, kTail + kTailU) = prior.block<3, 3>(kTailU, kTailU);
        belief.P.template block<3, 3>(kTail + kTailC, kTail + kTailU) = prior.block<3, 3>(kTailC, kTailU);
        belief.P.template block<3, 3>(kTail + kTailU, kTail + kTailC) = prior.block<3, 3>(kTailU, kTailC);
      }
      note(Kind::datum_redrawn);
    }
    if (!o.kind->has_jitter || options.tail.jitter_s == 0.0 || o.record == memory.message) return true;
    // A message that is overtaken by the next one, as when velocities come late, keeps its jitter in R.
    if (memory.message != ObservationMemory::kNone && o.record < memory.message) return false;
    memory.message = o.record;
    ekf.forget_tail(belief, kTailJitter, 1);
    belief.P(kTail + kTailJitter, kTail + kTailJitter) = options.tail.jitter_s * options.tail.jitter_s;
    note(Kind::jitter_redrawn);
    return true;
  }
}

// One observation through its gate.
template <typename Model>
Innovation<typename Model::Scalar> update(const Observation& o, const Ekf<Model>& ekf, const FilterOptions& options,
                                          const ImuReading& imu, ObservationMemory& memory, Belief<Model>& belief,
                                          NodeChanges<Model>* changes) {
  using Scalar = typename Model::Scalar;
  using Tall = typename Ekf<Model>::Tall;
  const bool jitter_is_state = redraw_for(o, ekf, options, memory, belief, changes);
  Tall Ht, PHt;
  const Sighting<Scalar> seen = sight(o, options, imu, jitter_is_state, belief, Ht);
  Innovation<Scalar> innovation = ekf.innovate(belief, seen, Ht, o.kind->blocks, PHt);
  const Gate* gate = options.gate_of(o.kind->gate);
  Scalar weight = gate == nullptr ? Scalar(1) : gate_weight(*gate, innovation.nis);
  bool yields = false;
  if (o.kind->gate == GateClass::position) {
    Reacquisition& state = memory.reacquisition;
    state.beyond = weight < Scalar(1) ? state.beyond + 1 : 0;
    const double tau = o.t_s - state.last_inside_s;
    if (state.beyond == 0) state.last_inside_s = o.t_s;
    constexpr double kLeast_s = 3.0;
    yields = options.reacquire_after > 0 && state.beyond > options.reacquire_after && tau >= kLeast_s;
    if (yields) {
      state = {0, o.t_s};
      const Scalar z2 = seen.z.squaredNorm();
      belief.P.diagonal().template segment<3>(kRho).array() += z2;
      belief.P.diagonal().template segment<3>(kNu).array() += z2 / Scalar(tau * tau);
      innovation = ekf.innovate(belief, seen, Ht, o.kind->blocks, PHt);
      weight = Scalar(1);
    }
  }
  Correction<Model>* note = nullptr;
  if (changes != nullptr && !(weight == Scalar(0))) note = &changes->emplace_back().correction;
  ekf.correct(belief, innovation, Ht, PHt, weight, note);
  if (yields) innovation.verdict = Verdict::reacquired;
  return innovation;
}

// The observations of one time, from number `next` on, which becomes the first later one. visitor.updated(observation,
// innovation) follows each.
template <typename Model, typename Visitor>
void update_at_node(const Ekf<Model>& ekf, const FlightData& data, const FilterOptions& options, const ImuReading& imu,
                    std::size_t& next, ObservationMemory& memory, Belief<Model>& belief, NodeChanges<Model>* changes,
                    Visitor& visitor) {
  const std::vector<Observation>& all = data.observations;
  const double t_s = all[next].t_s;
  for (; next < all.size() && all[next].t_s == t_s; ++next) {
    const Observation& o = all[next];
    visitor.updated(o, update(o, ekf, options, imu, memory, belief, changes));
    if (o.kind->gate == GateClass::none) memory.reacquisition.last_inside_s = t_s;
  }
}

// How a pass moves from node to node: sample by sample, as here, or by preintegrated intervals (ByIntervals).
struct BySamples {
  const ImuSeries& imu;
  ImuCursor at;

  template <typename Model, typename Visitor>
  void move_to(double t_target, const Ekf<Model>& ekf, Belief<Model>& belief, Visitor& visitor) {
    propagate_to(ekf, imu, t_target, at, belief, visitor);
  }
  ImuReading reading() const { return reading_at(imu, at); }
  ImuCursor cursor() const { return at; }
};

// Runs from where `motion` stands through all nodes up to t_end. Besides before() and after() of propagate_to and updated()
// the visitor gets
//   visitor.node(next, belief, cursor, changes)   after all updates of a node; next is the first observation to come.
// A visitor that keeps_changes gets what the smoother needs, the others nothing.
template <typename Motion, typename Model, typename Visitor>
void forward_pass(Motion& motion, const FlightData& data, const FilterOptions& options, Belief<Model>& belief,
                  double t_end, Visitor& visitor) {
  const Ekf<Model> ekf{options.dynamics, options.covariance_reset, options.tail};
  const double begin_s = motion.cursor().t_s;
  ObservationMemory memory{{0, begin_s}, ObservationMemory::kNone};
  NodeChanges<Model> changes;
  std::size_t next = 0;
  while (next < data.observations.size() && data.observations[next].t_s <= begin_s) ++next;
  while (next < data.observations.size() && data.observations[next].t_s <= t_end) {
    motion.move_to(data.observations[next].t_s, ekf, belief, visitor);
    changes.clear();
    update_at_node(ekf, data, options, motion.reading(), next, memory, belief,
                   Visitor::keeps_changes ? &changes : nullptr, visitor);
    visitor.node(next, belief, motion.cursor(), changes);
  }
}

// The same sample by sample; returns the cursor it stopped at.
template <typename Model, typename Visitor>
ImuCursor forward_pass(const FlightData& data, const FilterOptions& options, Belief<Model>& belief, ImuCursor cursor,
                       double t_end, Visitor& visitor) {
  BySamples motion{data.imu(), cursor};
  forward_pass(motion, data, options, belief, t_end, visitor);
  return motion.at;
}

// A visitor that does nothing; others take its members and shadow what they need.
template <typename Model>
struct SilentVisitor {
  using Scalar = typename Model::Scalar;
  static constexpr bool keeps_changes = false;
  void before(const Belief<Model>&) {}
  void after(const Belief<Model>&, const NavTransition<Scalar>&, std::size_t, bool) {}
  void updated(const Observation&, const Innovation<Scalar>&) {}
  void node(std::size_t, const Belief<Model>&, const ImuCursor&, const NodeChanges<Model>&) {}
};

}  // namespace liealign
