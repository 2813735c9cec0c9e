// The heights of a barometer (Eq. 76).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/simulate/baro_sensor.hpp"

#include <cmath>

#include "liealign/earth/geodesy.hpp"
#include "liealign/simulate/gauss_markov.hpp"
#include "liealign/simulate/sensors.hpp"
#include "sensor_checks.hpp"

namespace liealign {

std::vector<BaroRecord> simulate_baro(const Truth& truth, const BaroErrors& errors, std::uint64_t seed) {
  require_not_negative("std_m", errors.std_m);
  require_positive("rate_hz", errors.rate_hz);
  if (truth.epochs.size() < 2) throw Error("simulate: the truth has fewer than two epochs");
  constexpr double kSlack_s = 1e-6;  // an epoch meant to be on the grid may be stamped an ulp beside it
  const double first = std::ceil((truth.epochs.front().t_s - kSlack_s) * errors.rate_hz);
  const double last = std::floor((truth.epochs.back().t_s + kSlack_s) * errors.rate_hz);
  std::vector<double> t_s;
  for (double n = first; n <= last; n += 1.0)  // NOLINT(*FloatLoopCounter): whole numbers, exact up to 2^53
    t_s.push_back(n / errors.rate_hz);
  const Vector3d bias_sigma(0.0, 0.0, errors.bias_sigma_m);
  const std::vector<Vector3d> bias =
      gauss_markov(t_s, {bias_sigma, errors.bias_correlation_time_s, 0.0}, Random(seed, kBaroBias));
  Random noise(seed, kBaroNoise);
  std::vector<BaroRecord> records(t_s.size());
  for (std::size_t k = 0; k < t_s.size(); ++k) {
    records[k].t_s = t_s[k];
    records[k].height_m =
        geodetic_from_ecef(truth_at(truth, t_s[k]).p).height_m + bias[k].z() + errors.std_m * noise.normal();
    records[k].std_m = errors.std_m;
    records[k].has_std = true;
  }
  return records;
}

}  // namespace liealign
