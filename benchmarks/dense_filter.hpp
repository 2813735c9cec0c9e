// A plain dense error-state filter and smoother in ECEF, the way most people write one: the yardstick of the benchmarks.
//
//   x+ = mechanize(x, u),  P+ = F P F^T + Q,  F = I + A dt, 15x15 and dense                     Groves (2013) 14.2.3
//   K = P H^T S^-1,  P+ = (I - K H) P (I - K H)^T + K R K^T
//
// Errors (psi, v, p, b_a, b_g), true minus estimated, in ECEF axes: C_true = exp(psi) C. Gravity, noise and measurements are
// those of liealign; nothing else is shared.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/estimate/forward.hpp"
#include "liealign/estimate/lie_model.hpp"

namespace liealign::bench {

using Matrix15 = SquareMatrix<double, 15>;
using Vector15 = Vector<double, 15>;

struct DenseState {
  Matrix3d C_b_e;
  Vector3d v, p, b_a, b_g;
};

struct DenseBelief {
  DenseState X;
  Matrix15 P;
};

// The same belief in the errors of this filter: (psi, v, p) = C (phi, nu, rho).
DenseBelief dense_belief(const Belief<LieModel<double>>& belief);

// What the backward pass needs of a step: everything.
struct DenseStep {
  DenseBelief filtered;   // where the step began
  DenseBelief predicted;  // where it ended
  Matrix15 F;
};

// From t_begin_s to the last observation. The states after those of one time go to `at_events`; the steps to `steps` where that is
// wanted.
void dense_forward(const FlightData& data, const FilterOptions& options, double t_begin_s, DenseBelief& belief,
                   std::vector<DenseState>& at_events, std::vector<DenseStep>* steps = nullptr);

// Rauch-Tung-Striebel: `last` is where the forward pass ended; the smoothed beliefs at the beginnings of the steps.
std::vector<DenseBelief> dense_backward(const std::vector<DenseStep>& steps, const DenseBelief& last);

}  // namespace liealign::bench
