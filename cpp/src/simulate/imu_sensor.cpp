// IMU errors (Eq. 45)-(Eq. 46), (Eq. 75).
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "liealign/core/error.hpp"
#include "liealign/simulate/gauss_markov.hpp"
#include "liealign/simulate/sensors.hpp"
#include "sensor_checks.hpp"

namespace liealign {
namespace {

void check(const ImuErrors& e) {
  require_not_negative("gyro_arw", e.noise.gyro_arw);
  require_not_negative("accel_vrw", e.noise.accel_vrw);
  require_not_negative("gyro_bias_rw", e.noise.gyro_bias_rw);
  require_not_negative("accel_bias_rw", e.noise.accel_bias_rw);
  require_not_negative("gyro_bias_sigma", e.gyro_bias_sigma);
  require_not_negative("accel_bias_sigma", e.accel_bias_sigma);
  if (e.ornstein_uhlenbeck) require_positive("bias_correlation_time_s", e.bias_correlation_time_s);
  require_positive("vibration_correlation_time_s", e.vibration_correlation_time_s);
  for (int i = 0; i < 3; ++i) {
    require_not_negative("gyro_vibration_rps", e.gyro_vibration_rps[i]);
    require_not_negative("accel_vibration_mps2", e.accel_vibration_mps2[i]);
    require_not_negative("the size of gyro_scale", std::abs(e.gyro_scale[i]));
    require_not_negative("the size of accel_scale", std::abs(e.accel_scale[i]));
    require_not_negative("the size of gyro_misalignment_rad", std::abs(e.gyro_misalignment_rad[i]));
    require_not_negative("the size of accel_misalignment_rad", std::abs(e.accel_misalignment_rad[i]));
  }
}

// One bias over all epochs, (Eq. 46).
std::vector<Vector3d> bias_history(const ImuSeries& imu, const ImuErrors& e, const Vector3d& beta, double density,
                                   double sigma, Random random) {
  std::vector<Vector3d> b(imu.size());
  b[0] = beta;
  if (e.ornstein_uhlenbeck) b[0] += sigma * random.normal3();
  for (std::size_t k = 1; k < imu.size(); ++k) {
    const double dt = imu[k].t_s - imu[k - 1].t_s;
    if (e.ornstein_uhlenbeck) {
      const double decay = dt / e.bias_correlation_time_s;
      b[k] =
          beta + std::exp(-decay) * (b[k - 1] - beta) + sigma * std::sqrt(-std::expm1(-2.0 * decay)) * random.normal3();
    } else {
      b[k] = b[k - 1] + density * std::sqrt(dt) * random.normal3();
    }
  }
  return b;
}

// The matrix of (Eq. 75).
Matrix3d distortion(const Vector3d& scale, const Vector3d& misalignment_rad) {
  Matrix3d D = scale.asDiagonal();
  D(0, 1) = misalignment_rad.z();
  D(0, 2) = -misalignment_rad.y();
  D(1, 0) = -misalignment_rad.z();
  D(1, 2) = misalignment_rad.x();
  D(2, 0) = misalignment_rad.y();
  D(2, 1) = -misalignment_rad.x();
  return D;
}

void distort(ImuSeries& log, const ImuErrors& e) {
  const Matrix3d D_g = distortion(e.gyro_scale, e.gyro_misalignment_rad);
  const Matrix3d D_a = distortion(e.accel_scale, e.accel_misalignment_rad);
  for (ImuSample& sample : log) {
    sample.omega_ib_b += (D_g * sample.omega_ib_b).eval();
    sample.f_ib_b += (D_a * sample.f_ib_b).eval();
  }
}

void vibrate(ImuSeries& log, const ImuErrors& e, std::uint64_t seed) {
  if (e.gyro_vibration_rps.isZero(0.0) && e.accel_vibration_mps2.isZero(0.0)) return;  // most flights: no time for it
  std::vector<double> t_s;
  t_s.reserve(log.size());
  for (const ImuSample& sample : log) t_s.push_back(sample.t_s);
  const auto vibration = [&](const Vector3d& sigma, SensorStream stream) {
    return gauss_markov(t_s, {sigma, e.vibration_correlation_time_s, 0.0}, Random(seed, stream));
  };
  const std::vector<Vector3d> n_g = vibration(e.gyro_vibration_rps, kGyroVibration);
  const std::vector<Vector3d> n_a = vibration(e.accel_vibration_mps2, kAccelVibration);
  for (std::size_t k = 0; k < log.size(); ++k) {
    if (t_s[k] < e.vibration_begin_s || t_s[k] > e.vibration_end_s) continue;
    log[k].omega_ib_b += n_g[k];
    log[k].f_ib_b += n_a[k];
  }
}

}  // namespace

void vibrate_in_motion(ImuErrors& errors, const Truth& truth) {
  constexpr double kStill_mps = 1e-3;  // gravity and the turning Earth leave 1e-12 in the velocity of a parked truth
  const auto moves = [&](const TruthEpoch& epoch) { return epoch.X.v.norm() >= kStill_mps; };
  const auto first = std::find_if(truth.epochs.begin(), truth.epochs.end(), moves);
  const auto last = std::find_if(truth.epochs.rbegin(), truth.epochs.rend(), moves);
  const bool never = first == truth.epochs.end();
  errors.vibration_begin_s = never ? std::numeric_limits<double>::infinity() : first->t_s;
  errors.vibration_end_s = never ? -std::numeric_limits<double>::infinity() : last->t_s;
}

SimulatedImu add_imu_errors(const ImuSeries& perfect, const ImuErrors& errors, std::uint64_t seed) {
  check(errors);
  if (perfect.size() < 2) throw Error("simulate: the perfect IMU has fewer than two samples");
  for (std::size_t k = 1; k < perfect.size(); ++k) {
    if (!(perfect[k].t_s > perfect[k - 1].t_s)) {
      throw Error("simulate: IMU sample " + std::to_string(k) + " is not later than the one before");
    }
  }
  SimulatedImu out;
  out.b_g = bias_history(perfect, errors, errors.b_g_turn_on, errors.noise.gyro_bias_rw, errors.gyro_bias_sigma,
                         Random(seed, kGyroBias));
  out.b_a = bias_history(perfect, errors, errors.b_a_turn_on, errors.noise.accel_bias_rw, errors.accel_bias_sigma,
                         Random(seed, kAccelBias));
  Random gyro(seed, kGyroNoise), accel(seed, kAccelNoise);
  out.log = perfect;
  distort(out.log, errors);
  for (std::size_t k = 0; k < perfect.size(); ++k) {
    // Sample 0 only marks the start; it gets the noise of a sample like the next one.
    const std::size_t from = k == 0 ? 0 : k - 1;
    const double root_dt = std::sqrt(perfect[from + 1].t_s - perfect[from].t_s);
    out.log[k].omega_ib_b += out.b_g[from] + (errors.noise.gyro_arw / root_dt) * gyro.normal3();
    out.log[k].f_ib_b += out.b_a[from] + (errors.noise.accel_vrw / root_dt) * accel.normal3();
  }
  vibrate(out.log, errors, seed);
  return out;
}

}  // namespace liealign
