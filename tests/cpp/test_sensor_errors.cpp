// Laws of the errors that simulated sensors have beyond white noise: each has the size, the memory and the time that it is
// given, and none moves another (Eq. 71)-(Eq. 76).
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "flights.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/simulate/baro_sensor.hpp"
#include "liealign/simulate/gauss_markov.hpp"
#include "liealign/simulate/sensors.hpp"
#include "liealign/study/study_case.hpp"

namespace liealign {
namespace {

constexpr double kSpeed_mps = 8.0;
const Vector3d kLever(0.1, -0.05, -0.3);

// North-east at a constant speed, level, the nose at 30 deg; as long as is wanted.
Truth straight_truth(double duration_s) {
  constexpr double kStep_s = 0.5;
  const Geodetic origin{0.8, 0.3, 300.0};
  const Vector3d p_0 = ecef_from_geodetic(origin);
  const Matrix3d C = C_n_e(p_0);
  Truth truth;
  for (int k = 0; k <= static_cast<int>(duration_s / kStep_s); ++k) {
    const double t_s = 1000.0 + kStep_s * k;
    const Vector3d v_n(kSpeed_mps * 0.6, kSpeed_mps * 0.8, 0.0);
    TruthEpoch epoch{t_s, {C * C_b_n_from_rpy({0.0, 0.0, 30.0 * kDegToRad}), C * v_n, p_0 + C * v_n * (t_s - 1000.0)}};
    truth.epochs.push_back(epoch);
    truth.imu.push_back({t_s});
  }
  return truth;
}

// Fixes without any error to begin with.
GnssErrors quiet_gnss(double rate_hz) {
  GnssErrors errors;
  errors.rate_hz = rate_hz;
  errors.velocity = true;
  errors.std_ned_m.setZero();
  errors.velocity_std_ned.setZero();
  return errors;
}

Vector3d position_e(const GnssRecord& r) { return ecef_from_geodetic({r.lat_rad, r.lon_rad, r.height_m}); }

Vector3d position_error_n(const Truth& truth, const GnssRecord& r, double t_s) {
  const Vector3d expected = truth_at(truth, t_s).p;
  return C_n_e(expected).transpose() * (position_e(r) - expected);
}

std::vector<double> even_stamps(std::size_t size, double step_s) {
  std::vector<double> t_s(size);
  for (std::size_t k = 0; k < size; ++k) t_s[k] = step_s * static_cast<double>(k);
  return t_s;
}

double mean_product(const std::vector<Vector3d>& x, std::size_t lag) {
  double sum = 0.0;
  for (std::size_t k = 0; k + lag < x.size(); ++k) sum += x[k].dot(x[k + lag]);
  return sum / (3.0 * static_cast<double>(x.size() - lag));
}

// ---- Gauss-Markov processes -----------------------------------------------------------------------------------------

struct Process {
  double step_s, tau_s, tau_u_s;
};

// (tau e^(-t/tau) - tau_u e^(-t/tau_u)) / (tau - tau_u), and its limit (1 + t/tau) e^(-t/tau).
double expected_correlation(const Process& p, double t_s) {
  if (p.tau_u_s == p.tau_s) return (1.0 + t_s / p.tau_s) * std::exp(-t_s / p.tau_s);
  return (p.tau_s * std::exp(-t_s / p.tau_s) - p.tau_u_s * std::exp(-t_s / p.tau_u_s)) / (p.tau_s - p.tau_u_s);
}

TEST(GaussMarkov, variance_and_autocorrelation_are_those_of_the_formula_at_every_step) {
  constexpr double kSigma = 1.5;
  for (const Process& p : {Process{1.0, 20.0, 0.0}, Process{5.0, 2.0, 0.0}, Process{0.2, 5.0, 1.0},
                           Process{1.0, 20.0, 3.0}, Process{0.5, 4.0, 4.0}, Process{3.0, 2.0, 1.0}}) {
    const std::size_t size = 400000;
    const std::vector<Vector3d> c =
        gauss_markov(even_stamps(size, p.step_s), {Vector3d::Constant(kSigma), p.tau_s, p.tau_u_s}, Random(5, 1));
    // Bartlett: the variance of a correlation is 2 sum rho^2 over the draws, about (tau + tau_u) / step of them in one.
    const double memory = std::max(1.0, (p.tau_s + p.tau_u_s) / p.step_s);
    const double four_sigma = 4.0 * std::sqrt(2.0 * memory / (3.0 * static_cast<double>(size)));
    const double variance = mean_product(c, 0);
    EXPECT_NEAR(variance / (kSigma * kSigma), 1.0, four_sigma) << p.tau_s << " " << p.tau_u_s;
    for (const std::size_t lag : {1U, 2U, 5U, 10U, 30U}) {
      const double expected = expected_correlation(p, p.step_s * static_cast<double>(lag));
      EXPECT_NEAR(mean_product(c, lag) / variance, expected, four_sigma) << p.tau_s << " " << p.tau_u_s << " " << lag;
    }
  }
}

TEST(GaussMarkov, it_is_stationary_from_the_first_epoch_on) {
  for (const double tau_u_s : {0.0, 2.0}) {
    std::vector<Vector3d> first, third;
    for (std::uint64_t seed = 0; seed < 4000; ++seed) {
      const std::vector<Vector3d> c = gauss_markov({0.0, 0.3, 1.0}, {Vector3d::Ones(), 10.0, tau_u_s}, Random(seed, 1));
      first.push_back(c[0]);
      third.push_back(c[2]);
    }
    const double four_sigma = 4.0 * std::sqrt(2.0 / 12000.0);
    EXPECT_NEAR(mean_product(first, 0), 1.0, four_sigma) << tau_u_s;
    EXPECT_NEAR(mean_product(third, 0), 1.0, four_sigma) << tau_u_s;
  }
}

// A step is no sampling interval: two of half the length leave the same distribution. With uneven stamps as well.
TEST(GaussMarkov, uneven_stamps_change_nothing_in_the_correlation_between_two_of_them) {
  double product = 0.0;
  constexpr int kSeeds = 6000;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const std::vector<Vector3d> c =
        gauss_markov({0.0, 0.01, 0.9, 1.7, 3.0}, {Vector3d::Ones(), 8.0, 2.0}, Random(seed, 1));
    product += c.front().dot(c.back()) / (3.0 * kSeeds);
  }
  EXPECT_NEAR(product, expected_correlation({0.0, 8.0, 2.0}, 3.0), 4.0 * std::sqrt(2.0 / (3.0 * kSeeds)));
}

// c' is bounded with a smoothing time and is not without: the step over a short interval is of first order, not of its root.
TEST(GaussMarkov, the_smoothed_one_is_smooth) {
  const auto step = [](double step_s, double tau_u_s) {
    std::vector<Vector3d> c =
        gauss_markov(even_stamps(20000, step_s), {Vector3d::Ones(), 100.0, tau_u_s}, Random(1, 1));
    for (std::size_t k = c.size() - 1; k > 0; --k) c[k] -= c[k - 1];
    c.erase(c.begin());
    return std::sqrt(mean_product(c, 0));
  };
  EXPECT_NEAR(step(0.04, 0.0) / step(0.01, 0.0), 2.0, 0.1);
  EXPECT_NEAR(step(0.04, 5.0) / step(0.01, 5.0), 4.0, 0.5);
}

TEST(GaussMarkov, what_makes_no_sense_is_refused) {
  EXPECT_THROW(gauss_markov({0.0}, {Vector3d(-1.0, 0.0, 0.0), 1.0, 0.0}, Random(1, 1)), Error);
  EXPECT_THROW(gauss_markov({0.0}, {Vector3d::Ones(), 0.0, 0.0}, Random(1, 1)), Error);
  EXPECT_THROW(gauss_markov({0.0}, {Vector3d::Ones(), 1.0, -1.0}, Random(1, 1)), Error);
  EXPECT_THROW(gauss_markov({1.0, 0.0}, {Vector3d::Ones(), 1.0, 0.0}, Random(1, 1)), Error);
}

// ---- GNSS: correlated errors and what is stated ---------------------------------------------------------------------

TEST(GnssErrors, position_and_velocity_err_by_their_processes) {
  const Truth truth = straight_truth(20000.0);
  GnssErrors errors = quiet_gnss(1.0);
  errors.correlated_std_ned_m = {1.0, 2.0, 4.0};
  errors.correlation_time_s = 15.0;
  errors.smoothing_time_s = 2.0;
  errors.velocity_correlated_std_ned = {0.1, 0.2, 0.4};
  errors.velocity_correlation_time_s = 3.0;
  std::vector<Vector3d> c, s;
  const Vector3d v_e = truth.epochs.front().X.v;
  for (const GnssRecord& r : simulate_gnss(truth, errors, 4)) {
    c.push_back(position_error_n(truth, r, r.t_s).cwiseQuotient(errors.correlated_std_ned_m));
    const Vector3d s_n = r.v_n_mps - C_n_e(truth_at(truth, r.t_s).p).transpose() * v_e;
    s.push_back(s_n.cwiseQuotient(errors.velocity_correlated_std_ned));
  }
  ASSERT_EQ(c.size(), 20001u);
  const double four_sigma = 4.0 * std::sqrt(2.0 * 17.0 / 60000.0);
  EXPECT_NEAR(mean_product(c, 0), 1.0, four_sigma);
  EXPECT_NEAR(mean_product(s, 0), 1.0, four_sigma);
  EXPECT_NEAR(mean_product(c, 3) / mean_product(c, 0), expected_correlation({1.0, 15.0, 2.0}, 3.0), four_sigma);
  EXPECT_NEAR(mean_product(s, 3) / mean_product(s, 0), std::exp(-1.0), four_sigma);
}

TEST(GnssErrors, the_stated_std_is_that_of_white_and_correlated_part_unless_another_is_given) {
  GnssErrors errors;
  errors.std_ned_m = {0.03, 0.03, 0.05};
  EXPECT_EQ(stated_std_ned_m(errors), errors.std_ned_m);
  errors.correlated_std_ned_m = {0.04, 0.04, 0.12};
  errors.velocity_correlated_std_ned = {0.04, 0.04, 0.12};
  EXPECT_LT((stated_std_ned_m(errors) - Vector3d(0.05, 0.05, 0.13)).norm(), 1e-15);
  EXPECT_LT((stated_velocity_std_ned(errors) - Vector3d(0.05, 0.05, 0.13)).norm(), 1e-15);
  errors.stated_std_factor = 0.5;
  errors.stated_velocity_std_factor = 3.0;
  errors.stated_std_ned_m = {0.2, 0.0, 0.4};
  EXPECT_LT((stated_std_ned_m(errors) - Vector3d(0.1, 0.025, 0.2)).norm(), 1e-15);
  errors.velocity = true;
  const GnssRecord record = simulate_gnss(straight_truth(10.0), errors, 1).front();
  EXPECT_DOUBLE_EQ(std::sqrt(record.P_n_m2(2, 2)), 0.2);
  EXPECT_DOUBLE_EQ(record.std_v_n_mps.z(), 0.39);
  const GnssErrors none = without_random_errors(errors);
  EXPECT_EQ(stated_std_ned_m(none), stated_std_ned_m(errors));
  // The perfect receiver of the same file.
  for (const GnssRecord& r : simulate_gnss(straight_truth(10.0), none, 1))
    EXPECT_LT(position_error_n(straight_truth(10.0), r, r.t_s).norm(), 1e-6);
  EXPECT_EQ(none.std_ned_m.norm() + none.correlated_std_ned_m.norm() + none.velocity_correlated_std_ned.norm(), 0.0);
}

// ---- GNSS: stamps ---------------------------------------------------------------------------------------------------

// The default flight turns and accelerates, so that the velocity tells its time.
TEST(GnssErrors, the_velocity_is_that_of_its_own_time) {
  DroneFlight drone = testing::short_flight();
  const Truth truth = drone_truth(drone, Mechanization::exact, GravityModel::normal);
  GnssErrors errors = quiet_gnss(2.0);
  errors.latency_s = 0.1;
  errors.velocity_latency_s = 0.26;
  double worst_common = 0.0;
  const std::vector<GnssRecord> records = simulate_gnss(truth, errors, 1);
  for (const GnssRecord& r : records) {
    EXPECT_LT((position_e(r) - truth_at(truth, r.t_s - 0.1).p).norm(), 1e-7);
    const auto miss = [&](double t_s) {
      const SE23<double> X = truth_at(truth, t_s);
      return (r.v_n_mps - C_n_e(X.p).transpose() * X.v).norm();
    };
    EXPECT_LT(miss(r.t_s - 0.26), 1e-9);
    worst_common = std::max(worst_common, miss(r.t_s - 0.1));
  }
  EXPECT_GT(worst_common, 0.3);  // 4 m/s^2 times 0.16 s
  // The velocity of the first fix would be from before the truth.
  EXPECT_EQ(records.size(), 2u * 110u);
  errors.velocity_latency_s.reset();
  EXPECT_EQ(simulate_gnss(truth, errors, 1).size(), 2u * 110u + 1u);
}

TEST(GnssErrors, jitter_of_the_stamp_is_an_error_along_the_track_of_v_times_dt) {
  const Truth truth = straight_truth(4000.0);
  GnssErrors errors = quiet_gnss(1.0);
  errors.stamp_jitter_s = 0.02;
  double along2 = 0.0, across2 = 0.0, n = 0.0;
  for (const GnssRecord& r : simulate_gnss(truth, errors, 3)) {
    EXPECT_EQ(r.t_s, std::round(r.t_s));  // the stamp says nothing
    const Vector3d error_n = position_error_n(truth, r, r.t_s);
    const Vector3d course_n = (C_n_e(truth_at(truth, r.t_s).p).transpose() * truth.epochs.front().X.v).normalized();
    along2 += std::pow(error_n.dot(course_n), 2);
    across2 += error_n.squaredNorm() - std::pow(error_n.dot(course_n), 2);
    n += 1.0;
  }
  EXPECT_GT(n, 3990.0);
  EXPECT_NEAR(std::sqrt(along2 / n) / (kSpeed_mps * 0.02), 1.0, 4.0 / std::sqrt(2.0 * n));
  EXPECT_LT(std::sqrt(std::max(0.0, across2) / n), 1e-6);
}

TEST(GnssErrors, an_arrival_stamp_is_late_and_the_fix_is_of_the_grid) {
  const Truth truth = straight_truth(4000.0);
  GnssErrors errors = quiet_gnss(1.0);
  errors.latency_s = 0.05;
  errors.arrival_delay_s = 0.03;
  double sum = 0.0, sum2 = 0.0, n = 0.0;
  for (const GnssRecord& r : simulate_gnss(truth, errors, 3)) {
    const double grid_s = std::round(r.t_s - 0.15), delay_s = r.t_s - 0.05 - grid_s;
    EXPECT_LT(position_error_n(truth, r, grid_s).norm(), 1e-6);
    EXPECT_GE(delay_s, -1e-9);
    sum += delay_s;
    sum2 += delay_s * delay_s;
    n += 1.0;
  }
  const double mean = sum / n, sigma = std::sqrt(sum2 / n - mean * mean);
  EXPECT_NEAR(mean / 0.03, 1.0, 4.0 / std::sqrt(n));
  EXPECT_NEAR(sigma / 0.03, 1.0, 4.0 * std::sqrt(2.0 / n));  // of an exponential: (kurtosis 9 - 1) / 4 n
}

TEST(GnssErrors, arrivals_keep_their_order_however_late_they_are) {
  GnssErrors errors = quiet_gnss(20.0);
  errors.arrival_delay_s = 0.1;
  const std::vector<GnssRecord> records = simulate_gnss(straight_truth(200.0), errors, 3);
  for (std::size_t k = 1; k < records.size(); ++k) EXPECT_GT(records[k].t_s - records[k - 1].t_s, 0.999e-3);
}

// ---- GNSS: steps, and streams ---------------------------------------------------------------------------------------

TEST(GnssErrors, columns_go_in_steps_of_the_size_that_is_told) {
  const Truth truth = straight_truth(500.0);
  GnssErrors errors = quiet_gnss(1.0);
  const std::vector<GnssRecord> exact = simulate_gnss(truth, errors, 1);
  errors.step_ned_m = {0.11, 0.88, 0.25};
  errors.velocity_step_mps = 0.01;
  const std::vector<GnssRecord> records = simulate_gnss(truth, errors, 1);
  const Matrix3d C = C_n_e(truth.epochs.front().X.p);
  Vector3d mean2 = Vector3d::Zero(), largest = Vector3d::Zero();
  for (std::size_t k = 0; k < records.size(); ++k) {
    const Vector3d error_n = C.transpose() * (position_e(records[k]) - position_e(exact[k]));
    mean2 += error_n.cwiseAbs2() / static_cast<double>(records.size());
    largest = largest.cwiseMax(error_n.cwiseAbs());
    const double lat_steps = (records[k].lat_rad - records[0].lat_rad) * 6.38e6 / 0.11;
    EXPECT_NEAR(lat_steps, std::round(lat_steps), 0.01 * std::abs(lat_steps) + 1e-6);  // the radius is within 1 %
    for (int i = 0; i < 3; ++i) {
      const double v_steps = records[k].v_n_mps[i] / 0.01;
      EXPECT_NEAR(v_steps, std::round(v_steps), 1e-9);
      EXPECT_LE(std::abs(records[k].v_n_mps[i] - exact[k].v_n_mps[i]), 0.005 + 1e-12);
    }
  }
  for (int i = 0; i < 2; ++i) {
    EXPECT_LE(largest[i], 0.5 * errors.step_ned_m[i] * 1.005);                 // 4 km on, a metre is another angle
    EXPECT_NEAR(std::sqrt(12.0 * mean2[i]) / errors.step_ned_m[i], 1.0, 0.1);  // step^2 / 12, that of rounding
  }
  EXPECT_LE(largest[2], 0.5 * 0.25 * 1.001);
}

TEST(GnssErrors, switching_one_on_leaves_the_others_as_they_were) {
  const Truth truth = straight_truth(300.0);
  GnssErrors base;
  base.velocity = true;
  base.outlier_probability = 0.1;
  const std::vector<GnssRecord> before = simulate_gnss(truth, base, 9);
  const auto kept = [&](const auto& change, bool position, bool velocity) {
    GnssErrors errors = base;
    change(errors);
    const std::vector<GnssRecord> after = simulate_gnss(truth, errors, 9);
    ASSERT_EQ(after.size(), before.size());
    for (std::size_t k = 0; k < after.size(); ++k) {
      EXPECT_EQ(position, (position_e(after[k]) - position_e(before[k])).norm() == 0.0) << k;
      EXPECT_EQ(velocity, after[k].v_n_mps == before[k].v_n_mps) << k;
    }
  };
  kept([](GnssErrors& e) { e.correlated_std_ned_m.setOnes(); }, false, true);
  kept([](GnssErrors& e) { e.velocity_correlated_std_ned.setOnes(); }, true, false);
  kept([](GnssErrors& e) { e.arrival_delay_s = 0.01; }, true, true);
  kept([](GnssErrors& e) { e.heading = true; }, true, true);
  kept([](GnssErrors& e) { e.stated_std_factor = 7.0; }, true, true);
}

TEST(GnssErrors, what_makes_no_sense_is_refused) {
  const Truth truth = straight_truth(10.0);
  const auto refused = [&](const auto& change) {
    GnssErrors errors;
    change(errors);
    EXPECT_THROW(simulate_gnss(truth, errors, 1), Error);
  };
  refused([](GnssErrors& e) { e.correlated_std_ned_m.x() = -1.0; });
  refused([](GnssErrors& e) { e.correlation_time_s = 0.0; });
  refused([](GnssErrors& e) { e.smoothing_time_s = -1.0; });
  refused([](GnssErrors& e) { e.stamp_jitter_s = -0.1; });
  refused([](GnssErrors& e) { e.arrival_delay_s = -0.1; });
  refused([](GnssErrors& e) { e.step_ned_m.z() = -0.1; });
  refused([](GnssErrors& e) { e.velocity_latency_s = std::nan(""); });
}

// ---- Heading and height ---------------------------------------------------------------------------------------------

TEST(GnssErrors, the_heading_of_two_antennas_is_that_of_the_body_with_its_noise) {
  GnssErrors errors = quiet_gnss(1.0);
  errors.heading = true;
  errors.heading_std_deg = 0.4;
  double sum = 0.0, sum2 = 0.0, n = 0.0;
  for (const GnssRecord& r : simulate_gnss(straight_truth(5000.0), errors, 2)) {
    ASSERT_TRUE(r.has_heading);
    EXPECT_DOUBLE_EQ(r.std_heading_rad, 0.4 * kDegToRad);
    const double error_deg = r.heading_rad * kRadToDeg - 30.0;
    sum += error_deg;
    sum2 += error_deg * error_deg;
    n += 1.0;
  }
  const GnssRecord perfect = simulate_gnss(straight_truth(5.0), without_random_errors(errors), 2).front();
  EXPECT_NEAR(perfect.heading_rad, 30.0 * kDegToRad, 1e-9);
  EXPECT_DOUBLE_EQ(perfect.std_heading_rad, 0.4 * kDegToRad);
  // The truth is straight in the frame of its start: 40 km on, north has turned by up to half a degree there.
  EXPECT_NEAR(sum / n, 0.0, 0.5);
  EXPECT_NEAR(std::sqrt(sum2 / n - sum * sum / (n * n)), 0.4, 0.06);
}

TEST(Baro, heights_have_their_noise_about_an_offset_that_wanders) {
  const Truth truth = straight_truth(20000.0);
  const BaroErrors sizes{0.2, 1.0, 1.5, 20.0};
  std::vector<Vector3d> error;
  for (const BaroRecord& r : simulate_baro(truth, sizes, 3)) {
    EXPECT_TRUE(r.has_std);
    EXPECT_EQ(r.std_m, 0.2);
    error.push_back(Vector3d::Constant(r.height_m - geodetic_from_ecef(truth_at(truth, r.t_s).p).height_m));
  }
  ASSERT_EQ(error.size(), 20001u);
  const double four_sigma = 4.0 * 1.5 * 1.5 * std::sqrt(2.0 * 20.0 / 20000.0);
  EXPECT_NEAR(mean_product(error, 0), 1.5 * 1.5 + 0.2 * 0.2, four_sigma);
  EXPECT_NEAR(mean_product(error, 20), 1.5 * 1.5 * std::exp(-1.0), four_sigma);
  // The white part alone: the difference of neighbours less that of the offset.
  const double jump2 = 2.0 * (mean_product(error, 0) - mean_product(error, 1));
  EXPECT_NEAR(jump2, 2.0 * (0.04 + 2.25 * -std::expm1(-1.0 / 20.0)), 0.02);
  EXPECT_THROW(simulate_baro(truth, {0.2, 0.0, 1.0, 20.0}, 1), Error);
}

// ---- IMU ------------------------------------------------------------------------------------------------------------

ImuSeries turning_imu(std::size_t size, double step_s) {
  ImuSeries imu(size);
  for (std::size_t k = 0; k < size; ++k) imu[k] = {step_s * static_cast<double>(k), {0.1, -0.2, 0.5}, {1.0, 2.0, -9.8}};
  return imu;
}

TEST(ImuErrors, scale_and_misalignment_are_those_of_the_matrix) {
  ImuErrors errors;
  errors.gyro_scale = {1e-3, -2e-3, 3e-3};
  errors.accel_misalignment_rad = {1e-3, -2e-3, 4e-3};
  const ImuSeries perfect = turning_imu(5, 0.01);
  for (const ImuSample& s : add_imu_errors(perfect, errors, 1).log) {
    EXPECT_LT((s.omega_ib_b - Vector3d(0.1001, -0.1996, 0.5015)).norm(), 1e-15);
    // Axes turned by m read a vector turned by -m, to first order.
    const Vector3d turned = SO3<double>::exp(Vector3d(-errors.accel_misalignment_rad)).C * perfect[0].f_ib_b;
    EXPECT_LT((s.f_ib_b - turned).norm(), 10.1 * 0.5 * errors.accel_misalignment_rad.squaredNorm());
  }
}

TEST(ImuErrors, vibration_has_its_sigma_and_its_memory_and_leaves_the_noise_alone) {
  ImuErrors errors;
  errors.noise.gyro_arw = errors.noise.accel_vrw = 1e-3;
  const ImuSeries perfect = turning_imu(100000, 0.005);
  const ImuSeries quiet = add_imu_errors(perfect, errors, 4).log;
  errors.gyro_vibration_rps = {0.1, 0.2, 0.3};
  errors.accel_vibration_mps2 = {1.0, 2.0, 3.0};
  errors.vibration_correlation_time_s = 0.02;
  const ImuSeries shaken = add_imu_errors(perfect, errors, 4).log;
  std::vector<Vector3d> n_g, n_a;
  for (std::size_t k = 0; k < quiet.size(); ++k) {
    n_g.push_back((shaken[k].omega_ib_b - quiet[k].omega_ib_b).cwiseQuotient(errors.gyro_vibration_rps));
    n_a.push_back((shaken[k].f_ib_b - quiet[k].f_ib_b).cwiseQuotient(errors.accel_vibration_mps2));
  }
  const double four_sigma = 4.0 * std::sqrt(2.0 * 4.0 / 300000.0);
  for (const auto& n : {n_g, n_a}) {
    EXPECT_NEAR(mean_product(n, 0), 1.0, four_sigma);
    EXPECT_NEAR(mean_product(n, 4) / mean_product(n, 0), std::exp(-1.0), four_sigma);
  }
}

TEST(ImuErrorSizes, what_is_drawn_has_the_sigma_that_is_told_and_what_is_fixed_its_size) {
  ImuErrorSizes sizes;
  sizes.gyro_scale_ppm = sizes.accel_scale_ppm = 2000.0;
  sizes.gyro_misalignment_deg = sizes.accel_misalignment_deg = 0.5;
  constexpr int kSeeds = 3000;
  Vector<double, 6> mean2 = Vector<double, 6>::Zero(), mean = mean2;
  const auto in_sizes = [&](const ImuErrors& e) {
    Vector<double, 6> z;
    z << e.b_g_turn_on.x() / (10.0 * kDegPerHourToRadPerSecond), e.b_a_turn_on.y() / (500.0 * kMicroGToMps2),
        e.gyro_scale.z() / 2e-3, e.accel_scale.x() / 2e-3, e.gyro_misalignment_rad.y() / (0.5 * kDegToRad),
        e.accel_misalignment_rad.z() / (0.5 * kDegToRad);
    return z;
  };
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Vector<double, 6> z = in_sizes(imu_errors(Config{}, sizes, seed));
    mean += z / kSeeds;
    mean2 += z.cwiseAbs2() / kSeeds;
  }
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(mean[i], 0.0, 4.0 / std::sqrt(kSeeds)) << i;
    EXPECT_NEAR(mean2[i], 1.0, 4.0 * std::sqrt(2.0 / kSeeds)) << i;
  }
  sizes.turn_on = "fixed";
  const Vector<double, 6> fixed = in_sizes(imu_errors(Config{}, sizes, 7));
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(std::abs(fixed[i]), 1.0, 1e-12);
  sizes.turn_on = "maybe";
  EXPECT_THROW(imu_errors(Config{}, sizes, 1), Error);
}

