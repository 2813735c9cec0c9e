// IMU and GNSS as they would be logged: the perfect values of a Truth with noise, biases, lever arm and latency.
//
//   omega~_k = omega_k + b_g,k-1 + N_g / sqrt(dt) w,   f~_k = f_k + b_a,k-1 + N_a / sqrt(dt) w    (Eq. 45)
//   random walk:         b_k = b_{k-1} + q sqrt(dt) w                                             (Eq. 46)
//   Ornstein-Uhlenbeck:  b_k = beta + e^(-dt/tau) (b_{k-1} - beta) + sigma sqrt(1 - e^(-2 dt/tau)) w
//   y = p + C l + eps,   y_v = v + C (omega_ib x l) - omega_ie x C l + eps_v                      (Eq. 47)
//
// w, eps are white. Source: TAES V-B and (34). TAES prints the white noise without 1/sqrt(dt), and an Euler step for
// the bias in which tau multiplies dt, so that its tau is a rate (1/s); here the discretisation is exact and tau a time
// (s). The velocity of the antenna is Groves (2013) 14.3.2.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "liealign/core/types.hpp"
#include "liealign/ins/gnss.hpp"
#include "liealign/ins/imu.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {

// Of `noise` the gap fields are not used, and the bias walks only without ornstein_uhlenbeck.
struct ImuErrors {
  ImuNoise noise;
  Vector3d b_g_turn_on = Vector3d::Zero();  // rad/s; beta of (Eq. 46)
  Vector3d b_a_turn_on = Vector3d::Zero();  // m/s^2
  bool ornstein_uhlenbeck = false;
  double gyro_bias_sigma = 0.0;            // rad/s, instability: stationary sigma of the Ornstein-Uhlenbeck process
  double accel_bias_sigma = 0.0;           // m/s^2
  double bias_correlation_time_s = 100.0;  // tau
};

// b_a[k], b_g[k]: true biases at the stamp of sample k. As in the filter's model, the sample of step k carries the
// biases of epoch k-1, which walk afterwards.
struct SimulatedImu {
  ImuSeries log;
  std::vector<Vector3d> b_a;  // m/s^2
  std::vector<Vector3d> b_g;  // rad/s
};

// (Eq. 45)-(Eq. 46). The random walk starts at the turn-on bias, the Ornstein-Uhlenbeck process at a draw from its
// stationary distribution around it. White noise and bias noise are separate streams of the seed: switching one off
// leaves the other as it was. Throws Error for fewer than two samples, stamps that do not increase, negative sigmas or
// densities, or a correlation time that is not positive.
SimulatedImu add_imu_errors(const ImuSeries& perfect, const ImuErrors& errors, std::uint64_t seed);

struct GnssErrors {
  Vector3d std_ned_m = {0.01, 0.01, 0.03};
  double rate_hz = 1.0;
  Vector3d l_ba_b = Vector3d::Zero();  // m, IMU to antenna, body axes
  double latency_s = 0.0;              // stamp minus true time
  bool velocity = false;
  Vector3d velocity_std_ned = {0.03, 0.03, 0.05};  // m/s
  double outlier_probability = 0.0;                // per fix; its record does not say so
  double outlier_m = 5.0;                          // length of the offset, any direction
};

// (Eq. 47) at the multiples of 1 / rate_hz inside the truth, stamped t_true + latency_s; between epochs X is
// interpolated on the group, X_k exp(a log(X_k^-1 X_{k+1})), and the rate linearly between the middles of the samples.
// fix is 1. Throws Error for an empty or inconsistent truth, a rate that is not positive, a negative sigma, or a
// probability outside [0, 1].
std::vector<GnssRecord> simulate_gnss(const Truth& truth, const GnssErrors& errors, std::uint64_t seed);

// X at t_s by the same interpolation. Throws Error outside the truth (by more than 1 us).
SE23<double> truth_at(const Truth& truth, double t_s);

}  // namespace liealign
