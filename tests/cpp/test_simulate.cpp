// Laws of the simulator: the truth obeys the mechanization, the flight is one a drone can fly, the errors have the
// statistics they claim (Eq. 42)-(Eq. 47).
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/ins/prepare_imu.hpp"
#include "liealign/simulate/sensors.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {
namespace {

constexpr double kTakeOff = 1040.0, kTouchDown = 1280.0;  // of the default flight: parked before and after

// The default flight, made once.
const std::vector<TruthEpoch>& default_reference() {
  static const std::vector<TruthEpoch> reference = drone_reference(DroneFlight{});
  return reference;
}

const Truth& default_truth() {
  static const Truth truth = truth_from_reference(default_reference(), Mechanization::exact, GravityModel::normal, 8);
  return truth;
}

DroneFlight short_flight() {
  DroneFlight flight;
  flight.duration_s = 110.0;
  flight.rate_hz = 100.0;
  flight.oversample = 1;
  return flight;
}

// NED of the pad, where the flight is commanded.
struct LocalState {
  double t_s;
  Matrix3d C_b_n;
  Vector3d v_n, p_n;
};

std::vector<LocalState> local_states(const std::vector<TruthEpoch>& epochs) {
  const Vector3d pad = epochs.front().X.p;
  const Matrix3d C_e_n = C_n_e(pad).transpose();
  std::vector<LocalState> local;
  for (const TruthEpoch& e : epochs) local.push_back({e.t_s, C_e_n * e.X.C, C_e_n * e.X.v, C_e_n * (e.X.p - pad)});
  return local;
}

double degrees_apart(double a, double b) { return std::abs(std::remainder((a - b) * kRadToDeg, 360.0)); }

// Largest differences over a flight: rad, m/s, m.
struct Difference {
  double attitude = 0.0, velocity = 0.0, position = 0.0;

  void include(const SE23<double>& X, const SE23<double>& Y) {
    attitude = std::max(attitude, SO3<double>{X.C.transpose() * Y.C}.log().norm());
    velocity = std::max(velocity, (X.v - Y.v).norm());
    position = std::max(position, (X.p - Y.p).norm());
  }
};

Difference mechanized_against_truth(const Truth& truth, const ImuSeries& imu, Mechanization kind) {
  Difference worst;
  SE23<double> X = truth.epochs.front().X;
  for (std::size_t k = 1; k < imu.size(); ++k) {
    const double dt = imu[k].t_s - imu[k - 1].t_s;
    X = mechanize(X, ImuInput<double>{imu[k].omega_ib_b, imu[k].f_ib_b, dt}, kind, GravityModel::normal);
    worst.include(X, truth.epochs[k].X);
  }
  return worst;
}

bool same_bits(const ImuSeries& a, const ImuSeries& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (std::memcmp(a[k].omega_ib_b.data(), b[k].omega_ib_b.data(), 3 * sizeof(double)) != 0) return false;
    if (std::memcmp(a[k].f_ib_b.data(), b[k].f_ib_b.data(), 3 * sizeof(double)) != 0) return false;
  }
  return true;
}

// Samples of a body that turns and pushes not at all.
ImuSeries silent_imu(std::size_t size, double rate_hz) {
  ImuSeries imu(size);
  for (std::size_t k = 0; k < size; ++k) imu[k].t_s = 10.0 + static_cast<double>(k) / rate_hz;
  return imu;
}

// ---- Truth ----------------------------------------------------------------------------------------------------------

TEST(Truth, MechanizingThePerfectImuReproducesIt) {
  DroneFlight flight = short_flight();
  for (const Mechanization kind : {Mechanization::exact, Mechanization::paper}) {
    const Truth truth = drone_truth(flight, kind, GravityModel::normal);
    ASSERT_EQ(truth.imu.size(), truth.epochs.size());
    EXPECT_EQ(truth.imu.front().t_s, flight.start_time_s);
    const Difference d = mechanized_against_truth(truth, truth.imu, kind);
    EXPECT_LT(d.attitude, 1e-13);
    EXPECT_LT(d.velocity, 1e-12);
    EXPECT_LT(d.position, 1e-8);
  }
}

