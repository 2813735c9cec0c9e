// IMU errors (Eq. 45)-(Eq. 46) and GNSS fixes (Eq. 47).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/simulate/sensors.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "liealign/core/error.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/earth/wgs84.hpp"

namespace liealign {
namespace {

// Streams of one seed. Those of the flight are in drone_flight.cpp.
enum SensorStream : std::uint64_t { kGyroNoise = 1, kAccelNoise, kGyroBias, kAccelBias, kFix, kFixVelocity, kOutlier };

[[noreturn]] void refuse(const std::string& name, double value, const std::string& allowed) {
  throw Error("simulate: " + name + " is " + std::to_string(value) + "; expected " + allowed);
}

void require_not_negative(const std::string& name, double value) {
  if (!(value >= 0.0) || !std::isfinite(value)) refuse(name, value, "a finite number, 0 or more");
}

void require_positive(const std::string& name, double value) {
  if (!(value > 0.0) || !std::isfinite(value)) refuse(name, value, "a finite number above 0");
}

void check(const ImuErrors& e) {
  require_not_negative("gyro_arw", e.noise.gyro_arw);
  require_not_negative("accel_vrw", e.noise.accel_vrw);
  require_not_negative("gyro_bias_rw", e.noise.gyro_bias_rw);
  require_not_negative("accel_bias_rw", e.noise.accel_bias_rw);
  require_not_negative("gyro_bias_sigma", e.gyro_bias_sigma);
  require_not_negative("accel_bias_sigma", e.accel_bias_sigma);
  if (e.ornstein_uhlenbeck) require_positive("bias_correlation_time_s", e.bias_correlation_time_s);
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

// Where t lies in the truth: a of the way from epoch k to epoch k+1.
struct Place {
  std::size_t k;
  double a;
};

Place locate(const Truth& truth, double t_s) {
  constexpr double kSlack = 1e-6;  // s; stamps are rounded
  if (t_s < truth.epochs.front().t_s - kSlack || t_s > truth.epochs.back().t_s + kSlack) {
    refuse("time", t_s, "a time inside the truth, [s]");
  }
  const auto after = std::upper_bound(truth.epochs.begin() + 1, truth.epochs.end() - 1, t_s,
                                      [](double t, const TruthEpoch& e) { return t < e.t_s; });
  const auto k = static_cast<std::size_t>(after - truth.epochs.begin()) - 1;
  const double t0 = truth.epochs[k].t_s, t1 = truth.epochs[k + 1].t_s;
  return {k, std::clamp((t_s - t0) / (t1 - t0), 0.0, 1.0)};
}

SE23<double> state_at(const Truth& truth, const Place& at) {
  const SE23<double>& X = truth.epochs[at.k].X;
  return X * SE23<double>::exp(at.a * (X.inverse() * truth.epochs[at.k + 1].X).log());
}

// omega_ib_b: a mean belongs to the middle of its interval, linear in between.
Vector3d rate_at(const Truth& truth, const Place& at) {
  const std::size_t k = at.a < 0.5 ? at.k : at.k + 1;
  const std::size_t next = std::min(k + 1, truth.imu.size() - 1);
  const double a = at.a < 0.5 ? at.a + 0.5 : at.a - 0.5;
  return (1.0 - a) * truth.imu[k].omega_ib_b + a * truth.imu[next].omega_ib_b;
}

void check(const Truth& truth, const GnssErrors& e) {
  if (truth.epochs.size() < 2 || truth.epochs.size() != truth.imu.size()) {
    throw Error("simulate: the truth has " + std::to_string(truth.epochs.size()) + " epochs and " +
                std::to_string(truth.imu.size()) + " IMU samples; expected the same number, two or more");
  }
  require_positive("rate_hz", e.rate_hz);
  for (int i = 0; i < 3; ++i) {
    require_not_negative("std_ned_m", e.std_ned_m[i]);
    require_not_negative("velocity_std_ned", e.velocity_std_ned[i]);
    require_not_negative("the length of l_ba_b", std::abs(e.l_ba_b[i]));
  }
  require_not_negative("the size of latency_s", std::abs(e.latency_s));
  require_not_negative("outlier_m", e.outlier_m);
  if (!(e.outlier_probability >= 0.0 && e.outlier_probability <= 1.0)) {
    refuse("outlier_probability", e.outlier_probability, "a number from 0 to 1");
  }
}

struct FixNoise {
  Vector3d position;  // N(0, I), to be scaled
  Vector3d velocity;
  Vector3d outlier_m;
};

// (Eq. 47).
GnssRecord measure(const Truth& truth, const GnssErrors& e, double t_s, const FixNoise& noise) {
  const Place at = locate(truth, t_s);
  const SE23<double> X = state_at(truth, at);
  const Vector3d antenna = X.p + X.C * e.l_ba_b;
  const Matrix3d C = C_n_e(antenna);
  const Geodetic g =
      geodetic_from_ecef(antenna + C * Vector3d(e.std_ned_m.cwiseProduct(noise.position) + noise.outlier_m));
  GnssRecord record;
  record.t_s = t_s + e.latency_s;
  record.lat_rad = g.lat_rad;
  record.lon_rad = g.lon_rad;
  record.height_m = g.height_m;
  record.P_n_m2 = e.std_ned_m.cwiseAbs2().asDiagonal();
  record.fix = 1;
  if (!e.velocity) return record;
  const Vector3d v_ea_e =
      X.v + X.C * rate_at(truth, at).cross(e.l_ba_b) - wgs84::omega_ie_e().cross(Vector3d(X.C * e.l_ba_b));
  record.has_velocity = record.has_velocity_std = true;
  record.v_n_mps = C.transpose() * v_ea_e + e.velocity_std_ned.cwiseProduct(noise.velocity);
  record.std_v_n_mps = e.velocity_std_ned;
  return record;
}

}  // namespace

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
  for (std::size_t k = 0; k < perfect.size(); ++k) {
    // Sample 0 only marks the start; it gets the noise of a sample like the next one.
    const std::size_t from = k == 0 ? 0 : k - 1;
    const double root_dt = std::sqrt(perfect[from + 1].t_s - perfect[from].t_s);
    out.log[k].omega_ib_b += out.b_g[from] + (errors.noise.gyro_arw / root_dt) * gyro.normal3();
    out.log[k].f_ib_b += out.b_a[from] + (errors.noise.accel_vrw / root_dt) * accel.normal3();
  }
  return out;
}

std::vector<GnssRecord> simulate_gnss(const Truth& truth, const GnssErrors& errors, std::uint64_t seed) {
  check(truth, errors);
  // 1 us of slack: an epoch meant to be on the grid may be stamped an ulp beside it.
  const double first = std::ceil((truth.epochs.front().t_s - 1e-6) * errors.rate_hz);
  const double last = std::floor((truth.epochs.back().t_s + 1e-6) * errors.rate_hz);
  Random position(seed, kFix), velocity(seed, kFixVelocity), outlier(seed, kOutlier);
  std::vector<GnssRecord> records;
  for (double n = first; n <= last; n += 1.0) {  // NOLINT(*FloatLoopCounter): whole numbers, exact up to 2^53
    FixNoise noise{position.normal3(), velocity.normal3(), Vector3d::Zero()};
    const bool is_outlier = outlier.uniform() < errors.outlier_probability;
    const Vector3d direction = outlier.unit3();
    if (is_outlier) noise.outlier_m = errors.outlier_m * direction;
    records.push_back(measure(truth, errors, n / errors.rate_hz, noise));
  }
  return records;
}

SE23<double> truth_at(const Truth& truth, double t_s) {
  if (truth.epochs.size() < 2) throw Error("simulate: the truth has fewer than two epochs");
  return state_at(truth, locate(truth, t_s));
}

}  // namespace liealign
