// Outlier treatment of a fix by its normalised innovation squared, TAES IV-C.
//
//   zeta = z^T S^-1 z                                                                          (Eq. 24)
//   reject:  a fix with zeta > kappa is not used.   weight:  its gain becomes gamma K, gamma = min(1, kappa/zeta)   (Eq. 25)
//   loss:    zeta/2 up to kappa; beyond it kappa/2 (reject), kappa/2 (1 + log(zeta/kappa)) (weight)   (Eq. 26)
//
// The loss of `weight` is the one whose weight is gamma, so that the score of a filter and its update agree.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "liealign/core/lanes.hpp"

namespace liealign {

enum class Outliers { weight, reject, off };

enum class Verdict { used, weighted, rejected, reacquired };

// P(chi^2 with 3 degrees of freedom <= x).
inline double chi_square_3_probability(double x) {
  return std::erf(std::sqrt(0.5 * x)) - std::sqrt(2.0 * x / std::numbers::pi) * std::exp(-0.5 * x);
}

// kappa with P(chi^2_3 <= kappa) = probability, 0 < probability < 1.
inline double chi_square_3_quantile(double probability) {
  double low = 0.0, high = 1.0;
  while (chi_square_3_probability(high) < probability && high < 1e4) high *= 2.0;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (chi_square_3_probability(middle) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

struct Gate {
  Outliers outliers = Outliers::weight;
  double kappa = 16.27;  // chi-square quantile; the pipeline sets it from a probability
};

// Where the fixes of a whole flight disagree with the filter more than its noise model says, the gate opens by as much: it is
// there for the fixes that stand out, not for a noise model that is too small. By the 80 % point of the flight's NIS, which
// up to a fifth of outliers does not move: of thirty fixes a tenth may be bad where one in twenty is on average. The 60 % point
// bears two fifths, and says nothing of a flight that is mismodelled for a third of it.
inline constexpr double kChiSquare3At80 = 4.641627676087445, kChiSquare3At60 = 2.9461660731019514;

inline double gate_scale(double nis_point, double chi_square) { return std::max(1.0, nis_point / chi_square); }

inline Gate scaled(const Gate& gate, double scale) { return {gate.outliers, gate.kappa * scale}; }

// Positions and velocities may be mismodelled differently.
struct GateScales {
  double position = 1.0;
  double velocity = 1.0;

  bool operator==(const GateScales&) const = default;
};

// gamma of (Eq. 25): 1 = used in full, 0 = not used.
template <typename Scalar>
Scalar gate_weight(const Gate& gate, const Scalar& zeta) {
  if (gate.outliers == Outliers::off || zeta <= Scalar(gate.kappa)) return Scalar(1);
  return gate.outliers == Outliers::reject ? Scalar(0) : Scalar(gate.kappa) / zeta;
}

// (Eq. 26).
template <typename Scalar>
Scalar bounded_loss(const Gate& gate, const Scalar& zeta) {
  using std::log;
  if (gate.outliers == Outliers::off || zeta <= Scalar(gate.kappa)) return Scalar(0.5) * zeta;
  const Scalar half(0.5 * gate.kappa);
  return gate.outliers == Outliers::reject ? half : half * (Scalar(1) + log(zeta / Scalar(gate.kappa)));
}

// Lanes have gates of their own.
inline Lanes gate_weight(const Gate& gate, const Lanes& zeta) {
  return for_lanes(zeta, [&](double one) { return gate_weight(gate, one); });
}

}  // namespace liealign
