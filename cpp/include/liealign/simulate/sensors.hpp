// IMU and GNSS as they would be logged: the perfect values of a Truth with the errors of sensors and of stamps.
//
//   omega~_k = omega_k + b_g,k-1 + N_g / sqrt(dt) w,   f~_k = f_k + b_a,k-1 + N_a / sqrt(dt) w    (Eq. 45)
//   random walk:         b_k = b_{k-1} + q sqrt(dt) w                                             (Eq. 46)
//   Ornstein-Uhlenbeck:  b_k = beta + e^(-dt/tau) (b_{k-1} - beta) + sigma sqrt(1 - e^(-2 dt/tau)) w
//   y = p + C l + eps,   y_v = v + C (omega_ib x l) - omega_ie x C l + eps_v                      (Eq. 47)
//   position at t = t_n + j,   velocity at t = t_n + L - L_v + j,   stamp t_n + L + d             (Eq. 73)
//   y~ = q round((y + c) / q),   y_v~ = q_v round((y_v + s) / q_v)                                (Eq. 74)
//   omega~_k += (diag(s_g) - [m_g x]) omega_k + n_g,   f~_k += (diag(s_a) - [m_a x]) f_k + n_a    (Eq. 75)
//
// w, eps are white; c, s, n_g, n_a are Gauss-Markov processes (Eq. 71)-(Eq. 72). Source: TAES V-B and (34). TAES prints
// the white noise without 1/sqrt(dt), and an Euler step for the bias in which tau multiplies dt, so that its tau is a rate
// (1/s); here the discretisation is exact and tau a time (s). The velocity of the antenna is Groves (2013) 14.3.2.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
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
  // (Eq. 75): s_g, s_a are fractions; m_g, m_a [rad] turn the sensor's axes about those of the body.
  Vector3d gyro_scale = Vector3d::Zero();
  Vector3d accel_scale = Vector3d::Zero();
  Vector3d gyro_misalignment_rad = Vector3d::Zero();
  Vector3d accel_misalignment_rad = Vector3d::Zero();
  // n_g, n_a as they stand in the samples: stationary sigmas of a vibration, its memory, its first and last time.
  Vector3d gyro_vibration_rps = Vector3d::Zero();
  Vector3d accel_vibration_mps2 = Vector3d::Zero();
  double vibration_correlation_time_s = 0.01;
  double vibration_begin_s = -std::numeric_limits<double>::infinity();
  double vibration_end_s = std::numeric_limits<double>::infinity();
};

// Sets the times of the vibration: motors run from the first motion of the truth to the last (1 mm/s and more).
void vibrate_in_motion(ImuErrors& errors, const Truth& truth);

// b_a[k], b_g[k]: true biases at the stamp of sample k. As in the filter's model, the sample of step k carries the
// biases of epoch k-1, which walk afterwards.
struct SimulatedImu {
  ImuSeries log;
  std::vector<Vector3d> b_a;  // m/s^2
  std::vector<Vector3d> b_g;  // rad/s
};

// (Eq. 45)-(Eq. 46), (Eq. 75). The random walk starts at the turn-on bias, the Ornstein-Uhlenbeck process at a draw from
// its stationary distribution around it. Each noise is a stream of the seed of its own: switching one off leaves the others
// as they were. Throws Error for fewer than two samples, stamps that do not increase, negative sigmas or densities, values
// that are not finite, or a correlation time that is not positive.
SimulatedImu add_imu_errors(const ImuSeries& perfect, const ImuErrors& errors, std::uint64_t seed);

// Vectors are along north, east, down, in metres and m/s. Beyond white noise everything is off.
struct GnssErrors {
  Vector3d std_ned_m = {0.01, 0.01, 0.03};  // of the white part
  double rate_hz = 1.0;
  Vector3d l_ba_b = Vector3d::Zero();  // m, IMU to antenna, body axes
  double latency_s = 0.0;              // L: stamp minus true time
  bool velocity = false;
  Vector3d velocity_std_ned = {0.03, 0.03, 0.05};  // m/s, of the white part
  double outlier_probability = 0.0;                // per fix; its record does not say so
  double outlier_m = 5.0;                          // length of the offset, any direction

  // c: stationary sigma, correlation time and, of the second order, smoothing time.
  Vector3d correlated_std_ned_m = Vector3d::Zero();
  double correlation_time_s = 100.0;
  double smoothing_time_s = 0.0;  // 0 = first order
  // s: of first order.
  Vector3d velocity_correlated_std_ned = Vector3d::Zero();
  double velocity_correlation_time_s = 2.0;

  std::optional<double> velocity_latency_s;  // L_v; nullopt = as latency_s
  double stamp_jitter_s = 0.0;               // sigma of j, one a record: true epoch minus what the stamp says
  double arrival_delay_s = 0.0;              // mean and sigma of d, one a record, exponential: stamps are arrivals
  Vector3d step_ned_m = Vector3d::Zero();    // q of latitude, longitude and height; 0 = as they are
  double velocity_step_mps = 0.0;            // q_v

  // What the records state: 0 = the root of white^2 + correlated^2 on that axis; then times the factor.
  Vector3d stated_std_ned_m = Vector3d::Zero();
  Vector3d stated_velocity_std_ned = Vector3d::Zero();
  double stated_std_factor = 1.0;
  double stated_velocity_std_factor = 1.0;

  bool heading = false;  // of the body's x axis, by a second antenna (Eq. 76)
  double heading_std_deg = 0.3;
  double stated_heading_std_deg = 0.0;  // 0 = heading_std_deg

  int fix = 0;  // what the column of that name says: RTKLIB's Q, 1 fixed ... 5 single; 0 = by the stated sigmas
};

// (Eq. 47), (Eq. 73)-(Eq. 74) at the multiples t_n of 1 / rate_hz inside the truth; between epochs X is interpolated on the
// group, X_k exp(a log(X_k^-1 X_{k+1})), and the rate linearly between the middles of the samples. c and s are those of t_n.
// Each error is a stream of the seed of its own. A record whose position or velocity would be of a time outside the truth is
// left out. Arrivals keep their order: a message ends a millisecond after the one before at the earliest.
// A fix column that is not given is what a receiver with such stated sigmas reports: 1, 2 or 5.
// Throws Error for an empty or inconsistent truth, a rate or correlation time that is not positive, a negative sigma, delay
// or step, or a probability outside [0, 1].
std::vector<GnssRecord> simulate_gnss(const Truth& truth, const GnssErrors& errors, std::uint64_t seed);

// c of the records that simulate_gnss() makes of the same truth, errors and seed: what a trajectory in the receiver's own datum
// is off by. At every t_n, also where its record is left out.
struct ReceiverErrors {
  std::vector<double> t_s;    // true times t_n
  std::vector<Vector3d> c_n;  // m, NED
};
ReceiverErrors receiver_errors(const Truth& truth, const GnssErrors& errors, std::uint64_t seed);

// What the records state.
Vector3d stated_std_ned_m(const GnssErrors& errors);
Vector3d stated_velocity_std_ned(const GnssErrors& errors);

// The same receiver without a random error and without steps: rate, lever arm, latencies and what it states stay.
GnssErrors without_random_errors(const GnssErrors& errors);

// X at t_s by the same interpolation. Throws Error outside the truth (by more than 1 us).
SE23<double> truth_at(const Truth& truth, double t_s);

}  // namespace liealign
