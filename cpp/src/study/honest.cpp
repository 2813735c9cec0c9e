// Errors over stated sigmas, (Eq. 85).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/study/honest.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/parts.hpp"
#include "liealign/ins/profiles.hpp"
#include "liealign/lie/so3.hpp"
#include "liealign/pipeline/settings.hpp"
#include "stopwatch.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;

// Streams of the seed; the others are in simulate/, pipeline/ and study_case.cpp.
enum HonestStream : std::uint64_t { kHonestStart = 221, kHonestLatency, kHonestBetween };

void check(const HonestCase& h) {
  const auto refuse = [](const char* name, double value, const char* allowed) {
    throw Error(std::string("honest case: ") + name + " is " + std::to_string(value) + "; expected " + allowed);
  };
  if (h.kinds.empty()) throw Error("honest case: kinds is empty; expected a kind of flight or more");
  for (const auto& [name, value] :
       {std::pair{"rest_s", h.rest_s}, std::pair{"tilt_std_deg", h.tilt_std_deg},
        std::pair{"heading_std_deg", h.heading_std_deg}, std::pair{"velocity_std_mps", h.velocity_std_mps},
        std::pair{"every_s", h.every_s}}) {
    if (!(value > 0.0) || !std::isfinite(value)) refuse(name, value, "a finite number above 0");
  }
  for (const auto& [name, value] :
       {std::pair{"start_after_s", h.start_after_s}, std::pair{"latency_start_std_s", h.latency_start_std_s},
        std::pair{"settle_s", h.settle_s}}) {
    if (!(value >= 0.0) || !std::isfinite(value)) refuse(name, value, "a finite number, 0 or more");
  }
}

NavState<double> true_state(const SimulatedFlight& simulated, double t_s) {
  const std::vector<TruthEpoch>& epochs = simulated.truth.epochs;
  const auto at = std::lower_bound(epochs.begin(), epochs.end() - 1, t_s - 1e-6,
                                   [](const TruthEpoch& e, double t) { return e.t_s < t; });
  const auto k = static_cast<std::size_t>(at - epochs.begin());
  NavState<double> X{truth_at(simulated.truth, t_s), {}};
  X.second.x << simulated.b_a[k], simulated.b_g[k];
  return X;
}

// What a rest of rest_s leaves open, in the axes of the body; heading and tilt as they are at the attitude of X_true.
Model::Covariance initial_covariance(const HonestCase& h, const NavState<double>& X_true) {
  const Config& config = h.config;
  const ImuProfile& profile = imu_profile(config.imu.model);
  const ImuNoise noise = imu_noise(config);
  const Matrix3d C_n = C_n_e(X_true.first.p), C_b_n = C_n.transpose() * X_true.first.C;
  const double accel_bias = initial_std(config).accel_bias_mps2;
  const double instability =
      config.imu.gyro_bias_instability_deg_h.value_or(profile.gyro_bias_instability_deg_h) * kDegPerHourToRadPerSecond;
  const double gyro_bias = std::hypot(instability, noise.gyro_arw / std::sqrt(h.rest_s));
  const Vector3d attitude_std = kDegToRad * Vector3d(h.tilt_std_deg, h.tilt_std_deg, h.heading_std_deg);
  const Vector3d g_b = C_b_n.transpose() * Vector3d(0.0, 0.0, kStandardGravity);
  const Matrix3d tilt_by_bias = -hat(g_b) / g_b.squaredNorm();
  const Matrix3d P_ba = accel_bias * accel_bias * Matrix3d::Identity();
  Model::Covariance P = Model::Covariance::Zero();
  P.block<3, 3>(kPhi, kPhi) = C_b_n.transpose() * attitude_std.cwiseAbs2().asDiagonal() * C_b_n +
                              tilt_by_bias * P_ba * tilt_by_bias.transpose();
  P.block<3, 3>(kPhi, kBa) = tilt_by_bias * P_ba;
  P.block<3, 3>(kBa, kPhi) = P.block<3, 3>(kPhi, kBa).transpose();
  P.block<3, 3>(kNu, kNu) = h.velocity_std_mps * h.velocity_std_mps * Matrix3d::Identity();
  P.block<3, 3>(kRho, kRho) = C_b_n.transpose() * stated_std_ned_m(h.gnss).cwiseAbs2().asDiagonal() * C_b_n;
  P.block<3, 3>(kBa, kBa) = P_ba;
  P.block<3, 3>(kBg, kBg) = gyro_bias * gyro_bias * Matrix3d::Identity();
  return P;
}

// What the run is told of the latency besides the config: an automatic one begins beside the truth.
HeadingResult told(const HonestCase& h, const PreparedFlight& flight, double latency_s, std::uint64_t seed) {
  HeadingResult heading;
  Random random(seed, kHonestLatency);
  const double off = h.latency_start_std_s * random.normal();
  if (!h.config.gnss.latency_s) heading.parameters.latency_s = latency_s + off - flight.latency_s;
  return heading;
}

