// Units and axes of an IMU log.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "liealign/align/initial.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"

namespace liealign {
namespace {

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", x);
  return text;
}

// e(s) of the head comment, m/s^2; 0 when the rates are large in fewer than three windows.
double vertical_force_error(const ImuSeries& imu, const RestStatistics& rest, double scale) {
  constexpr double kWindow_s = 1.0, kLarge_rps = 0.5, kLevelling_rps = 0.1;
  const double g = rest.mean_f_ib_b.norm();
  const Vector<double, 2> roll_pitch = level(rest.mean_f_ib_b);
  Vector3d down_b = C_b_n_from_rpy({roll_pitch[0], roll_pitch[1], 0.0}).row(2);  // all of C that e needs
  double squares = 0.0, windows = 0.0, down = 0.0, rates = 0.0, n = 0.0, window_end = rest.period.end_s + kWindow_s;
  for (std::size_t k = 1; k < imu.size(); ++k) {
    if (imu[k].t_s <= rest.period.end_s) continue;
    const double dt = imu[k].t_s - imu[k - 1].t_s;
    const Vector3d omega = imu[k].omega_ib_b - rest.mean_omega_ib_b;
    const Vector3d& f = imu[k].f_ib_b;
    const Vector3d levelling = kLevelling_rps / std::max(f.norm(), 1.0) * down_b.cross(f);
    down_b = gamma<0>(Vector3d(-dt * (scale * omega + levelling))) * down_b;
    down += down_b.dot(f);
    rates += omega.norm();
    n += 1.0;
    if (imu[k].t_s < window_end) continue;
    if (rates / n > kLarge_rps) {
      squares += std::pow(down / n + g, 2);
      windows += 1.0;
    }
    down = rates = n = 0.0;
    window_end = imu[k].t_s + kWindow_s;
  }
  return windows < 3.0 ? 0.0 : std::sqrt(squares / windows);
}

}  // namespace

std::vector<std::string> check_force_at_rest(const RestStatistics& rest, double bias_std_mps2,
                                             const std::string& file) {
  const Vector3d& f = rest.mean_f_ib_b;
  const double norm = f.norm();
  if (norm > 0.9 && norm < 1.1) {
    throw InputError(file + ": the specific force at rest is " + number(norm) +
                     ", expected 9.8 m/s^2: the accelerometers are in g; set imu.accel_unit = \"g\" (--accel-unit g)");
  }
  constexpr double kLeast = 9.0, kMost = 10.6, kSigmas = 4.0;
  const double bias = kSigmas * bias_std_mps2;
  if (norm < std::min(kLeast, kStandardGravity - bias) || norm > std::max(kMost, kStandardGravity + bias)) {
    throw InputError(file + ": the specific force at rest is " + number(norm) +
                     " m/s^2, expected 9.8; check the units, scale and sample kind of the accelerometers "
                     "(imu.accel_unit, imu.sample)");
  }
  const double along_z = f.z() / norm;
  if (along_z > 0.7) {
    throw InputError(file + ": at rest the specific force along z is +" + number(f.z()) +
                     " m/s^2, expected -9.8: z points up, not down; declare the axes, such as imu.axes = \"FLU\" "
                     "(--axes FLU: x forward, y left, z up) or \"RFU\"");
  }
  if (along_z < -0.7) return {};
  return {
      "at rest gravity lies along x or y of the body, which stands on its side or has other axes than imu.axes says"};
}

bool rates_look_like_degrees(const ImuSeries& imu, const RestStatistics& rest) {
  // Tumbling makes e about g; aerobatics in the right unit, up to half of that.
  constexpr double kTumbling_mps2 = 3.0, kBetter = 2.0;
  const double as_declared = vertical_force_error(imu, rest, 1.0);
  return as_declared > kTumbling_mps2 && as_declared > kBetter * vertical_force_error(imu, rest, kDegToRad);
}

}  // namespace liealign
