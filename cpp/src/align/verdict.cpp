// The verdict.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/verdict.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/core/units.hpp"

namespace liealign {

void judge(HeadingResult& r, const CandidateScore& best, const HeadingSearchOptions& options) {
  const std::size_t fixes = best.fixes;
  const double misfit = std::max(best.gate_scales_of_most.position, best.gate_scales_of_most.velocity);
  constexpr double kSecondModeMass = 0.01;
  constexpr double kMisfit = 25.0;  // most residuals five times what they should be; a few are outliers
  // What the flight itself says: a typed-in guess is not counted for the verdict.
  double information = r.sigma_rad ? 1.0 / (*r.sigma_rad * *r.sigma_rad) : 0.0;
  if (options.guess_rad) information -= 1.0 / (options.guess_std_rad * options.guess_std_rad);
  if (fixes == 0) information = 0.0;
  const double data_sigma = information > 0.0 ? 1.0 / std::sqrt(information) : 2.0 * kPi;
  constexpr double kInterval = 2.0 * 1.959963984540054;  // width of the 95 % interval in sigma
  const double interval = options.guess_rad ? kInterval * data_sigma : r.posterior.width_rad;
  if (fixes == 0 || interval > kPi) {
    r.sigma_rad.reset();
    r.verdict = "unobservable";
    r.advice =
        "the flight holds no horizontal acceleration that would show the heading; fly straight legs with quick starts "
        "and stops";
  } else if (r.posterior.modes.size() > 1 && r.posterior.modes[1].mass > kSecondModeMass) {
    r.verdict = "ambiguous";
    r.advice = "more than one heading explains the flight; accelerate in two different horizontal directions";
  } else if (misfit > kMisfit) {
    r.verdict = "weak";
    r.advice =
        "the flight does not fit its stated noise, and the sigma is too small by that much: estimate the noise scales "
        "and "
        "the latency, or check lever arm, axes and time stamps";
  } else if (data_sigma <= options.max_sigma_rad && r.settled) {
    r.verdict = "aligned";
    r.advice = "the heading is determined by the flight";
  } else {
    r.verdict = "weak";
    r.advice = "the heading is only roughly determined; longer or quicker horizontal accelerations sharpen it";
  }
}

}  // namespace liealign
