// Two harmonics over the circle, (Eq. 60).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/harmonic_fit.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/core/units.hpp"

namespace liealign {

double HarmonicFit::at(double psi_rad) const {
  double y = mean;
  for (int m = 0; m < 2; ++m) y += c[m] * std::cos((m + 1) * psi_rad) + s[m] * std::sin((m + 1) * psi_rad);
  return y;
}

HarmonicFit fit_harmonics(const std::vector<double>& y) {
  HarmonicFit fit;
  const auto n = static_cast<double>(y.size());
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double psi = 2.0 * kPi * static_cast<double>(i) / n;
    fit.mean += y[i] / n;
    for (int m = 0; m < 2; ++m) {
      fit.c[m] += 2.0 / n * y[i] * std::cos((m + 1) * psi);
      fit.s[m] += 2.0 / n * y[i] * std::sin((m + 1) * psi);
    }
  }
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double psi = 2.0 * kPi * static_cast<double>(i) / n;
    fit.worst = std::max(fit.worst, std::abs(y[i] - fit.at(psi)));
  }
  return fit;
}

}  // namespace liealign
