// GNSS fixes (Eq. 47), their correlated errors and their stamps (Eq. 73)-(Eq. 74), and the heading of a second antenna.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/earth/wgs84.hpp"
#include "liealign/ins/receiver_log.hpp"
#include "liealign/simulate/gauss_markov.hpp"
#include "liealign/simulate/sensors.hpp"
#include "sensor_checks.hpp"

namespace liealign {
namespace {

constexpr double kStampSlack_s = 1e-6;  // stamps are rounded
constexpr double kMessage_s = 1e-3;     // between the ends of two messages on one line

// Where t lies in the truth: a of the way from epoch k to epoch k+1.
struct Place {
  std::size_t k;
  double a;
};

bool is_inside(const Truth& truth, double t_s) {
  return t_s >= truth.epochs.front().t_s - kStampSlack_s && t_s <= truth.epochs.back().t_s + kStampSlack_s;
}

Place locate(const Truth& truth, double t_s) {
  if (!is_inside(truth, t_s)) refuse_value("time", t_s, "a time inside the truth, [s]");
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

void check(const Truth& truth) {
  if (truth.epochs.size() < 2 || truth.epochs.size() != truth.imu.size()) {
    throw Error("simulate: the truth has " + std::to_string(truth.epochs.size()) + " epochs and " +
                std::to_string(truth.imu.size()) + " IMU samples; expected the same number, two or more");
  }
}

void check(const GnssErrors& e) {
  require_positive("rate_hz", e.rate_hz);
  require_positive("correlation_time_s", e.correlation_time_s);
  require_positive("velocity_correlation_time_s", e.velocity_correlation_time_s);
  for (int i = 0; i < 3; ++i) {
    require_not_negative("std_ned_m", e.std_ned_m[i]);
    require_not_negative("velocity_std_ned", e.velocity_std_ned[i]);
    require_not_negative("correlated_std_ned_m", e.correlated_std_ned_m[i]);
    require_not_negative("velocity_correlated_std_ned", e.velocity_correlated_std_ned[i]);
    require_not_negative("stated_std_ned_m", e.stated_std_ned_m[i]);
    require_not_negative("stated_velocity_std_ned", e.stated_velocity_std_ned[i]);
    require_not_negative("step_ned_m", e.step_ned_m[i]);
    require_not_negative("the length of l_ba_b", std::abs(e.l_ba_b[i]));
  }
  require_not_negative("smoothing_time_s", e.smoothing_time_s);
  require_not_negative("velocity_step_mps", e.velocity_step_mps);
  require_not_negative("stated_std_factor", e.stated_std_factor);
  require_not_negative("stated_velocity_std_factor", e.stated_velocity_std_factor);
  require_not_negative("stamp_jitter_s", e.stamp_jitter_s);
  require_not_negative("arrival_delay_s", e.arrival_delay_s);
  require_not_negative("heading_std_deg", e.heading_std_deg);
  require_not_negative("stated_heading_std_deg", e.stated_heading_std_deg);
  require_not_negative("the size of latency_s", std::abs(e.latency_s));
  require_not_negative("the size of velocity_latency_s", std::abs(e.velocity_latency_s.value_or(0.0)));
  require_not_negative("outlier_m", e.outlier_m);
  if (e.fix < 0 || e.fix > 6) refuse_value("fix", e.fix, "a whole number from 0 to 6");
  if (!(e.outlier_probability >= 0.0 && e.outlier_probability <= 1.0)) {
    refuse_value("outlier_probability", e.outlier_probability, "a number from 0 to 1");
  }
}

// The multiples t_n of 1 / rate_hz inside the truth. An epoch meant to be on the grid may be stamped an ulp beside it.
std::vector<double> epochs_of(const Truth& truth, const GnssErrors& e) {
  const double first = std::ceil((truth.epochs.front().t_s - kStampSlack_s) * e.rate_hz);
  const double last = std::floor((truth.epochs.back().t_s + kStampSlack_s) * e.rate_hz);
  std::vector<double> t_n;
  for (double n = first; n <= last; n += 1.0)  // NOLINT(*FloatLoopCounter): whole numbers, exact up to 2^53
    t_n.push_back(n / e.rate_hz);
  return t_n;
}

std::vector<Vector3d> correlated_error(const std::vector<double>& t_n, const GnssErrors& e, std::uint64_t seed) {
  return gauss_markov(t_n, {e.correlated_std_ned_m, e.correlation_time_s, e.smoothing_time_s},
                      Random(seed, kFixCorrelated));
}

// What one record has of the errors.
struct FixErrors {
  Vector3d position = Vector3d::Zero();  // eps + c, and the outlier [m]
  Vector3d velocity = Vector3d::Zero();  // eps_v + s [m/s]
  double jitter_s = 0.0;                 // j
  double delay_s = 0.0;                  // d
  double heading_rad = 0.0;
};

// One for each t_n; every error from a stream of its own.
std::vector<FixErrors> draw_errors(const std::vector<double>& t_n, const GnssErrors& e, std::uint64_t seed) {
  Random position(seed, kFix), velocity(seed, kFixVelocity), outlier(seed, kOutlier), jitter(seed, kStampJitter),
      arrival(seed, kArrival), heading(seed, kFixHeading);
  const std::vector<Vector3d> c = correlated_error(t_n, e, seed);
  const std::vector<Vector3d> s = gauss_markov(t_n, {e.velocity_correlated_std_ned, e.velocity_correlation_time_s, 0.0},
                                               Random(seed, kVelocityCorrelated));
  std::vector<FixErrors> errors(t_n.size());
  for (std::size_t n = 0; n < t_n.size(); ++n) {
    FixErrors& one = errors[n];
    one.position = e.std_ned_m.cwiseProduct(position.normal3());
    const bool is_outlier = outlier.uniform() < e.outlier_probability;
    const Vector3d direction = outlier.unit3();
    if (is_outlier) one.position += e.outlier_m * direction;
    one.position += c[n];
    one.velocity = e.velocity_std_ned.cwiseProduct(velocity.normal3()) + s[n];
    one.jitter_s = e.stamp_jitter_s * jitter.normal();
    one.delay_s = -e.arrival_delay_s * std::log(1.0 - arrival.uniform());
    one.heading_rad = e.heading_std_deg * kDegToRad * heading.normal();
  }
  return errors;
}

// The steps of the columns [rad, rad, m]: those of a file are of degrees, the same all the way.
Vector3d column_steps(const Truth& truth, const GnssErrors& e) {
  const Vector3d p = truth.epochs.front().X.p;
  const Geodetic here = geodetic_from_ecef(p);
  const Matrix3d C = C_n_e(p);
  const Geodetic north = geodetic_from_ecef(p + C.col(0)), east = geodetic_from_ecef(p + C.col(1));
  return {e.step_ned_m.x() * (north.lat_rad - here.lat_rad),
          e.step_ned_m.y() * std::remainder(east.lon_rad - here.lon_rad, 2.0 * kPi), e.step_ned_m.z()};
}

double on_steps(double value, double step) { return step > 0.0 ? step * std::round(value / step) : value; }

// The antenna at t_s: (Eq. 47) without eps.
struct Antenna {
  SE23<double> X;  // of the IMU
  Vector3d p_ea_e, v_ea_e;
  Matrix3d C_n_e;  // there
};

Antenna antenna_at(const Truth& truth, const Vector3d& l_ba_b, double t_s) {
  const Place at = locate(truth, t_s);
  Antenna antenna;
  antenna.X = state_at(truth, at);
  antenna.p_ea_e = antenna.X.p + antenna.X.C * l_ba_b;
  antenna.C_n_e = C_n_e(antenna.p_ea_e);
  antenna.v_ea_e = antenna.X.v + antenna.X.C * rate_at(truth, at).cross(l_ba_b) -
                   wgs84::omega_ie_e().cross(Vector3d(antenna.X.C * l_ba_b));
  return antenna;
}

void put_position(GnssRecord& record, const Antenna& antenna, const FixErrors& errors, const Vector3d& steps) {
  const Geodetic g = geodetic_from_ecef(antenna.p_ea_e + antenna.C_n_e * errors.position);
  record.lat_rad = on_steps(g.lat_rad, steps.x());
  record.lon_rad = on_steps(g.lon_rad, steps.y());
  record.height_m = on_steps(g.height_m, steps.z());
}

void put_velocity(GnssRecord& record, const Antenna& antenna, const FixErrors& errors, const GnssErrors& e) {
  record.has_velocity = record.has_velocity_std = true;
  record.v_n_mps = antenna.C_n_e.transpose() * antenna.v_ea_e + errors.velocity;
  for (int i = 0; i < 3; ++i) record.v_n_mps[i] = on_steps(record.v_n_mps[i], e.velocity_step_mps);
  record.std_v_n_mps = stated_velocity_std_ned(e);
}

// (Eq. 76).
void put_heading(GnssRecord& record, const Antenna& antenna, const FixErrors& errors, const GnssErrors& e) {
  const Vector3d forward_n = antenna.C_n_e.transpose() * antenna.X.C.col(0);
  record.has_heading = true;
  const double heading = std::atan2(forward_n.y(), forward_n.x()) + errors.heading_rad;
  record.heading_rad = heading - 2.0 * kPi * std::floor(heading / (2.0 * kPi));  // from 0 to 2 pi, as in all files
  record.std_heading_rad = kDegToRad * (e.stated_heading_std_deg > 0.0 ? e.stated_heading_std_deg : e.heading_std_deg);
}

// sqrt(white^2 + correlated^2) where nothing is stated, to the bit the white one where that is all.
Vector3d stated(const Vector3d& given, const Vector3d& white, const Vector3d& correlated, double factor) {
  Vector3d std;
  for (int i = 0; i < 3; ++i)
    std[i] = factor * (given[i] > 0.0        ? given[i]
                       : correlated[i] > 0.0 ? std::hypot(white[i], correlated[i])
                                             : white[i]);
  return std;
}

}  // namespace

Vector3d stated_std_ned_m(const GnssErrors& e) {
  return stated(e.stated_std_ned_m, e.std_ned_m, e.correlated_std_ned_m, e.stated_std_factor);
}

Vector3d stated_velocity_std_ned(const GnssErrors& e) {
  return stated(e.stated_velocity_std_ned, e.velocity_std_ned, e.velocity_correlated_std_ned,
                e.stated_velocity_std_factor);
}

GnssErrors without_random_errors(const GnssErrors& errors) {
  GnssErrors none = errors;
  none.stated_std_ned_m = stated_std_ned_m(errors);
  none.stated_velocity_std_ned = stated_velocity_std_ned(errors);
  none.stated_std_factor = none.stated_velocity_std_factor = 1.0;
  if (!(none.stated_heading_std_deg > 0.0)) none.stated_heading_std_deg = none.heading_std_deg;
  none.std_ned_m = none.velocity_std_ned = Vector3d::Zero();
  none.correlated_std_ned_m = none.velocity_correlated_std_ned = none.step_ned_m = Vector3d::Zero();
  none.stamp_jitter_s = none.arrival_delay_s = none.velocity_step_mps = none.outlier_probability =
      none.heading_std_deg = 0.0;
  return none;
}

namespace {

// RTKLIB's Q of a receiver that states such sigmas.
int quality(const GnssRecord& record) {
  GnssRecord without = record;
  without.fix = -1;
  const FixClass is = fix_class(without);
  return is == FixClass::fixed ? 1 : is == FixClass::other ? 2 : 5;
}

}  // namespace

std::vector<GnssRecord> simulate_gnss(const Truth& truth, const GnssErrors& errors, std::uint64_t seed) {
  check(truth);
  check(errors);
  const std::vector<double> t_n = epochs_of(truth, errors);
  const std::vector<FixErrors> drawn = draw_errors(t_n, errors, seed);
  const Vector3d steps = column_steps(truth, errors);
  const Matrix3d P_n_m2 = stated_std_ned_m(errors).cwiseAbs2().asDiagonal();
  const double velocity_lag_s = errors.velocity_latency_s.value_or(errors.latency_s) - errors.latency_s;
  std::vector<GnssRecord> records;
  for (std::size_t n = 0; n < t_n.size(); ++n) {
    const double t_s = t_n[n] + drawn[n].jitter_s, velocity_t_s = t_s - velocity_lag_s;
    if (!is_inside(truth, t_s) || (errors.velocity && !is_inside(truth, velocity_t_s))) continue;
    const Antenna antenna = antenna_at(truth, errors.l_ba_b, t_s);
    GnssRecord record;
    record.t_s = t_n[n] + errors.latency_s + drawn[n].delay_s;
    if (errors.arrival_delay_s > 0.0 && !records.empty())
      record.t_s = std::max(record.t_s, records.back().t_s + kMessage_s);
    record.P_n_m2 = P_n_m2;
    record.fix = errors.fix > 0 ? errors.fix : quality(record);
    put_position(record, antenna, drawn[n], steps);
    if (errors.velocity) put_velocity(record, antenna_at(truth, errors.l_ba_b, velocity_t_s), drawn[n], errors);
    if (errors.heading) put_heading(record, antenna, drawn[n], errors);
    records.push_back(record);
  }
  return records;
}

ReceiverErrors receiver_errors(const Truth& truth, const GnssErrors& errors, std::uint64_t seed) {
  check(truth);
  check(errors);
  const std::vector<double> t_n = epochs_of(truth, errors);
  return {t_n, correlated_error(t_n, errors, seed)};
}

SE23<double> truth_at(const Truth& truth, double t_s) {
  if (truth.epochs.size() < 2) throw Error("simulate: the truth has fewer than two epochs");
  return state_at(truth, locate(truth, t_s));
}

}  // namespace liealign
