// Laws of the shape of an IMU's noise, (Eq. 64).
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "liealign/ins/noise_shape.hpp"
#include "numeric.hpp"

namespace liealign {
namespace {

using testing::normal3;

constexpr double kRate = 100.0, kBegin = 50.0;
const ImuNoise kNoise{2e-4, 3e-3};  // N_g, N_a

// Of the share of one second of 100 samples: second differences are correlated, so that 300 squares are some 150.
constexpr double kScatter = 0.115;

// 100 Hz, white with `times(t)` times the noise of the profile, over gravity.
template <typename Times>
ImuSeries white_log(double duration_s, Times times, unsigned seed = 1) {
  std::mt19937 rng(seed);
  ImuSeries imu;
  for (int k = 0; k <= static_cast<int>(duration_s * kRate + 0.5); ++k) {
    const double t = kBegin + k / kRate, sqrt_rate = std::sqrt(kRate);
    imu.push_back({t, normal3(rng, times(t) * kNoise.gyro_arw * sqrt_rate),
                   Vector3d(0, 0, -9.8) + normal3(rng, times(t) * kNoise.accel_vrw * sqrt_rate)});
  }
  return imu;
}

// The span of whole seconds of such a log: the instant of its end belongs to the second after.
NoiseShape shape_of(const ImuSeries& imu, double duration_s) {
  return noise_shape(imu, kNoise, kBegin, kBegin + duration_s - 1e-6);
}

TEST(NoiseShape, of_white_noise_is_flat) {
  const NoiseShape shape = shape_of(white_log(200, [](double) { return 3.0; }), 200);
  for (double t = kBegin + 0.5; t < kBegin + 200; t += 1.0) {
    EXPECT_NEAR(shape.at(t).gyro, 1.0, 4.5 * kScatter);
    EXPECT_NEAR(shape.at(t).accel, 1.0, 4.5 * kScatter);
  }
}

TEST(NoiseShape, density_of_white_noise_is_that_of_its_profile) {
  // A share is the density over the mean of two stretches of 2 and of 8 times the noise of the profile.
  const auto times = [](double t) { return t < kBegin + 100 ? 2.0 : 8.0; };
  const NoiseShape shape = shape_of(white_log(200, times), 200);
  const NoiseShape::Share quiet = shape.mean(kBegin, kBegin + 100), loud = shape.mean(kBegin + 100, kBegin + 200);
  const double close = 5 * kScatter / std::sqrt(100.0);
  EXPECT_NEAR(quiet.gyro / (2 * 4.0 / 68), 1.0, close);
  EXPECT_NEAR(loud.gyro / (2 * 64.0 / 68), 1.0, close);
  EXPECT_NEAR(quiet.accel / (2 * 4.0 / 68), 1.0, close);
  EXPECT_NEAR(loud.accel / (2 * 64.0 / 68), 1.0, close);
}

TEST(NoiseShape, of_five_times_the_noise_is_25_times_that_of_the_quiet_floor) {
  // Quieter than its profile a log is not believed to be: half or next to none of it are the floor N^2 both.
  for (const double quiet : {1e-3, 0.5}) {
    const auto times = [&](double t) { return t >= kBegin + 30 && t < kBegin + 70 ? 5.0 : quiet; };
    const NoiseShape shape = shape_of(white_log(100, times), 100);
    const NoiseShape::Share floor = shape.at(kBegin + 10.5), loud = shape.mean(kBegin + 31, kBegin + 69);
    for (double t : {kBegin + 0.5, kBegin + 28.5, kBegin + 71.5, kBegin + 98.5}) {
      EXPECT_EQ(shape.at(t).gyro, floor.gyro);
      EXPECT_EQ(shape.at(t).accel, floor.accel);
    }
    const double close = 25 * 4 * kScatter / std::sqrt(38.0);
    EXPECT_NEAR(loud.gyro / floor.gyro, 25.0, close);
    EXPECT_NEAR(loud.accel / floor.accel, 25.0, close);
  }
}

TEST(NoiseShape, has_the_mean_1_over_its_span) {
  const auto times = [](double t) { return t >= kBegin + 30 && t < kBegin + 70 ? 5.0 : 1.0; };
  const ImuSeries imu = white_log(100, times);
  for (const auto& [from, to] : {std::pair{0.0, 100.0}, {20.0, 40.0}, {0.0, 20.0}, {50.0, 60.0}}) {
    const NoiseShape shape = noise_shape(imu, kNoise, kBegin + from, kBegin + to - 1e-6);
    EXPECT_NEAR(shape.mean(kBegin + from, kBegin + to).gyro, 1.0, 1e-9);
    EXPECT_NEAR(shape.mean(kBegin + from, kBegin + to).accel, 1.0, 1e-9);
  }
}

TEST(NoiseShape, takes_rates_and_forces_apart) {
  ImuSeries imu = white_log(60, [](double) { return 2.0; });
  std::mt19937 rng(7);
  for (ImuSample& s : imu) {
    if (s.t_s >= kBegin + 30) s.f_ib_b += normal3(rng, 20 * kNoise.accel_vrw * std::sqrt(kRate));
  }
  const NoiseShape shape = shape_of(imu, 60);
  EXPECT_NEAR(shape.mean(kBegin + 32, kBegin + 60).gyro, 1.0, 5 * kScatter / std::sqrt(28.0));
  EXPECT_GT(shape.mean(kBegin + 32, kBegin + 60).accel, 1.9);
}

TEST(NoiseShape, does_not_see_smooth_motion) {
  ImuSeries imu = white_log(60, [](double) { return 0.1; });
  const auto rates = [](double t) { return Vector3d(std::sin(2 * t), 0.5 * std::cos(t), 0.3 * std::sin(1.5 * t)); };
  const auto forces = [](double t) { return Vector3d(3 * std::cos(1.2 * t), 2 * std::sin(2 * t), std::cos(t)); };
  for (ImuSample& s : imu) {
    if (s.t_s < kBegin + 30) continue;
    s.omega_ib_b += rates(s.t_s);
    s.f_ib_b += forces(s.t_s);
  }
  const NoiseShape shape = shape_of(imu, 60);
  for (double t = kBegin + 0.5; t < kBegin + 60; t += 1.0) {
    if (std::abs(t - kBegin - 30) < 1.0) continue;  // where it begins, in one step
    EXPECT_NEAR(shape.at(t).gyro / shape.at(kBegin + 5).gyro, 1.0, 1e-12);
    EXPECT_NEAR(shape.at(t).accel / shape.at(kBegin + 5).accel, 1.0, 1e-12);
  }
}

TEST(NoiseShape, leaves_gaps_out) {
  ImuSeries imu = white_log(60, [](double) { return 2.0; });
  std::erase_if(imu, [](const ImuSample& s) { return s.t_s > kBegin + 20.3 && s.t_s < kBegin + 25.3; });
  const auto bridge = std::find_if(imu.begin(), imu.end(), [](const ImuSample& s) { return s.t_s > kBegin + 25.2; });
  bridge->omega_ib_b += Vector3d(1, 0, 0);  // anything may have happened
  bridge->f_ib_b += Vector3d(0, 5, 0);
  const auto loudest = [](const NoiseShape& shape) {
    double most = 0.0;
    for (const NoiseShape::Share& s : shape.seconds) most = std::max({most, s.gyro, s.accel});
    return most;
  };
  EXPECT_GT(loudest(shape_of(imu, 60)), 20.0);
  bridge->gap_s = 5.0;
  EXPECT_LT(loudest(shape_of(imu, 60)), 1.1 + 5 * kScatter);  // the floor inside the gap lowers the mean by 7 %
}

TEST(NoiseShape, mean_is_the_integral_of_at) {
  const auto times = [](double t) { return 1.0 + 4 * std::abs(std::sin(0.3 * t)); };
  const NoiseShape shape = shape_of(white_log(30, times), 30);
  const auto integral = [&](double from, double to) {
    constexpr int kParts = 20000;
    NoiseShape::Share sum{0.0, 0.0};
    for (int i = 0; i < kParts; ++i) {
      const NoiseShape::Share s = shape.at(from + (to - from) * (i + 0.5) / kParts);
      sum.gyro += s.gyro / kParts;
      sum.accel += s.accel / kParts;
    }
    return sum;
  };
  // within a second, over several, from and to whole ones, and beyond both ends of the log
  for (const auto& [from, to] : {std::pair{3.2, 3.7},
                                 {3.2, 9.9},
                                 {4.0, 5.0},
                                 {4.0, 12.0},
                                 {0.0, 30.0},
                                 {-3.0, 2.5},
                                 {27.5, 36.0},
                                 {-5.0, -2.0},
                                 {40.0, 41.0}}) {
    const NoiseShape::Share exact = integral(kBegin + from, kBegin + to), mean = shape.mean(kBegin + from, kBegin + to);
    EXPECT_NEAR(mean.gyro, exact.gyro, 2e-3) << from << " " << to;  // steps of the integral at the whole seconds
    EXPECT_NEAR(mean.accel, exact.accel, 2e-3) << from << " " << to;
  }
  EXPECT_EQ(shape.mean(kBegin + 7.5, kBegin + 7.5).gyro, shape.at(kBegin + 7.5).gyro);
}

}  // namespace
}  // namespace liealign
