// Errors that go on from one epoch to the next: Gauss-Markov processes of first and of second order.
//
//   first order:   c' = -c/tau + w
//                  c_k = e^(-T/tau) c_{k-1} + sigma sqrt(1 - e^(-2 T/tau)) w                             (Eq. 71)
//   second order:  c' = -c/tau + u,   u' = -u/tau_u + w_u
//                  x = (c, u):   x_k = F x_{k-1} + L w,   F = [a_c  b; 0  a_u],   L L^T = P - F P F^T    (Eq. 72)
//                  a_c = e^(-T/tau),   a_u = e^(-T/tau_u),   b = tau tau_u / (tau - tau_u) (a_c - a_u)
//                  P_cc = sigma^2,   P_cu = sigma^2 / tau,   P_uu = sigma^2 / tau (1/tau + 1/tau_u)
//
// T is the step, w is white, P the stationary covariance: both processes are exact for any step and have their sigma from
// the first epoch on. The second order is what a receiver makes that smooths its error over tau_u: its autocorrelation
// (tau e^(-t/tau) - tau_u e^(-t/tau_u)) / (tau - tau_u) begins without a slope. Source: Gelb (1974), ch. 3.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/core/types.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {

// Three axes that know nothing of each other.
struct GaussMarkov {
  Vector3d sigma = Vector3d::Zero();  // stationary, in the unit of the error
  double correlation_time_s = 100.0;  // tau
  double smoothing_time_s = 0.0;      // tau_u; 0 = first order
};

// The error at each of the stamps, (Eq. 71) or (Eq. 72), stationary from the first. Throws Error for a negative sigma, a
// correlation time that is not positive, a negative smoothing time, or stamps that decrease.
std::vector<Vector3d> gauss_markov(const std::vector<double>& t_s, const GaussMarkov& process, Random random);

}  // namespace liealign