// `exact` is a truth of the reference itself. `paper` leaves out the half acceleration and turns the velocity with the
// body, dt/2 sum (w x v) dt, so its own position drifts from the reference, 8 times less with 8 fine steps.
TEST(Truth, FollowsTheReference) {
  struct Case {
    Mechanization kind;
    int oversample;
    double position;  // m; measured 2.0e-5, 3.8e-5 (rounding of 1e-10 m per fine step), 0.175, 0.022
  };
  for (const Case& c : {Case{Mechanization::exact, 1, 1e-4}, Case{Mechanization::exact, 8, 1e-4},
                        Case{Mechanization::paper, 1, 0.25}, Case{Mechanization::paper, 8, 0.03}}) {
    const std::size_t n = static_cast<std::size_t>(c.oversample);
    std::vector<TruthEpoch> reference;
    for (std::size_t k = 0; k < default_reference().size(); k += 8 / n) reference.push_back(default_reference()[k]);
    const Truth truth = truth_from_reference(reference, c.kind, GravityModel::normal, c.oversample);
    ASSERT_EQ(truth.epochs.size(), 60001u);
    Difference d;
    for (std::size_t k = 0; k < truth.epochs.size(); ++k) d.include(truth.epochs[k].X, reference[k * n].X);
    EXPECT_LT(d.attitude, 1e-13);
    EXPECT_LT(d.velocity, 2e-11);
    EXPECT_LT(d.position, c.position);
  }
}

// 300 s at 200 Hz. Measured 9.4e-8 rad, 4.8e-5 m/s, 4.4 mm; without the coning and sculling corrections 5.8e-6 rad,
// 2.9 mm/s, 0.26 m.
TEST(Truth, MeanSamplesAfterPreparationReproduceIt) {
  const Truth& truth = default_truth();
  const PreparedImu prepared = prepare_imu(truth.imu, ImuSampleKind::mean, Matrix3d::Identity(), 0.1);
  const Difference d = mechanized_against_truth(truth, prepared.samples, Mechanization::exact);
  EXPECT_LT(d.attitude, 2e-7);
  EXPECT_LT(d.velocity, 1e-4);
  EXPECT_LT(d.position, 0.01);
  const Difference raw = mechanized_against_truth(truth, truth.imu, Mechanization::exact);
  EXPECT_GT(raw.attitude, 20.0 * d.attitude);
  EXPECT_GT(raw.position, 20.0 * d.position);
}

TEST(Truth, RefusesAReferenceThatDoesNotFit) {
  std::vector<TruthEpoch> reference(default_reference().begin(), default_reference().begin() + 10);
  const auto truth = [&](int oversample) {
    return truth_from_reference(reference, Mechanization::exact, GravityModel::normal, oversample);
  };
  EXPECT_EQ(truth(3).epochs.size(), 4u);
  EXPECT_THROW(truth(4), Error);
  EXPECT_THROW(truth(10), Error);
  EXPECT_THROW(truth(0), Error);
  reference[5].t_s = reference[4].t_s;
  EXPECT_THROW(truth(1), Error);
}

// An epoch left out and interpolated: the group's curve is a screw, so it is wrong by up to (|a| + |w x v|) dt^2/8 and
// |w'| dt^2/8 over dt = 10 ms, with 5 m/s^2, 5 m/s^2 and 10 rad/s^2.
TEST(Truth, InterpolatesOnTheGroup) {
  const Truth& truth = default_truth();
  Truth sparse;
  for (std::size_t k = 0; k < truth.epochs.size(); k += 2) {
    sparse.epochs.push_back(truth.epochs[k]);
    sparse.imu.push_back(truth.imu[k]);
  }
  Difference at, between;
  for (std::size_t k = 9000; k + 1 < truth.epochs.size(); k += 2) {
    at.include(truth_at(sparse, truth.epochs[k].t_s), truth.epochs[k].X);
    between.include(truth_at(sparse, truth.epochs[k + 1].t_s), truth.epochs[k + 1].X);
  }
  EXPECT_LT(at.position, 1e-8);
  EXPECT_LT(at.attitude, 1e-14);
  EXPECT_LT(between.position, 1.3e-4);
  EXPECT_LT(between.attitude, 1.3e-4);
  EXPECT_THROW(truth_at(truth, 999.9), Error);
  EXPECT_THROW(truth_at(truth, 1300.1), Error);
}

// ---- Flight ---------------------------------------------------------------------------------------------------------

