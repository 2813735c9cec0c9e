// How the white noise of an IMU varies along a log: by the rapid part of the log itself.
//
//   h(t) = T/(6 n) sum |x_{k+1} - 2 x_k + x_{k-1}|^2 / 3   over a second, x the rate or the force, T the sampling interval
//   w(t) = max(h(t), N^2) / mean(max(h, N^2))                                                    (Eq. 64)
//
// h is the density N^2 where the samples are white, and what a sampled vibration aliases to where they are not: engines and
// rotors make noise of an IMU, on the ground it has little. w is the density's share of its mean over the flight.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "liealign/ins/imu.hpp"

namespace liealign {

struct NoiseShape {
  struct Share {
    double gyro = 1.0, accel = 1.0;
  };

  double begin_s = 0.0;
  std::vector<Share> seconds;  // one each, from begin_s on; the first and the last hold beyond

  std::size_t index(double t_s) const {
    const double at = std::clamp(std::floor(t_s - begin_s), 0.0, static_cast<double>(seconds.size() - 1));
    return static_cast<std::size_t>(at);
  }
  Share at(double t_s) const { return seconds[index(t_s)]; }

  // Over (from_s, to_s].
  Share mean(double from_s, double to_s) const;
};

// (Eq. 64) of a prepared log, with the mean over [from_s, to_s].
NoiseShape noise_shape(const ImuSeries& imu, const ImuNoise& noise, double from_s, double to_s);

}  // namespace liealign