// Of the two the turn-on biases alone differ; the drift about them is the seed's.
TEST(ImuErrorSizes, the_drift_and_the_noise_are_the_same_for_drawn_and_fixed_biases) {
  ImuErrorSizes fixed;
  fixed.turn_on = "fixed";
  const ImuSeries perfect = turning_imu(500, 0.01);
  const ImuErrors a = imu_errors(Config{}, {}, 3), b = imu_errors(Config{}, fixed, 3);
  const SimulatedImu drawn = add_imu_errors(perfect, a, 3), sized = add_imu_errors(perfect, b, 3);
  for (std::size_t k = 0; k < perfect.size(); ++k) {
    EXPECT_LT((drawn.b_a[k] - a.b_a_turn_on - (sized.b_a[k] - b.b_a_turn_on)).norm(), 1e-15);
    EXPECT_LT((drawn.log[k].f_ib_b - a.b_a_turn_on - (sized.log[k].f_ib_b - b.b_a_turn_on)).norm(), 1e-14);
  }
}

// ---- A flight -------------------------------------------------------------------------------------------------------

TEST(SimulatedFlight, its_true_biases_are_those_that_are_in_the_samples) {
  DroneFlight drone = testing::short_flight();
  ImuErrorSizes sizes;
  sizes.noise_scale = 1e-6;  // white noise of nothing, so that what is left is the bias
  sizes.accel_turn_on_ug = 5e3;
  const SimulatedFlight s = between(simulate_flight(drone, {}, Config{}, 4, sizes), 1020.0, 1030.0);
  ASSERT_EQ(s.b_a.size(), s.truth.epochs.size());
  for (std::size_t k = 1; k < s.b_a.size(); ++k) {
    EXPECT_LT((s.flight.imu[k].f_ib_b - s.truth.imu[k].f_ib_b - s.b_a[k - 1]).norm(), 1e-6);
    EXPECT_LT((s.b_a[k] - s.imu_errors.b_a_turn_on).norm(), 1e-6);
  }
}