TEST(DroneFlight, ParkedIsStill) {
  const TruthEpoch& first = default_reference().front();
  for (const TruthEpoch& e : default_reference()) {
    if (e.t_s > kTakeOff && e.t_s < kTouchDown) continue;
    ASSERT_EQ(e.X.v.norm(), 0.0) << e.t_s;
    // Exactly constant; after landing the heading has been turned away and back.
    ASSERT_LT((e.X.C - first.X.C).norm(), e.t_s <= kTakeOff ? 1e-300 : 1e-10) << e.t_s;
  }
  const Vector3d rpy = rpy_from_C_b_n(C_n_e(first.X.p).transpose() * first.X.C) * kRadToDeg;
  EXPECT_NEAR(rpy[0], 0.8, 1e-6);
  EXPECT_NEAR(rpy[1], -1.1, 1e-6);
  EXPECT_NEAR(rpy[2], 137.0, 1e-6);
}

// The IMU of the exact truth: Earth rotation and gravity, nothing else. The velocity is a difference of two of 310 m/s.
TEST(DroneFlight, ParkedImuReadsEarthRotationAndGravity) {
  const Truth& truth = default_truth();
  for (std::size_t k = 0; k < truth.epochs.size(); ++k) {
    const TruthEpoch& e = truth.epochs[k];
    if (e.t_s > kTakeOff && e.t_s <= kTouchDown) continue;
    ASSERT_LT(e.X.v.norm(), 1e-12) << e.t_s;
    ASSERT_LT((truth.imu[k].omega_ib_b - e.X.C.transpose() * wgs84::omega_ie_e()).norm(), 1e-11) << e.t_s;
    ASSERT_LT((truth.imu[k].f_ib_b + e.X.C.transpose() * gravity_e(e.X.p, GravityModel::normal)).norm(), 1e-8) << e.t_s;
  }
}

TEST(DroneFlight, StaysWithinWhatADroneCanFly) {
  const std::vector<LocalState> flight = local_states(default_reference());
  constexpr std::size_t kStep = 16;  // 10 ms
  double tilt = 0, jerk = 0, speed = 0, reached = 0, lowest = 0, highest = 0;
  for (std::size_t k = kStep; k + kStep < flight.size(); ++k) {
    const LocalState& s = flight[k];
    tilt = std::max(tilt, std::acos(std::min(1.0, s.C_b_n(2, 2))) * kRadToDeg);
    jerk = std::max(jerk, (flight[k + kStep].v_n - 2.0 * s.v_n + flight[k - kStep].v_n).norm() / (0.01 * 0.01));
    speed = std::max(speed, s.v_n.head<2>().norm());
    if (reached == 0 && speed >= 5.0) reached = s.t_s;
    lowest = std::min(lowest, -s.p_n.z());
    highest = std::max(highest, -s.p_n.z());
  }
  EXPECT_GT(tilt, 10.0);
  EXPECT_LT(tilt, 35.0);
  EXPECT_LT(jerk, 60.0);
  EXPECT_LT(speed, 7.5);
  EXPECT_LT(reached, kTakeOff + 20.0);
  EXPECT_GT(lowest, -0.05);
  EXPECT_NEAR(highest, 48.0, 2.0);  // altitude and the helix
  EXPECT_LT(flight.back().p_n.norm(), 1e-6);
  double rate = 0;
  for (const ImuSample& s : default_truth().imu) rate = std::max(rate, s.omega_ib_b.norm() * kRadToDeg);
  EXPECT_LT(rate, 90.0);
}

// Take-off is vertical, the transit at the parked heading; on the lines the nose is 40 deg right of the bearing, then
// 40 deg left of it, and never along the track.
TEST(DroneFlight, FliesCrabwise) {
  std::size_t on_line = 0, right = 0, left = 0;
  for (const LocalState& s : local_states(default_reference())) {
    const double course = std::atan2(s.v_n.y(), s.v_n.x()), heading = rpy_from_C_b_n(s.C_b_n)[2];
    if (s.t_s < kTakeOff + 10.0) {
      ASSERT_LT(s.p_n.head<2>().norm(), 0.5);
      ASSERT_LT(degrees_apart(heading, 137.0 * kDegToRad), 2.0);
    }
    if (s.t_s < 1065.0 || s.t_s > 1195.0 || s.v_n.norm() < 5.5) continue;
    ASSERT_GT(degrees_apart(course, heading), 25.0) << s.t_s;
    const double along = std::abs(std::sin(course - 30.0 * kDegToRad));
    if (along > 0.1) continue;
    ++on_line;
    if (degrees_apart(heading, 70.0 * kDegToRad) < 3.0) ++right;
    if (degrees_apart(heading, -10.0 * kDegToRad) < 3.0) ++left;
  }
  EXPECT_GT(on_line, 1600u * 40u);
  EXPECT_GT(right, on_line / 3);
  EXPECT_GT(left, on_line / 3);
  EXPECT_GT(right + left, on_line * 9 / 10);
}

