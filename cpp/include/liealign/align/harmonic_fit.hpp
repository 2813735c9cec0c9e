// A curve over the circle from a few evaluations: least squares of two harmonics.
//
//   y(psi) = c_0 + sum_{m=1,2} c_m cos(m psi) + s_m sin(m psi)                                    (Eq. 60)
//
// Of n equally spaced evaluations, n > 4, the least squares are sums: c_m = 2/n sum y_i cos(m psi_i). The papers' curve over
// the circle is close to the first harmonic (TAES Fig. 4): the velocity that a wrong heading predicts is off by a chord.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace liealign {

struct HarmonicFit {
  double mean = 0.0;
  double c[2] = {0.0, 0.0}, s[2] = {0.0, 0.0};
  double worst = 0.0;  // largest residual

  double at(double psi_rad) const;
};

// y_i at psi_i = 2 pi i / n.
HarmonicFit fit_harmonics(const std::vector<double>& y);

}  // namespace liealign
