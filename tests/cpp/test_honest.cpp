// Stated sigmas are true: flights from starts drawn from P_0 through the final run, errors over sigmas. benchmarks/honest.py does
// the same for every case and many more flights.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "liealign/study/honest.hpp"

namespace liealign {
namespace {

constexpr std::size_t kFlights = 8;

struct Limits {
  double low, high;
};

// The limits of the case are 0.7 to 1.3 for a block; eight flights spread it by some 0.1 more.
constexpr Limits kBlock = {0.65, 1.4};

HonestCase case_with(const Vector3d& white_m, const Vector3d& correlated_m, double stated_m) {
  HonestCase honest;
  honest.config.imu.model = "icm42688p";
  honest.gnss.l_ba_b = Vector3d(0.1, -0.05, -0.3);
  honest.gnss.latency_s = 0.1;
  honest.gnss.std_ned_m = white_m;
  honest.gnss.correlated_std_ned_m = correlated_m;
  honest.gnss.stated_std_ned_m = Vector3d::Constant(stated_m);
  return honest;
}

// Root mean square of error over sigma of the channels [first, first + 3).
double over_sigma(const std::vector<HonestRun>& runs, std::size_t first) {
  double sum = 0.0, n = 0.0;
  for (const HonestRun& run : runs) {
    for (const HonestEpoch& epoch : run.epochs) {
      for (std::size_t i = first; i < first + 3; ++i) {
        sum += std::pow(epoch.error[i] / epoch.sigma[i], 2);
        n += 1.0;
      }
    }
  }
  return std::sqrt(sum / n);
}

void expect_honest(const HonestCase& honest, std::size_t position, Limits absolute) {
  const std::vector<HonestRun> runs = honest_runs(honest, 1, kFlights);
  for (const HonestRun& run : runs) {
    EXPECT_EQ(run.failure, "");
    EXPECT_GT(run.epochs.size(), 20u);
    for (const HonestEpoch& epoch : run.epochs) {
      for (std::size_t i = 0; i < epoch.sigma.size(); ++i) EXPECT_GT(epoch.sigma[i], 0.0) << kHonestChannels[i];
    }
  }
  for (const auto& [name, first] : {std::pair<const char*, std::size_t>{"attitude", 0},
                                    {"velocity", 3},
                                    {"position", position},
                                    {"b_a", 12},
                                    {"b_g", 15}}) {
    const double z = over_sigma(runs, first);
    EXPECT_GT(z, kBlock.low) << name;
    EXPECT_LT(z, kBlock.high) << name;
  }
  const double z = over_sigma(runs, 6);
  EXPECT_GT(z, absolute.low);
  EXPECT_LT(z, absolute.high);
}

TEST(Honest, sigmas_are_true_with_white_errors_that_are_given) {
  HonestCase honest = case_with(Vector3d::Constant(0.01), Vector3d::Zero(), 0.01);
  honest.config.gnss.error_model = "white";
  honest.config.gnss.latency_s = honest.gnss.latency_s;
  honest.config.gnss.std_scale = honest.config.imu.noise_scale = 1.0;
  expect_honest(honest, 6, kBlock);
}

TEST(Honest, sigmas_are_true_with_fixed_ambiguities_by_likelihood) {
  HonestCase honest = case_with(Vector3d::Constant(0.005), Vector3d::Constant(0.008), 0.01);
  honest.gnss.correlation_time_s = 60.0;
  expect_honest(honest, 9, {0.6, 1.3});
}

// Eight draws of an error that goes on for two minutes leave the absolute position open by a third.
TEST(Honest, sigmas_are_true_with_code_alone_by_likelihood) {
  HonestCase honest = case_with(Vector3d::Constant(0.03), Vector3d::Constant(1.5), 1.5);
  honest.gnss.correlation_time_s = 120.0;
  honest.gnss.velocity = true;
  honest.gnss.velocity_std_ned = Vector3d::Constant(0.1);
  honest.gnss.fix = 5;
  expect_honest(honest, 9, {0.6, 1.4});
}

// An error of first order is found to be one, and outliers do not make it drift: 1.5 times as much where they stay in the fit.
TEST(Honest, a_first_order_error_is_found_beside_outliers) {
  HonestCase honest = case_with(Vector3d::Constant(0.03), Vector3d::Constant(1.5), 1.5);
  honest.gnss.correlation_time_s = 120.0;
  honest.gnss.velocity = true;
  honest.gnss.fix = 5;
  honest.gnss.outlier_probability = 0.05;
  honest.gnss.outlier_m = 20.0;
  for (const HonestRun& run : honest_runs(honest, 1, 4)) {
    EXPECT_EQ(run.parameters.tau_u_s, 0.0) << run.seed;
    EXPECT_NEAR(std::pow(run.parameters.sigma_c, 2) / run.parameters.tau_c_s * 120.0, 1.0, 0.3) << run.seed;
  }
}

TEST(Honest, the_start_is_drawn_from_what_it_states) {
  const HonestCase honest = case_with(Vector3d::Constant(0.01), Vector3d::Zero(), 0.01);
  const SimulatedFlight simulated = honest_flight(honest, 3);
  const PreparedFlight flight = prepare_flight(simulated.flight);
  const double take_off_s = simulated.truth.epochs.front().t_s + honest.parked_s;
  double sum = 0.0;
  constexpr std::uint64_t kDraws = 400;
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    const HonestStart start = honest_start(honest, simulated, flight, take_off_s, seed);
    NavState<double> X_true{truth_at(simulated.truth, start.cursor.t_s), {}};
    const std::size_t k = start.cursor.k - 1;
    X_true.second.x << simulated.b_a[k], simulated.b_g[k];
    const LieModel<double>::Tangent eps = LieModel<double>::local(start.belief.X, X_true);
    sum += eps.dot(start.belief.P.ldlt().solve(eps));
  }
  // Chi-square of 15 * 400: five of its sigmas.
  EXPECT_NEAR(sum / static_cast<double>(kDraws), 15.0, 5.0 * std::sqrt(2.0 * 15.0 / static_cast<double>(kDraws)));
}

}  // namespace
}  // namespace liealign
