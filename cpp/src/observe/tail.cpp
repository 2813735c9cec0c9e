// Transition and prior of the tail, (Eq. 79).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/observe/tail.hpp"

#include <algorithm>
#include <cmath>

namespace liealign {
namespace {

// Stationary covariance of the second order.
struct Coloured {
  double tau_c, tau_u, variance_c, variance_u, covariance;

  explicit Coloured(const TailModel& m)
      : tau_c(m.tau_c_s),
        tau_u(m.tau_u_s),
        variance_c(m.sigma_c * m.sigma_c),
        variance_u(variance_c * (1.0 / tau_c + 1.0 / tau_u) / tau_c),
        covariance(variance_c / tau_c) {}
};

void set_markov(int offset, int dim, double sigma, double tau_s, double T, TailStep& step) {
  if (sigma == 0.0) return;
  for (int i = offset; i < offset + dim; ++i) {
    step.keep[static_cast<std::size_t>(i)] = std::exp(-T / tau_s);
    step.noise[static_cast<std::size_t>(i)] = -sigma * sigma * std::expm1(-2.0 * T / tau_s);
  }
}

}  // namespace

ErrorStep error_step(const TailModel& m, double T) {
  if (m.sigma_c == 0.0) return {};
  if (!m.is_coloured()) {
    return {std::exp(-T / m.tau_c_s), 0.0, -m.sigma_c * m.sigma_c * std::expm1(-2.0 * T / m.tau_c_s), 0.0, 1.0};
  }
  const Coloured s(m);
  const double a_c = std::exp(-T / s.tau_c), a_u = std::exp(-T / s.tau_u);
  // b is a difference of two that are nearly equal, where the times are; from the slower one on nothing overflows.
  const double d = std::abs(1.0 / s.tau_u - 1.0 / s.tau_c), slower = std::max(a_c, a_u);
  const double b = d == 0.0 ? slower * T : -slower * std::expm1(-d * T) / d;
  const double noise =
      -s.variance_c * std::expm1(-2.0 * T / s.tau_c) - b * (2.0 * a_c * s.covariance + b * s.variance_u);
  const double with_driver = -s.covariance * std::expm1(-T * (1.0 / s.tau_c + 1.0 / s.tau_u)) - a_u * b * s.variance_u;
  return {a_c, b, std::max(noise, 0.0), with_driver, a_u};
}

TailStep tail_step(const TailModel& m, double T) {
  TailStep step;
  step.keep.fill(1.0);
  for (auto* numbers : {&step.from_driver, &step.noise, &step.with_driver}) numbers->fill(0.0);
  const ErrorStep c = error_step(m, T);
  for (std::size_t i = kTailC; i < kTailC + 3; ++i) {
    step.keep[i] = c.keep;
    step.from_driver[i] = c.from_driver;
    step.noise[i] = c.noise;
    step.with_driver[i] = c.with_driver;
  }
  if (m.is_coloured()) {
    const Coloured s(m);
    set_markov(kTailU, 3, std::sqrt(s.variance_u), s.tau_u, T, step);
  }
  set_markov(kTailS, 3, m.sigma_s_mps, m.tau_s_s, T, step);
  set_markov(kTailBaro, 1, m.baro_std_m, m.baro_tau_s, T, step);
  const double walk = m.latency_walk * m.latency_walk * T;
  if (m.latency_std_s > 0.0) step.noise[kTailPositionLatency] = walk;
  if (m.velocity_latency_std_s > 0.0) step.noise[kTailVelocityLatency] = walk;
  return step;
}

SquareMatrix<double, kLongTail> tail_prior(const TailModel& m) {
  SquareMatrix<double, kLongTail> P = SquareMatrix<double, kLongTail>::Zero();
  for (int i = 0; i < 3; ++i) {
    P(kTailC + i, kTailC + i) = m.sigma_c * m.sigma_c;
    P(kTailS + i, kTailS + i) = m.sigma_s_mps * m.sigma_s_mps;
    if (!m.is_coloured()) continue;
    const Coloured s(m);
    P(kTailU + i, kTailU + i) = s.variance_u;
    P(kTailC + i, kTailU + i) = P(kTailU + i, kTailC + i) = s.covariance;
  }
  P(kTailPositionLatency, kTailPositionLatency) = m.latency_std_s * m.latency_std_s;
  P(kTailVelocityLatency, kTailVelocityLatency) = m.velocity_latency_std_s * m.velocity_latency_std_s;
  P(kTailBaro, kTailBaro) = m.baro_std_m * m.baro_std_m;
  return P;
}

}  // namespace liealign
