// What a GNSS receiver does to its positions and velocities, found by maximum likelihood from a few minutes of a flight.
//
//   theta* = argmin -log p(y_1:N | theta) + sum_i (ln theta_i - ln m_i)^2 / 2 s_i^2                    (Eq. 84)
//
// theta: the white parts of positions and velocities, the times of the correlated errors, the velocity's correlated error, the
// jitter of the stamps, the noise of gyros and accelerometers; m, s: their log-normal priors by the class of the fixes. The
// likelihood is that of the filter's innovations, (Eq. 33). The size of the correlated position error is not among them: a few
// minutes show sigma_c^2 / tau_c alone, so sigma_c is what the file states. Latencies are states of the filter, about which it
// is linearised again until they stay. Source: docs/gnss-errors.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "liealign/core/progress.hpp"
#include "liealign/estimate/interval_smoother.hpp"
#include "liealign/ins/receiver_log.hpp"

namespace liealign {

// What is known of a parameter before: its median and the standard deviation of its logarithm; none: it stays at the median.
struct LogNormal {
  double median = 1.0, log_std = 0.0;
  bool is_free() const { return log_std > 0.0; }
};

struct ReceiverPrior {
  double sigma_c = 1.0;  // of the correlated position error, in units of the stated std
  LogNormal tau_c_s, tau_u_s, white_scale, velocity_scale, sigma_s_mps, tau_s_s, jitter_s, gyro_scale, accel_scale;
};

// The priors of a class of fixes, measured on recordings; `arrival`: the stamps have been put back on the receiver's grid.
ReceiverPrior receiver_prior(FixClass of, bool has_velocity, bool arrival);

// theta.
struct ReceiverParameters {
  double sigma_c = 1.0, tau_c_s = 100.0, tau_u_s = 0.0;  // tau_u 0: of first order
  double white_scale = 1.0, velocity_scale = 1.0;        // on the stds that the file states
  double sigma_s_mps = 0.0, tau_s_s = 2.0;
  double jitter_s = 0.0;
  double gyro_scale = 1.0, accel_scale = 1.0;  // on the noise of the IMU
};

struct ReceiverLatency {
  double position_s = 0.0, velocity_s = 0.0;
  double position_std_s = 0.0, velocity_std_s = 0.0;  // one sigma; 0: given
  double time_s = 0.0;                                // when, where the clock drifts
};

struct ReceiverProblem {
  FlightData data;                 // `observations` by their stamps, with the covariance that the file states
  std::vector<Matrix3d> rounding;  // of each observation, added to its covariance
  FilterOptions filter;
  Belief<LieModel<double>> start;
  ImuCursor cursor;
  double fit_begin_s = 0.0, fit_end_s = 0.0;  // theta is found from the fixes in between, and the first of all
  ReceiverPrior prior;
  ReceiverLatency latency;           // to begin with; the std of its prior, 0: given
  double wide_position_std_m = 0.0;  // of the start: its first fix says where it is, with the error of that fix
  double baro_std_m = 0.0, baro_tau_s = 600.0;
  double latency_walk = 0.0;                               // s/sqrt(s): what the fixes' grid wanders by
  double start_gyro_scale = 1.0, start_accel_scale = 1.0;  // tried to begin with, beside the medians
};

struct ReceiverFit {
  ReceiverParameters parameters;
  ReceiverLatency latency;
  double latency_spread_s = 0.0;  // of the position's latency, between admissible models
  bool settled = false;
  int evaluations = 0;  // passes of the filter
};

// (Eq. 84). Throws NumericalError when no filter gets through.
ReceiverFit fit_receiver(const ReceiverProblem& problem, const Progress& progress = {});

// Where a filter about nominal latencies has found them.
template <int tail>
ReceiverLatency found_latency(const ReceiverLatency& nominal, const Belief<LieModel<double, tail>>& end) {
  const auto at = [&](int i) { return end.X.second.x[6 + i]; };
  const auto std_of = [&](int i) { return std::sqrt(end.P(kTail + i, kTail + i)); };
  return {nominal.position_s + at(kTailPositionLatency), nominal.velocity_s + at(kTailVelocityLatency),
          std_of(kTailPositionLatency), std_of(kTailVelocityLatency), nominal.time_s};
}

// The observations at the times and with the covariances that parameters and latencies give them.
FlightData with_receiver(const ReceiverProblem& problem, const ReceiverParameters& theta,
                         const ReceiverLatency& latency);
FilterOptions with_receiver(const ReceiverProblem& problem, const ReceiverParameters& theta);
// For the run from what was found.
FilterOptions with_receiver(const ReceiverProblem& problem, const ReceiverFit& fit);

// The start of a run with a tail: c by its prior, a position that the first fix will say, and latencies by a prior that
// stays where it was when they are linearised about another value: `latency_s`, from the nominal ones to the middle of
// their prior.
template <int tail>
Belief<LieModel<double, tail>> start_with_tail(const Belief<LieModel<double>>& start, const TailModel& model,
                                               double wide_position_std_m,
                                               const Vector<double, 2>& latency_s = Vector<double, 2>::Zero()) {
  Belief<LieModel<double, tail>> belief;
  belief.X.first = start.X.first;
  belief.X.second.x.template head<6>() = start.X.second.x;
  belief.X.second.x.template segment<2>(6 + kTailPositionLatency) = latency_s;
  belief.P.setZero();
  belief.P.template topLeftCorner<kTail, kTail>() = start.P;
  belief.P.template bottomRightCorner<tail, tail>() = tail_prior(model).template topLeftCorner<tail, tail>();
  belief.P.diagonal().template segment<3>(kRho).array() += wide_position_std_m * wide_position_std_m;
  return belief;
}

}  // namespace liealign
