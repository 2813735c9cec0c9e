// The tail: additive states behind (b_a, b_g) that belong to sensors, not to the vehicle. Nothing of the IMU drives them, and
// they drive nothing of the vehicle; only observations tie the two.
//
//   Gauss-Markov   x' = -x/tau + w,                    E w w' = 2 sigma^2 / tau
//   coloured       c' = -c/tau_c + u,  u' = -u/tau_u + w,  E w w' = 2 sigma_u^2 / tau_u,
//                  sigma_u^2 = sigma_c^2 / tau_c (1/tau_c + 1/tau_u): the stationary sigma of c is sigma_c, cov(c, u) = sigma_c^2 / tau_c
//   over T:        c <- a_c c + b u,  u <- a_u u,   a = e^(-T/tau),  b = (a_c - a_u) / d,  d = 1/tau_u - 1/tau_c
//                  Q_cc = sigma_c^2 (1 - a_c^2) - b (2 a_c sigma_c^2 / tau_c + b sigma_u^2),  Q_uu = sigma_u^2 (1 - a_u^2),
//                  Q_cu = sigma_c^2 / tau_c (1 - a_c a_u) - a_u b sigma_u^2:  what leaves the stationary covariance as it is  (Eq. 79)
//
// Source: Groves (2013) 14.2; Gelb (1974) 3.8 for the processes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "liealign/core/types.hpp"

namespace liealign {

// Where each block stands in the tail. A short tail is the beginning of a long one, so that every offset holds in both.
//   c  position error of the receiver, NED, in units of the std that the file states; u  what drives it where it is smooth
//   s  velocity error of the receiver, NED, m/s;  latencies of position and velocity against the fixes' stamps, s
//   stamp jitter of one message, s;  barometer bias, m
inline constexpr int kTailC = 0, kTailPositionLatency = 3, kTailVelocityLatency = 4, kTailJitter = 5, kTailBaro = 6,
                     kTailU = 7, kTailS = 10;
inline constexpr int kNoTail = 0, kShortTail = 7, kLongTail = 13;

template <typename Scalar>
using TailVector = Vector<Scalar, kLongTail>;

// How a component moves over an interval: x <- keep x + from_driver x_driver + w, w of variance `noise` and covariance
// `with_driver` with that of the driver.
struct TailStep {
  std::array<double, kLongTail> keep, from_driver, noise, with_driver;
  // The component that drives c; none drives another.
  static constexpr int driver(int i) { return i < 3 ? kTailU + i : -1; }
  // Whether it is in a tail of so many components.
  static constexpr bool is_driven(int i, int size) { return i < 3 && driver(i) < size; }
};

// What the tail is about: zero sigmas leave a block out.
struct TailModel {
  double sigma_c = 0.0, tau_c_s = 100.0;  // of c, in units of the stated std
  double tau_u_s = 0.0;                   // of its driver; 0: c is of first order
  double sigma_s_mps = 0.0, tau_s_s = 2.0;
  double latency_std_s = 0.0, velocity_latency_std_s = 0.0;  // constants; of what is left after the last linearisation
  double jitter_s = 0.0;                                     // of each message's stamp, independent of the others'
  double baro_std_m = 0.0, baro_tau_s = 600.0;
  double latency_walk = 0.0;  // s/sqrt(s), of latencies that are not given: stamps on a grid wander with its lines

  // Whether u or s is in use, which a short tail has no room for.
  bool is_long() const { return is_coloured() || sigma_s_mps > 0.0; }
  bool is_coloured() const { return sigma_c > 0.0 && tau_u_s > 0.0; }
  bool is_empty() const {
    return sigma_c == 0.0 && sigma_s_mps == 0.0 && latency_std_s == 0.0 && velocity_latency_std_s == 0.0 &&
           jitter_s == 0.0 && baro_std_m == 0.0;
  }
};

// How one component of c moves over T seconds: what TailStep says of it.
struct ErrorStep {
  double keep = 1.0, from_driver = 0.0, noise = 0.0, with_driver = 0.0;
  double keep_driver = 1.0;
};
ErrorStep error_step(const TailModel& model, double T);

// (Eq. 79) over T seconds.
TailStep tail_step(const TailModel& model, double T);

// Covariance at the start of a run: stationary, constants by their prior, no message yet.
SquareMatrix<double, kLongTail> tail_prior(const TailModel& model);

}  // namespace liealign