TEST(DroneFlight, FitsIntoItsDuration) {
  for (const double duration : {99.0, 100.0, 110.0, 125.0, 140.0, 200.0, 400.0}) {
    DroneFlight f = short_flight();
    f.duration_s = duration;
    const std::vector<TruthEpoch> reference = drone_reference(f);
    EXPECT_NEAR(reference.back().t_s - reference.front().t_s, duration, 1e-9);
    double speed = 0;
    for (const TruthEpoch& e : reference) {
      speed = std::max(speed, e.X.v.norm());
      if (e.t_s > f.start_time_s + 40.0 && e.t_s < f.start_time_s + duration - 20.0) continue;
      ASSERT_EQ(e.X.v.norm(), 0.0) << duration << " " << e.t_s;
    }
    EXPECT_GT(speed, 5.0) << duration;
    EXPECT_LT((reference.back().X.p - reference.front().X.p).norm(), 1e-6) << duration;
  }
}

TEST(DroneFlight, RefusesWhatCannotBeFlown) {
  DroneFlight f = short_flight();
  f.duration_s = 98.0;  // 99 s are just enough
  EXPECT_THROW(drone_reference(f), Error);
  f.duration_s = 30.0;  // shorter than the parked phases
  EXPECT_THROW(drone_reference(f), Error);
  f = DroneFlight{};
  f.speed_mps = 40.0;  // drag alone tilts it by 31 deg
  EXPECT_THROW(drone_reference(f), Error);
  f = DroneFlight{};
  f.line_spacing_m = 0.0;
  EXPECT_THROW(drone_reference(f), Error);
}

// ---- Random numbers -------------------------------------------------------------------------------------------------

TEST(Random, TheSameSeedGivesTheSameBits) {
  const DroneFlight f = short_flight();
  DroneFlight other = f;
  other.seed = 2;
  const ImuSeries imu = drone_truth(f, Mechanization::exact, GravityModel::normal).imu;
  EXPECT_TRUE(same_bits(imu, drone_truth(f, Mechanization::exact, GravityModel::normal).imu));
  EXPECT_FALSE(same_bits(imu, drone_truth(other, Mechanization::exact, GravityModel::normal).imu));
  ImuErrors errors;
  errors.noise.gyro_arw = errors.noise.accel_vrw = errors.noise.gyro_bias_rw = errors.noise.accel_bias_rw = 1e-3;
  EXPECT_TRUE(same_bits(add_imu_errors(imu, errors, 5).log, add_imu_errors(imu, errors, 5).log));
  EXPECT_FALSE(same_bits(add_imu_errors(imu, errors, 5).log, add_imu_errors(imu, errors, 6).log));
}

// Laid down by the C++ standard and by the integer mixing of the seed: the same everywhere.
TEST(Random, UniformIsPinned) {
  Random random(1, 2);
  EXPECT_EQ(random.uniform(), 0x1.9211f01e8f45ap-1);
  EXPECT_EQ(random.uniform(), 0x1.82ece6a6d797cp-2);
}

TEST(Random, NormalHasTheMomentsOfANormal) {
  Random random(3, 0);
  constexpr int kDraws = 400000;
  double m1 = 0, m2 = 0, m4 = 0, lagged = 0, before = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.normal();
    m1 += x, m2 += x * x, m4 += x * x * x * x, lagged += x * before;
    before = x;
  }
  const double four_sigma = 4.0 / std::sqrt(kDraws);
  EXPECT_NEAR(m1 / kDraws, 0.0, four_sigma);
  EXPECT_NEAR(m2 / kDraws, 1.0, four_sigma * std::sqrt(2.0));
  EXPECT_NEAR(m4 / kDraws, 3.0, four_sigma * std::sqrt(96.0));
  EXPECT_NEAR(lagged / kDraws, 0.0, four_sigma);
}

// ---- IMU errors -----------------------------------------------------------------------------------------------------

