// The shape of an IMU's noise, (Eq. 64).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/ins/noise_shape.hpp"

namespace liealign {

NoiseShape::Share NoiseShape::mean(double from_s, double to_s) const {
  Share sum{0.0, 0.0};
  const std::size_t last = index(to_s);
  for (std::size_t i = index(from_s); i <= last; ++i) {
    const double begin = i == 0 ? from_s : begin_s + static_cast<double>(i);
    const double end = i + 1 == seconds.size() ? to_s : begin_s + static_cast<double>(i + 1);
    const double dt = std::min(end, to_s) - std::max(begin, from_s);
    sum.gyro += dt * seconds[i].gyro;
    sum.accel += dt * seconds[i].accel;
  }
  return to_s > from_s ? Share{sum.gyro / (to_s - from_s), sum.accel / (to_s - from_s)} : at(to_s);
}

NoiseShape noise_shape(const ImuSeries& imu, const ImuNoise& noise, double from_s, double to_s) {
  NoiseShape shape;
  shape.begin_s = imu.front().t_s;
  const auto n = static_cast<std::size_t>(std::ceil(imu.back().t_s - shape.begin_s)) + 1;
  shape.seconds.assign(n, {0.0, 0.0});
  std::vector<double> terms(n, 0.0);
  for (std::size_t k = 1; k + 1 < imu.size(); ++k) {
    if (imu[k - 1].gap_s > 0.0 || imu[k].gap_s > 0.0 || imu[k + 1].gap_s > 0.0) continue;
    const double dt = 0.5 * (imu[k + 1].t_s - imu[k - 1].t_s);
    const auto density = [&](const Vector3d& before, const Vector3d& here, const Vector3d& after) {
      return dt / 18.0 * (before - 2.0 * here + after).squaredNorm();
    };
    const std::size_t i = shape.index(imu[k].t_s);
    shape.seconds[i].gyro += density(imu[k - 1].omega_ib_b, imu[k].omega_ib_b, imu[k + 1].omega_ib_b);
    shape.seconds[i].accel += density(imu[k - 1].f_ib_b, imu[k].f_ib_b, imu[k + 1].f_ib_b);
    terms[i] += 1.0;
  }
  NoiseShape::Share mean{0.0, 0.0};
  double counted = 0.0;
  const std::size_t first = shape.index(from_s), last = shape.index(to_s);
  for (std::size_t i = 0; i < n; ++i) {
    NoiseShape::Share& s = shape.seconds[i];
    const double terms_here = std::max(terms[i], 1.0);
    s = {std::max(s.gyro / terms_here, noise.gyro_arw * noise.gyro_arw),
         std::max(s.accel / terms_here, noise.accel_vrw * noise.accel_vrw)};
    if (i < first || i > last || terms[i] == 0.0) continue;  // a gap of the log says nothing
    mean.gyro += s.gyro;
    mean.accel += s.accel;
    counted += 1.0;
  }
  if (counted == 0.0) {
    shape.seconds.assign(1, {});
    return shape;
  }
  for (NoiseShape::Share& s : shape.seconds) s = {counted * s.gyro / mean.gyro, counted * s.accel / mean.accel};
  return shape;
}

}  // namespace liealign
