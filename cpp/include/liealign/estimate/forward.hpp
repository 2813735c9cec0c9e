// The forward pass: from event to event through the IMU samples, with a fix or a rest update at each event.
//
// A fix between two samples splits the sample. The pass tells a visitor what it does; the smoother re-runs the same
// functions from its checkpoints, so both see the same bits.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

#include "liealign/estimate/ekf.hpp"
#include "liealign/estimate/flight_data.hpp"
#include "liealign/ins/measurements.hpp"

namespace liealign {

struct FilterOptions {
  Dynamics dynamics;
  bool covariance_reset = true;
  Gate gate;  // of positions
  Gate velocity_gate;
  int reacquire_after = 5;  // positions beyond the gate in a row before the filter yields; 0 = never
  double zupt_std_mps = 0.005;
  double zaru_std_rps = 0.0;  // added to the gyro noise of the averaged rate
};

// The same options with both gates opened by these factors.
inline FilterOptions with_gates(FilterOptions options, const GateScales& scales) {
  options.gate = scaled(options.gate, scales.position);
  options.velocity_gate = scaled(options.velocity_gate, scales.velocity);
  return options;
}

// The same for a filter whose heading is not settled: a fix that it does not expect may be right. None is rejected, and only
// what lies five times as far as the gates loses weight, lest a gross outlier throws the filter.
inline FilterOptions opened(FilterOptions options) {
  constexpr double kOpen = 25.0;
  options = with_gates(options, {kOpen, kOpen});
  for (Gate* gate : {&options.gate, &options.velocity_gate}) {
    if (gate->outliers == Outliers::reject) gate->outliers = Outliers::weight;
  }
  return options;
}

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

// At the time of the cursor, rad/s, as measured: samples are means, between the middles of two of them it is in between. A step
// from sample to sample would be one of the score as well, when a latency moves all fixes over their stamps at once.
inline Vector3d omega_at(const ImuSeries& imu, const ImuCursor& at) {
  const std::size_t k = std::min(at.k, imu.size() - 1);
  const auto middle = [&](std::size_t j) { return 0.5 * (imu[j - 1].t_s + imu[j].t_s); };
  const std::size_t after = at.t_s < middle(k) ? k : std::min(k + 1, imu.size() - 1), before = after - 1;
  if (before == 0) return imu[after].omega_ib_b;
  const double share = (at.t_s - middle(before)) / (middle(after) - middle(before));
  return imu[before].omega_ib_b + std::clamp(share, 0.0, 1.0) * (imu[after].omega_ib_b - imu[before].omega_ib_b);
}

enum class UpdateKind { position, velocity, zero_velocity, zero_rate };

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

// One three-component measurement y with prediction (h, H) and covariance R, through the gate.
template <typename Model>
Innovation<typename Model::Scalar> gated_update(const Ekf<Model>& ekf, const Gate& gate, Belief<Model>& belief,
                                                const Vector3d& y, const Prediction<typename Model::Scalar>& m,
                                                const Matrix3d& R) {
  using Scalar = typename Model::Scalar;
  Innovation<Scalar> innovation = ekf.innovate(belief, y.cast<Scalar>() - m.h, m.H, R);
  ekf.correct(belief, innovation, m.H, gate_weight(gate, innovation.nis));
  return innovation;
}

// The re-acquisition rule: after `reacquire_after` positions beyond the gate in a row the filter, not the receiver, is taken
// to be wrong. It is off by z, gathered since the last position inside the gate, tau ago: position variance grows by |z|^2,
// velocity variance by |z|^2/tau^2, and the fix is used in full.
struct Reacquisition {
  int beyond = 0;  // positions beyond the gate in a row
  double last_inside_s = 0.0;
};

// Position update through the gate. P_predicted becomes the covariance the update started from.
template <typename Model>
Innovation<typename Model::Scalar> position_update(const Ekf<Model>& ekf, const FilterOptions& options,
                                                   const Vector3d& l_ba_b, const GnssFix& fix, Reacquisition& state,
                                                   Belief<Model>& belief, typename Model::Covariance& P_predicted) {
  using Scalar = typename Model::Scalar;
  const Prediction<Scalar> m = Model::gnss_position(belief.X, l_ba_b);
  const Vector3<Scalar> z = fix.p_ea_e.cast<Scalar>() - m.h;
  Innovation<Scalar> innovation = ekf.innovate(belief, z, m.H, fix.R_p_e);
  const Scalar weight = gate_weight(options.gate, innovation.nis);
  state.beyond = weight < Scalar(1) ? state.beyond + 1 : 0;
  const double tau = fix.t_s - state.last_inside_s;
  if (state.beyond == 0) state.last_inside_s = fix.t_s;
  if (options.reacquire_after <= 0 || state.beyond <= options.reacquire_after) {
    ekf.correct(belief, innovation, m.H, weight);
    return innovation;
  }
  state = {0, fix.t_s};
  const Scalar z2 = z.squaredNorm();
  belief.P.diagonal().template segment<3>(kRho).array() += z2;
  belief.P.diagonal().template segment<3>(kNu).array() += z2 / Scalar(tau * tau);
  P_predicted = belief.P;
  innovation = ekf.innovate(belief, z, m.H, fix.R_p_e);
  ekf.correct(belief, innovation, m.H, Scalar(1));
  innovation.verdict = Verdict::reacquired;
  return innovation;
}

// Zero velocity and zero rate, never gated: the rest detector has already decided.
template <typename Model, typename Visitor>
void rest_update(const Ekf<Model>& ekf, const FilterOptions& options, const Event& event, const RestUpdate& rest,
                 Belief<Model>& belief, Visitor& visitor) {
  const Gate open{Outliers::off, options.gate.kappa};
  const double zupt = options.zupt_std_mps, zaru = options.zaru_std_rps, arw = options.dynamics.noise.gyro_arw;
  const Matrix3d R_v = zupt * zupt * Matrix3d::Identity();
  // What the means scatter by is seen, and may be more than the gyro's own noise.
  const Vector3d noise = rest.std_omega_ib_b.cwiseAbs2().cwiseMax(arw * arw / rest.duration_s);
  const Matrix3d R_w = (noise.array() + zaru * zaru).matrix().asDiagonal();
  visitor.updated(event, UpdateKind::zero_velocity,
                  gated_update(ekf, open, belief, Vector3d::Zero(), Model::zero_velocity(belief.X), R_v));
  visitor.updated(event, UpdateKind::zero_rate,
                  gated_update(ekf, open, belief, rest.mean_omega_ib_b, Model::zero_rate(belief.X), R_w));
}

// How a pass moves from event to event: sample by sample, as here, or by preintegrated intervals (ByIntervals).
struct BySamples {
  const ImuSeries& imu;
  ImuCursor at;

