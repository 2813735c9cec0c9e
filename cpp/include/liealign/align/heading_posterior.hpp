// The density of the heading over the whole circle, from sampled conditional candidates.
//
//   p(psi | y_1:N) ~ exp(-phi(psi)),  log-linear between the samples                              (Eq. 61)
//   psi_MMS = arg int exp(i psi) p(psi) dpsi                                                     (Eq. 62)
//
// Source: DRONES 4.2 (minimum mean square estimate from sampled points), TAES (30) and its remark on the posterior.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace liealign {

struct PosteriorSample {
  double heading_rad = 0.0;
  double cost = 0.0;  // negative log density, up to a constant
};

struct HeadingMode {
  double heading_rad = 0.0;
  double mass = 0.0;  // share of the posterior
};

struct HeadingPosterior {
  std::vector<PosteriorSample> samples;  // ascending in [0, 2 pi); cost = -log density [1/rad], normalised
  double mean_rad = 0.0;                 // (Eq. 62)
  double low_rad = 0.0, high_rad = 0.0;  // 95 % interval, low <= psi* <= high, not wrapped
  double width_rad = 0.0;                // of the least set of headings that holds 95 %
  std::vector<HeadingMode> modes;        // local maxima with their share, the heaviest first
};

// Samples at distinct headings, at least three, not all infinite; the interval is cut from the circle opposite to psi*.
HeadingPosterior heading_posterior(std::vector<PosteriorSample> samples, double psi_rad);

// Angle in (-pi, pi] and in [0, 2 pi).
double wrap_pi(double angle_rad);
double wrap_2pi(double angle_rad);

}  // namespace liealign