Vector3d block_of(const HonestValues& values, std::size_t first) {
  return {values[first], values[first + 1], values[first + 2]};
}

void put(HonestValues& values, std::size_t first, const Vector3d& v) {
  for (std::size_t i = 0; i < 3; ++i) values[first + i] = v[static_cast<int>(i)];
}

double nees(const Vector3d& error, const Matrix3d& P) { return error.dot(P.ldlt().solve(error)); }

// Errors and sigmas in the terms of the output, and NEES of the left error. c_e: the receiver's true error, ECEF.
HonestEpoch compare(const Epoch& epoch, const NavState<double>& X_true, const Vector3d& c_e) {
  Epoch truth;
  truth.X = X_true;
  const NavRow row = nav_row(epoch), true_row = nav_row(truth);
  const SE23<double>& X = epoch.X.first;
  const Matrix3d C_n = C_n_e(X_true.first.p);
  const Vector3d relative_e = X.p + epoch.receiver_error_e - (X_true.first.p + c_e);
  const Vector<double, 6> bias = biases(epoch.X) - biases(X_true);
  const double ug = kMicroGToMps2, deg_h = kDegPerHourToRadPerSecond;
  HonestEpoch out;
  out.t_s = epoch.t_s;
  Vector3d rpy;
  for (int i = 0; i < 3; ++i) rpy[i] = kRadToDeg * std::remainder(row.rpy_rad[i] - true_row.rpy_rad[i], 2.0 * kPi);
  put(out.error, 0, rpy);
  put(out.sigma, 0, kRadToDeg * row.std_rpy_rad);
  put(out.error, 3, C_n.transpose() * (X.v - X_true.first.v));
  put(out.sigma, 3, row.std_v_n_mps);
  put(out.error, 6, C_n.transpose() * (X.p - X_true.first.p));
  put(out.sigma, 6, row.std_p_n_m);
  put(out.error, 9, C_n.transpose() * relative_e);
  put(out.sigma, 9, row.relative_std_p_n_m);
  put(out.error, 12, bias.head<3>() / ug);
  put(out.sigma, 12, epoch.variance_b_a.cwiseSqrt() / ug);
  put(out.error, 15, bias.tail<3>() / deg_h);
  put(out.sigma, 15, epoch.variance_b_g.cwiseSqrt() / deg_h);
  const Model::Tangent eps = Model::local(epoch.X, X_true);
  out.nees = {nees(eps.segment<3>(kPhi), epoch.P_phi),
              nees(eps.segment<3>(kNu), epoch.P_nu),
              nees(eps.segment<3>(kRho), epoch.P_rho),
              nees(X.C.transpose() * relative_e, epoch.P_relative),
              block_of(out.error, 12).cwiseQuotient(block_of(out.sigma, 12)).squaredNorm(),
              block_of(out.error, 15).cwiseQuotient(block_of(out.sigma, 15)).squaredNorm()};
  return out;
}

// c at a time between two records: an error of first order goes there at random, held at both ends (a bridge); one that is
// smoothed goes all but straight.
Vector3d error_between(const ReceiverErrors& errors, const GnssErrors& gnss, double t_s, Random& random) {
  const auto after = std::upper_bound(errors.t_s.begin() + 1, errors.t_s.end() - 1, t_s);
  const auto k = static_cast<std::size_t>(after - errors.t_s.begin());
  const double since_s = t_s - errors.t_s[k - 1], to_s = errors.t_s[k] - t_s;
  const Vector3d &c_0 = errors.c_n[k - 1], &c_1 = errors.c_n[k], unit = random.normal3();
  if (gnss.smoothing_time_s > 0.0) return (to_s * c_0 + since_s * c_1) / (since_s + to_s);
  const double a = std::exp(-since_s / gnss.correlation_time_s), b = std::exp(-to_s / gnss.correlation_time_s);
  const double left = 1.0 - a * a, right = 1.0 - b * b, both = 1.0 - a * a * b * b;
  return (a * right * c_0 + b * left * c_1) / both +
         std::sqrt(std::max(left * right / both, 0.0)) * gnss.correlated_std_ned_m.cwiseProduct(unit);
}

// Of the smoothed epochs, those that count.
struct Counted {
  const HonestCase& honest;
  const SimulatedFlight& simulated;
  ReceiverErrors errors;
  double first_s, last_s;

  // Half an interval from one of the receiver's epochs: at them what it measures is known best.
  void add(const std::vector<Epoch>& epochs, std::uint64_t seed, std::vector<HonestEpoch>& to) const {
    Random random(seed, kHonestBetween);
    double next_s = first_s + 0.5 / honest.gnss.rate_hz;
    for (const Epoch& epoch : epochs) {
      if (epoch.t_s < next_s - 1e-6 || epoch.t_s > last_s) continue;
      const NavState<double> X_true = true_state(simulated, epoch.t_s);
      const Vector3d c_n = error_between(errors, honest.gnss, epoch.t_s, random);
      to.push_back(compare(epoch, X_true, C_n_e(X_true.first.p) * c_n));
      next_s += honest.every_s;
    }
  }
};