TEST(SimulatedFlight, it_vibrates_while_the_motors_run) {
  ImuErrorSizes sizes;
  const DroneFlight drone = testing::short_flight();
  const SimulatedFlight quiet = simulate_flight(drone, {}, Config{}, 4, sizes);
  sizes.accel_vibration_mps2.setConstant(2.0);
  const SimulatedFlight shaken = simulate_flight(drone, {}, Config{}, 4, sizes);
  double flying2 = 0.0, n = 0.0;
  for (std::size_t k = 0; k < quiet.flight.imu.size(); ++k) {
    const double t_s = quiet.flight.imu[k].t_s - drone.start_time_s;
    const Vector3d vibration = shaken.flight.imu[k].f_ib_b - quiet.flight.imu[k].f_ib_b;
    if (t_s < drone.parked_before_s || t_s > drone.duration_s - drone.parked_after_s) {
      ASSERT_EQ(vibration.norm(), 0.0) << t_s;
    } else if (t_s > drone.parked_before_s + 5.0 && t_s < drone.duration_s - drone.parked_after_s - 5.0) {
      flying2 += vibration.squaredNorm();
      n += 3.0;
    }
  }
  EXPECT_NEAR(std::sqrt(flying2 / n), 2.0, 2.0 * 4.0 / std::sqrt(n));
}

