// Gauss-Markov processes of first and second order, (Eq. 71)-(Eq. 72).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/simulate/gauss_markov.hpp"

#include <algorithm>
#include <cmath>

#include "sensor_checks.hpp"

namespace liealign {
namespace {

// Unit stationary covariance of (c, u) and the two steps that keep it.
struct SecondOrder {
  double a_c, a_u, b;            // F
  double l_uu, l_cu, l_cc;       // L, u first: its row is a single number
  double p_u, p_cu_over_u, p_c;  // the same of P, for the start
};

// (Eq. 72) for sigma = 1. b = a_c T (1 - e^-x) / x with x = T (1/tau_u - 1/tau) has no hole at tau_u = tau.
SecondOrder second_order(double T, double tau, double tau_u) {
  const double P_cu = 1.0 / tau, P_uu = (1.0 / tau) * (1.0 / tau + 1.0 / tau_u);
  SecondOrder s{};
  s.a_c = std::exp(-T / tau);
  s.a_u = std::exp(-T / tau_u);
  const double x = T * (1.0 / tau_u - 1.0 / tau);
  s.b = s.a_c * T * (x == 0.0 ? 1.0 : -std::expm1(-x) / x);
  s.p_u = std::sqrt(P_uu);
  s.p_cu_over_u = P_cu / s.p_u;
  s.p_c = std::sqrt(1.0 - s.p_cu_over_u * s.p_cu_over_u);
  // Q = P - F P F^T, term by term.
  const double Q_uu = -P_uu * std::expm1(-2.0 * T / tau_u);
  const double Q_cu = P_cu - s.a_u * (s.a_c * P_cu + s.b * P_uu);
  const double Q_cc = -std::expm1(-2.0 * T / tau) - s.b * (2.0 * s.a_c * P_cu + s.b * P_uu);
  s.l_uu = std::sqrt(Q_uu);
  s.l_cu = s.l_uu > 0.0 ? Q_cu / s.l_uu : 0.0;
  // For T far below tau_u what is left is T^3 and drowns in the rounding of the terms above, which may be negative.
  s.l_cc = std::sqrt(std::max(0.0, Q_cc - s.l_cu * s.l_cu));
  return s;
}

std::vector<Vector3d> first_order_history(const std::vector<double>& t_s, const GaussMarkov& g, Random& random) {
  std::vector<Vector3d> c(t_s.size());
  for (std::size_t k = 0; k < t_s.size(); ++k) {
    const Vector3d w = g.sigma.cwiseProduct(random.normal3());
    if (k == 0) {
      c[k] = w;
      continue;
    }
    const double decay = (t_s[k] - t_s[k - 1]) / g.correlation_time_s;
    c[k] = std::exp(-decay) * c[k - 1] + std::sqrt(-std::expm1(-2.0 * decay)) * w;
  }
  return c;
}

std::vector<Vector3d> second_order_history(const std::vector<double>& t_s, const GaussMarkov& g, Random& random) {
  std::vector<Vector3d> c(t_s.size());
  Vector3d u = Vector3d::Zero();
  SecondOrder s{};
  double made_for_s = -1.0;  // the step that s is of: that of most records never changes
  for (std::size_t k = 0; k < t_s.size(); ++k) {
    const double step = k == 0 ? 0.0 : t_s[k] - t_s[k - 1];
    if (step != made_for_s) s = second_order(step, g.correlation_time_s, g.smoothing_time_s);
    made_for_s = step;
    const Vector3d w_u = g.sigma.cwiseProduct(random.normal3()), w_c = g.sigma.cwiseProduct(random.normal3());
    if (k == 0) {
      c[k] = s.p_cu_over_u * w_u + s.p_c * w_c;
      u = s.p_u * w_u;
      continue;
    }
    c[k] = s.a_c * c[k - 1] + s.b * u + s.l_cu * w_u + s.l_cc * w_c;
    u = s.a_u * u + s.l_uu * w_u;
  }
  return c;
}

}  // namespace

std::vector<Vector3d> gauss_markov(const std::vector<double>& t_s, const GaussMarkov& process, Random random) {
  for (int i = 0; i < 3; ++i) require_not_negative("the sigma of a correlated error", process.sigma[i]);
  require_positive("the correlation time of an error", process.correlation_time_s);
  require_not_negative("smoothing_time_s", process.smoothing_time_s);
  for (std::size_t k = 1; k < t_s.size(); ++k) {
    if (!(t_s[k] >= t_s[k - 1])) refuse_value("a time", t_s[k], "one not before the time it follows, [s]");
  }
  return process.smoothing_time_s > 0.0 ? second_order_history(t_s, process, random)
                                        : first_order_history(t_s, process, random);
}

}  // namespace liealign