void put_fit(const ReceiverFit& fit, const GnssErrors& gnss, HonestRun& run) {
  // A delay that is always there is latency.
  const double latency_s = gnss.latency_s + gnss.arrival_delay_s;
  const double lag_s = gnss.velocity_latency_s.value_or(gnss.latency_s) - gnss.latency_s;
  run.fitted = true;
  run.parameters = fit.parameters;
  run.settled = fit.settled;
  run.evaluations = fit.evaluations;
  run.latency_error_s = fit.latency.position_s - latency_s;
  run.latency_std_s = fit.latency.position_std_s;
  if (!gnss.velocity) return;
  run.velocity_latency_error_s = fit.latency.velocity_s - latency_s - lag_s;
  run.velocity_latency_std_s = fit.latency.velocity_std_s;
}

}  // namespace

SimulatedFlight honest_flight(const HonestCase& h, std::uint64_t seed) {
  DroneFlight drone = random_flight(h.kinds[seed % h.kinds.size()], false, seed);
  drone.rate_hz = h.rate_hz;
  drone.parked_before_s = h.parked_s;
  drone.duration_s = h.parked_s + h.flight_s + drone.parked_after_s;
  Config config = h.config;
  const ImuProfile& profile = imu_profile(config.imu.model);
  ImuErrorSizes sizes;
  sizes.gyro_turn_on_deg_h = config.imu.gyro_bias_turn_on_deg_h.value_or(profile.gyro_bias_turn_on_deg_h);
  sizes.accel_turn_on_ug = 1e3 * config.imu.accel_bias_turn_on_mg.value_or(profile.accel_bias_turn_on_mg);
  return simulate_flight(drone, h.gnss, config, seed, sizes);
}

HonestStart honest_start(const HonestCase& h, const SimulatedFlight& simulated, const PreparedFlight& flight,
                         double take_off_s, std::uint64_t seed) {
  HonestStart start;
  start.cursor = cursor_at(flight.data.imu(), take_off_s + h.start_after_s);
  const NavState<double> X_true = true_state(simulated, start.cursor.t_s);
  start.belief.P = initial_covariance(h, X_true);
  Random random(seed, kHonestStart);
  Model::Tangent unit;
  for (int i = 0; i < 15; ++i) unit[i] = random.normal();
  const Model::Tangent eps = Eigen::LLT<Model::Covariance>(start.belief.P).matrixL() * unit;
  start.belief.X = X_true * NavState<double>::exp(eps).inverse();
  return start;
}

HonestRun honest_run(const HonestCase& h, std::uint64_t seed) {
  check(h);
  HonestRun run;
  run.seed = seed;
  run.kind = flight_kind_name(h.kinds[seed % h.kinds.size()]);
  const Stopwatch begin;
  const SimulatedFlight simulated = honest_flight(h, seed);
  run.simulate_s = begin.seconds();
  const Stopwatch simulated_at;
  const double take_off_s = simulated.truth.epochs.front().t_s + h.parked_s;
  const double latency_s = h.gnss.latency_s + h.gnss.arrival_delay_s;
  try {
    const PreparedFlight flight = prepare_flight(simulated.flight);
    const HeadingResult heading = told(h, flight, latency_s, seed);
    const HonestStart start = honest_start(h, simulated, flight, take_off_s, seed);
    const Solution solution = process(flight, heading, run_start(flight, heading, start.belief, start.cursor));
    if (solution.receiver) put_fit(*solution.receiver, h.gnss, run);
    const double last_s = std::min(take_off_s + h.flight_s, simulated.truth.epochs.back().t_s);
    Counted{h, simulated, receiver_errors(simulated.truth, h.gnss, seed), start.cursor.t_s + h.settle_s, last_s}.add(
        solution.smoothed, seed, run.epochs);
  } catch (const InputError& error) {
    run.failure = error.what();
  } catch (const NumericalError& error) {
    run.failure = error.what();
  }
  run.run_s = simulated_at.seconds();
  return run;
}

std::vector<HonestRun> honest_runs(const HonestCase& honest, std::uint64_t first_seed, std::size_t count,
                                   const Progress& progress) {
  check(honest);
  std::vector<HonestRun> runs(count);
  in_order(
      count, [&](std::size_t i, std::size_t) { runs[i] = honest_run(honest, first_seed + i); },
      [&](std::size_t i, std::size_t) {
        if (progress && !progress(i + 1, count)) throw Cancelled("cancelled");
      });
  return runs;
}

}  // namespace liealign