TEST(ImuErrors, WhiteNoiseHasItsDensityAtEveryRate) {
  for (const double rate : {50.0, 400.0}) {
    const std::size_t n = 50001;
    ImuErrors errors;
    errors.noise.gyro_arw = 2e-4;
    errors.noise.accel_vrw = 3e-3;
    const SimulatedImu imu = add_imu_errors(silent_imu(n, rate), errors, 7);
    double gyro2 = 0, accel2 = 0, cross = 0, lagged = 0;
    for (std::size_t k = 1; k < n; ++k) {
      gyro2 += imu.log[k].omega_ib_b.squaredNorm();
      accel2 += imu.log[k].f_ib_b.squaredNorm();
      cross += imu.log[k].omega_ib_b.dot(imu.log[k].f_ib_b);
      lagged += imu.log[k].omega_ib_b.dot(imu.log[k - 1].omega_ib_b);
    }
    const double draws = 3.0 * static_cast<double>(n - 1), four_sigma = 4.0 / std::sqrt(draws);
    EXPECT_NEAR(std::sqrt(gyro2 / draws / rate), 2e-4, 2e-4 * four_sigma / std::sqrt(2.0));
    EXPECT_NEAR(std::sqrt(accel2 / draws / rate), 3e-3, 3e-3 * four_sigma / std::sqrt(2.0));
    EXPECT_NEAR(cross / std::sqrt(gyro2 * accel2), 0.0, four_sigma);
    EXPECT_NEAR(lagged / gyro2, 0.0, four_sigma);
  }
}

TEST(ImuErrors, TheBiasOfAStepIsThatOfTheEpochBefore) {
  ImuErrors errors;
  errors.noise.gyro_bias_rw = errors.noise.accel_bias_rw = 1e-4;
  errors.b_g_turn_on = {1e-3, 2e-3, 3e-3};
  errors.b_a_turn_on = {0.1, 0.2, 0.3};
  const ImuSeries perfect = silent_imu(100, 100.0);
  const SimulatedImu imu = add_imu_errors(perfect, errors, 1);
  EXPECT_EQ(imu.b_g[0], errors.b_g_turn_on);
  EXPECT_EQ(imu.b_a[0], errors.b_a_turn_on);
  for (std::size_t k = 1; k < perfect.size(); ++k) {
    EXPECT_EQ(imu.log[k].omega_ib_b, imu.b_g[k - 1]);
    EXPECT_EQ(imu.log[k].f_ib_b, imu.b_a[k - 1]);
    EXPECT_EQ(imu.log[k].t_s, perfect[k].t_s);
  }
}

TEST(ImuErrors, RandomWalkGrowsWithTheRootOfTime) {
  ImuErrors errors;
  errors.noise.gyro_bias_rw = 1e-5;
  errors.noise.accel_bias_rw = 2e-4;
  constexpr std::size_t kSize = 60001, kLag = 30;
  const SimulatedImu imu = add_imu_errors(silent_imu(kSize, 100.0), errors, 11);
  for (const std::size_t lag : {std::size_t{1}, kLag}) {
    double gyro2 = 0, accel2 = 0, draws = 0;
    for (std::size_t k = lag; k < kSize; k += lag, draws += 3.0) {
      gyro2 += (imu.b_g[k] - imu.b_g[k - lag]).squaredNorm();
      accel2 += (imu.b_a[k] - imu.b_a[k - lag]).squaredNorm();
    }
    const double root_time = std::sqrt(static_cast<double>(lag) / 100.0), tolerance = 4.0 / std::sqrt(2.0 * draws);
    EXPECT_NEAR(std::sqrt(gyro2 / draws) / (1e-5 * root_time), 1.0, tolerance);
    EXPECT_NEAR(std::sqrt(accel2 / draws) / (2e-4 * root_time), 1.0, tolerance);
  }
}