TEST(TypedInErrors, lever_arm_and_latency_are_drawn_about_the_truth_with_their_sigma) {
  GnssErrors gnss;
  gnss.l_ba_b = kLever;
  gnss.latency_s = 0.12;
  constexpr int kSeeds = 3000;
  Vector<double, 4> mean = Vector<double, 4>::Zero(), mean2 = mean;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    Config config;
    type_in(config, gnss, {0.05, 0.01}, seed);
    Vector<double, 4> z;
    z << (Vector3d(config.gnss.lever_arm_b_m.data()) - kLever) / 0.05, (config.gnss.latency_s.value() - 0.12) / 0.01;
    mean += z / kSeeds;
    mean2 += z.cwiseAbs2() / kSeeds;
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(mean[i], 0.0, 4.0 / std::sqrt(kSeeds)) << i;
    EXPECT_NEAR(mean2[i], 1.0, 4.0 * std::sqrt(2.0 / kSeeds)) << i;
  }
  Config config;
  type_in(config, gnss, {}, 1);
  EXPECT_EQ(Vector3d(config.gnss.lever_arm_b_m.data()), kLever);
  EXPECT_FALSE(config.gnss.latency_s);
  EXPECT_THROW(type_in(config, gnss, {-1.0, 0.0}, 1), Error);
}

// The sensors keep the true lever arm; the filters of a run get the one that is typed in.
TEST(TypedInErrors, a_run_of_a_study_filters_with_what_is_typed_in_and_the_bound_with_the_truth) {
  StudyCase study;
  study.flight = testing::short_flight();
  study.flight.duration_s = 90;
  study.gnss.l_ba_b = kLever;
  study.config = testing::with_given_parameters({});
  study.start = "drawn";
  study.biases = "random_walk";
  const Truth truth = study_truth(study);
  const StudyRun exact = study_run(study, truth, 5, false);
  study.typed_in = {0.1, 0.02};
  const StudyRun typed = study_run(study, truth, 5, false), bound = study_run(study, truth, 5, true);
  EXPECT_EQ(exact.start.data.l_ba_b, kLever);
  EXPECT_EQ(bound.start.data.l_ba_b, kLever);
  EXPECT_GT((typed.start.data.l_ba_b - kLever).norm(), 1e-3);
  EXPECT_GT(std::abs(typed.start.data.fixes[3].t_s - exact.start.data.fixes[3].t_s), 1e-5);
  EXPECT_EQ(position_e(typed.sensors.gnss[3]), position_e(exact.sensors.gnss[3]));
}

}  // namespace
}  // namespace liealign