  template <typename Model, typename Visitor>
  void move_to(double t_target, const Ekf<Model>& ekf, Belief<Model>& belief, Visitor& visitor) {
    propagate_to(ekf, imu, t_target, at, belief, visitor);
  }
  Vector3d omega() const { return omega_at(imu, at); }
  ImuCursor cursor() const { return at; }
};

// The updates of event i, with the gyros reading omega_ib_b [rad/s]. visitor.updated(event, kind, innovation) follows each.
// P_predicted becomes the covariance they started from (enlarged where the filter yielded).
template <typename Model, typename Visitor>
void update_at_event(const Ekf<Model>& ekf, const FlightData& data, const FilterOptions& options, std::size_t i,
                     const Vector3d& omega_ib_b, Reacquisition& reacquisition, Belief<Model>& belief,
                     typename Model::Covariance& P_predicted, Visitor& visitor) {
  const Event& event = data.events[i];
  P_predicted = belief.P;
  if (event.kind == Event::Kind::rest) {
    rest_update(ekf, options, event, data.rests[event.index], belief, visitor);
    reacquisition.last_inside_s = event.t_s;
    return;
  }
  const GnssFix& fix = data.fixes[event.index];
  visitor.updated(event, UpdateKind::position,
                  position_update(ekf, options, data.l_ba_b, fix, reacquisition, belief, P_predicted));
  if (!fix.has_velocity) return;
  visitor.updated(event, UpdateKind::velocity,
                  gated_update(ekf, options.velocity_gate, belief, fix.v_ea_e,
                               Model::gnss_velocity(belief.X, data.l_ba_b, omega_ib_b), fix.R_v_e));
}

// Runs from where `motion` stands through all events up to t_end. Besides before() and after() of propagate_to and
// updated() the visitor gets
//   visitor.checkpoint(event_index, belief, cursor, X_predicted, P_predicted)   after all updates of an event.
template <typename Motion, typename Model, typename Visitor>
void forward_pass(Motion& motion, const FlightData& data, const FilterOptions& options, Belief<Model>& belief,
                  double t_end, Visitor& visitor) {
  const Ekf<Model> ekf{options.dynamics, options.covariance_reset};
  const double begin_s = motion.cursor().t_s;  // of two events at one time both count
  Reacquisition reacquisition{0, begin_s};
  for (std::size_t i = 0; i < data.events.size(); ++i) {
    const Event& event = data.events[i];
    if (event.t_s <= begin_s) continue;
    if (event.t_s > t_end) break;
    motion.move_to(event.t_s, ekf, belief, visitor);
    const typename Model::State X_predicted = belief.X;
    typename Model::Covariance P_predicted;
    update_at_event(ekf, data, options, i, motion.omega(), reacquisition, belief, P_predicted, visitor);
    visitor.checkpoint(i, belief, motion.cursor(), X_predicted, P_predicted);
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
  void before(const Belief<Model>&) {}
  void after(const Belief<Model>&, const NavTransition<Scalar>&, std::size_t, bool) {}
  void updated(const Event&, UpdateKind, const Innovation<Scalar>&) {}
  void checkpoint(std::size_t, const Belief<Model>&, const ImuCursor&, const typename Model::State&,
                  const typename Model::Covariance&) {}
};

}  // namespace liealign