// Exact discretisation: the stationary sigma and the correlation e^(-t/tau) hold for steps far below and above tau.
TEST(ImuErrors, OrnsteinUhlenbeckIsStationaryAtEveryStep) {
  struct Case {
    double rate_hz, tau_s;
    std::size_t lag;
  };
  for (const Case& c : {Case{25.0, 2.0, 50}, Case{1.0, 0.4, 1}, Case{10.0, 1.0, 5}}) {
    ImuErrors errors;
    errors.ornstein_uhlenbeck = true;
    errors.gyro_bias_sigma = 1e-5;
    errors.accel_bias_sigma = 3e-4;
    errors.bias_correlation_time_s = c.tau_s;
    errors.b_a_turn_on = {5e-3, -4e-3, 6e-3};
    constexpr std::size_t kSize = 100000;
    const SimulatedImu imu = add_imu_errors(silent_imu(kSize, c.rate_hz), errors, 13);
    double gyro2 = 0, accel2 = 0, lagged = 0;
    for (std::size_t k = 0; k + c.lag < kSize; ++k) {
      const Vector3d a = imu.b_a[k] - errors.b_a_turn_on;
      gyro2 += imu.b_g[k].squaredNorm();
      accel2 += a.squaredNorm();
      lagged += a.dot(imu.b_a[k + c.lag] - errors.b_a_turn_on);
    }
    const double draws = 3.0 * static_cast<double>(kSize - c.lag);
    // Independent draws: one per tau at most; four sigma of a variance.
    const double step = 1.0 / c.rate_hz;
    const double four_sigma = 4.0 * std::sqrt(2.0 * std::max(1.0, c.tau_s / step) / draws);
    EXPECT_NEAR(gyro2 / draws / (1e-5 * 1e-5), 1.0, four_sigma);
    EXPECT_NEAR(accel2 / draws / (3e-4 * 3e-4), 1.0, four_sigma);
    EXPECT_NEAR(lagged / accel2, std::exp(-static_cast<double>(c.lag) * step / c.tau_s), four_sigma);
  }
}

TEST(ImuErrors, RefusesWhatMakesNoSense) {
  ImuErrors errors;
  EXPECT_THROW(add_imu_errors(silent_imu(1, 100.0), errors, 1), Error);
  errors.noise.gyro_arw = -1.0;
  EXPECT_THROW(add_imu_errors(silent_imu(9, 100.0), errors, 1), Error);
  errors = ImuErrors{};
  errors.ornstein_uhlenbeck = true;
  errors.bias_correlation_time_s = 0.0;
  EXPECT_THROW(add_imu_errors(silent_imu(9, 100.0), errors, 1), Error);
}

// ---- GNSS -----------------------------------------------------------------------------------------------------------

Vector3d position_residual_n(const Truth& truth, const GnssRecord& r, double t_s, const Vector3d& l_ba_b) {
  const SE23<double> X = truth_at(truth, t_s);
  const Vector3d expected = X.p + X.C * l_ba_b;
  return C_n_e(expected).transpose() * (ecef_from_geodetic({r.lat_rad, r.lon_rad, r.height_m}) - expected);
}

TEST(Gnss, PositionNoiseHasItsSigmas) {
  GnssErrors errors;
  errors.rate_hz = 10.0;
  errors.std_ned_m = {0.01, 0.02, 0.03};
  errors.l_ba_b = {0.1, -0.05, -0.3};
  const std::vector<GnssRecord> records = simulate_gnss(default_truth(), errors, 3);
  ASSERT_EQ(records.size(), 3001u);
  Vector3d sum = Vector3d::Zero(), sum2 = Vector3d::Zero();
  for (const GnssRecord& r : records) {
    const Vector3d z = position_residual_n(default_truth(), r, r.t_s, errors.l_ba_b).cwiseQuotient(errors.std_ned_m);
    sum += z;
    sum2 += z.cwiseAbs2();
    EXPECT_FALSE(r.has_velocity);
    EXPECT_EQ(r.fix, 1);
  }
  const double n = 3001.0;
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(sum[i] / n, 0.0, 4.0 / std::sqrt(n));
    EXPECT_NEAR(sum2[i] / n, 1.0, 4.0 * std::sqrt(2.0 / n));
    EXPECT_DOUBLE_EQ(records[7].P_n_m2(i, i), errors.std_ned_m[i] * errors.std_ned_m[i]);
  }
}

// t_true = time_s - latency_s, and the true times are multiples of the interval.
TEST(Gnss, LatencyDelaysTheStamp) {
  GnssErrors errors;
  errors.std_ned_m.setZero();
  errors.l_ba_b = {0.1, -0.05, -0.3};
  errors.latency_s = 0.23;
  double worst_with_the_wrong_sign = 0.0;
  for (const GnssRecord& r : simulate_gnss(default_truth(), errors, 3)) {
    const double t_true = r.t_s - errors.latency_s;
    EXPECT_NEAR(t_true, std::round(t_true), 1e-9);
    EXPECT_LT(position_residual_n(default_truth(), r, t_true, errors.l_ba_b).norm(), 1e-7);
    if (r.t_s > 1299.0) continue;
    const double wrong = position_residual_n(default_truth(), r, r.t_s, errors.l_ba_b).norm();
    worst_with_the_wrong_sign = std::max(worst_with_the_wrong_sign, wrong);
  }
  EXPECT_GT(worst_with_the_wrong_sign, 1.0);  // 6 m/s times 0.23 s
}

// The velocity of the antenna is the derivative of its position; the rotation term alone reaches decimetres per second.
TEST(Gnss, VelocityIsTheDerivativeOfTheAntennaPosition) {
  GnssErrors errors;
  errors.rate_hz = 7.0;  // mostly between epochs
  errors.velocity = true;
  errors.velocity_std_ned.setZero();
  errors.l_ba_b = {0.4, -0.2, -0.5};
  constexpr double kH = 0.005;
  const auto antenna = [&](double t) -> Vector3d {
    const SE23<double> X = truth_at(default_truth(), t);
    return X.p + X.C * errors.l_ba_b;
  };
  double worst = 0.0, rotation = 0.0;
  for (const GnssRecord& r : simulate_gnss(default_truth(), errors, 3)) {
    ASSERT_TRUE(r.has_velocity && r.has_velocity_std);
    if (r.t_s < 1001.0 || r.t_s > 1299.0) continue;
    const Matrix3d C_e_n = C_n_e(r.lat_rad, r.lon_rad).transpose();
    worst = std::max(worst, (r.v_n_mps - C_e_n * (antenna(r.t_s + kH) - antenna(r.t_s - kH)) / (2.0 * kH)).norm());
    rotation = std::max(rotation, (r.v_n_mps - C_e_n * truth_at(default_truth(), r.t_s).v).norm());
  }
  EXPECT_LT(worst, 2e-3);  // third derivative, h^2/6
  EXPECT_GT(rotation, 0.2);
  errors.velocity_std_ned = {0.03, 0.03, 0.05};
  const std::vector<GnssRecord> noisy = simulate_gnss(default_truth(), errors, 3);
  errors.velocity_std_ned.setZero();
  const std::vector<GnssRecord> clean = simulate_gnss(default_truth(), errors, 3);
  double sum2 = 0.0;
  for (std::size_t k = 0; k < noisy.size(); ++k) {
    sum2 += (noisy[k].v_n_mps - clean[k].v_n_mps).cwiseQuotient(Vector3d(0.03, 0.03, 0.05)).squaredNorm();
  }
  const double draws = 3.0 * static_cast<double>(noisy.size());
  EXPECT_NEAR(sum2 / draws, 1.0, 4.0 * std::sqrt(2.0 / draws));
}

TEST(Gnss, OutliersAreAsManyAndAsFarAsAsked) {
  GnssErrors errors;
  errors.rate_hz = 10.0;
  const std::vector<GnssRecord> clean = simulate_gnss(default_truth(), errors, 3);
  errors.outlier_probability = 0.1;
  const std::vector<GnssRecord> records = simulate_gnss(default_truth(), errors, 3);
  double count = 0.0;
  for (std::size_t k = 0; k < records.size(); ++k) {
    const Vector3d a = ecef_from_geodetic({clean[k].lat_rad, clean[k].lon_rad, clean[k].height_m});
    const Vector3d b = ecef_from_geodetic({records[k].lat_rad, records[k].lon_rad, records[k].height_m});
    const double offset = (b - a).norm();
    if (offset == 0.0) continue;  // every other fix is left as it was, to the bit
    count += 1.0;
    EXPECT_NEAR(offset, 5.0, 1e-7);
  }
  EXPECT_NEAR(count, 300.1, 4.0 * std::sqrt(3001 * 0.1 * 0.9));
}

TEST(Gnss, RefusesWhatMakesNoSense) {
  GnssErrors errors;
  EXPECT_THROW(simulate_gnss(Truth{}, errors, 1), Error);
  errors.rate_hz = 0.0;
  EXPECT_THROW(simulate_gnss(default_truth(), errors, 1), Error);
  errors = GnssErrors{};
  errors.outlier_probability = 1.5;
  EXPECT_THROW(simulate_gnss(default_truth(), errors, 1), Error);
}

}  // namespace
}  // namespace liealign
