// Laws of the search in several variables, and of the sigmas by blocks of the log.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "liealign/align/block_misfit.hpp"
#include "liealign/align/surface_search.hpp"

namespace liealign {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

SurfaceVector vector_of(std::initializer_list<double> values) {
  SurfaceVector x(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), x.data());
  return x;
}

SurfaceVector normal_vector(std::mt19937& rng, Eigen::Index n) {
  std::normal_distribution<double> normal;
  SurfaceVector x(n);
  for (double& value : x) value = normal(rng);
  return x;
}

// Sigmas from 0.001 to 10, correlations up to some 0.9.
SurfaceMatrix random_information(std::mt19937& rng, Eigen::Index n) {
  SurfaceMatrix A(n, n);
  for (Eigen::Index j = 0; j < n; ++j) A.col(j) = normal_vector(rng, n);
  std::uniform_real_distribution<double> decade(-1.0, 3.0);
  SurfaceVector scale(n);
  for (double& s : scale) s = std::pow(10.0, decade(rng));
  return scale.asDiagonal() * (A * A.transpose() + 0.3 * SurfaceMatrix::Identity(n, n)) * scale.asDiagonal();
}

struct Ended {
  SurfaceSearch search;
  int rounds = 0;
};

// `watch` sees the points of each round and their values before the search is told.
template <typename Cost, typename Watch>
Ended run(const SurfaceVector& centre, const SurfaceVector& steps, Cost cost, Watch watch, SurfaceLimits limits = {}) {
  Ended r{SurfaceSearch(centre, steps, limits)};
  for (; !r.search.done(); ++r.rounds) {
    std::vector<double> y;
    for (const SurfaceVector& x : r.search.ask()) y.push_back(cost(x));
    watch(r.search.ask(), y);
    r.search.tell(y);
  }
  return r;
}

template <typename Cost>
Ended run(const SurfaceVector& centre, const SurfaceVector& steps, Cost cost, SurfaceLimits limits = {}) {
  return run(
      centre, steps, cost, [](const auto&, const auto&) {}, limits);
}

TEST(SurfaceSearch, is_exact_on_a_quadratic_however_correlated) {
  std::mt19937 rng(1);
  for (const Eigen::Index n : {1, 3, 5}) {
    for (int draw = 0; draw < 20; ++draw) {
      const SurfaceMatrix H = random_information(rng, n);
      const SurfaceVector conditional = H.diagonal().cwiseSqrt().cwiseInverse(), x0 = normal_vector(rng, n);
      const auto cost = [&](const SurfaceVector& x) { return 7.0 + 0.5 * (x - x0).dot(H * (x - x0)); };
      // Every other draw begins next to the minimum and ends at once, with steps that are no equal parts of the sigmas.
      const double off = draw % 2 == 0 ? 2.0 : 0.01;
      const SurfaceVector start = x0 + off * conditional.cwiseProduct(normal_vector(rng, n));
      const SurfaceVector steps = conditional.cwiseProduct(SurfaceVector::LinSpaced(n, 0.8, 2.5));
      const Ended r = run(start, steps, cost);
      SCOPED_TRACE(std::to_string(n) + " variables, draw " + std::to_string(draw));
      ASSERT_TRUE(r.search.settled());
      const Surface& s = r.search.surface();
      EXPECT_TRUE(s.has_minimum);
      EXPECT_NEAR(s.minimum_y, 7.0, 1e-8);
      const SurfaceMatrix H_sigmas = conditional.asDiagonal() * H * conditional.asDiagonal();
      const SurfaceMatrix found = conditional.asDiagonal() * s.information * conditional.asDiagonal();
      EXPECT_LT((found - H_sigmas).cwiseAbs().maxCoeff(), 1e-8);
      EXPECT_LT((s.covariance() * H - SurfaceMatrix::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-4);
      EXPECT_LT((s.minimum - x0).cwiseQuotient(conditional).cwiseAbs().maxCoeff(), 1e-6);
    }
  }
}

TEST(SurfaceSearch, does_not_depend_on_the_units_of_its_variables) {
  const auto cost = [](double a, double b) {
    return std::log1p(0.5 * a * a) + 0.5 * std::pow(b - 0.3 * a + 0.1 * a * a, 2);
  };
  const SurfaceVector unit = vector_of({1e-4, 1e3});
  const auto one = [&](const SurfaceVector& x) { return cost(x[0], x[1]); };
  const auto other = [&](const SurfaceVector& x) { return cost(x[0] / unit[0], x[1] / unit[1]); };
  const Ended a = run(vector_of({2.0, 1.0}), vector_of({0.5, 0.5}), one);
  const Ended b = run(vector_of({2e-4, 1e3}), vector_of({0.5e-4, 0.5e3}), other);
  EXPECT_EQ(a.rounds, b.rounds);
  EXPECT_LT((a.search.surface().minimum - b.search.surface().minimum.cwiseQuotient(unit)).norm(), 1e-6);
}

TEST(SurfaceSearch, follows_a_curved_valley_to_its_minimum) {
  // A valley five times as narrow as its way is wide, bent like a banana; started 8 sigmas up its length.
  const auto cost = [](const SurfaceVector& x) {
    const double across = x[1] - 0.15 * x[0] * x[0];
    return 0.5 * x[0] * x[0] + 0.5 * across * across / 0.04;
  };
  for (const double side : {-1.0, 1.0}) {
    const Ended r = run(vector_of({8.0 * side, 9.0}), vector_of({1.0, 0.2}), cost);
    ASSERT_TRUE(r.search.settled());
    EXPECT_NEAR(r.search.surface().minimum[0], 0.0, 0.1);  // sigmas: the tolerance of SurfaceLimits
    EXPECT_NEAR(r.search.surface().minimum[1], 0.0, 0.1 * 0.2);
    EXPECT_TRUE(r.search.surface().has_minimum);
  }
}

TEST(SurfaceSearch, comes_down_concave_flanks) {
  // A bounded loss: concave beyond 4 sigmas, here begun at 5 to 30 of them.
  const SurfaceMatrix H = (SurfaceMatrix(2, 2) << 1.0, 0.5, 0.5, 1.0).finished();
  const auto cost = [&](const SurfaceVector& x) { return 8.0 * std::log1p(x.dot(H * x) / 16.0); };
  for (const double far : {5.0, 10.0, 30.0}) {
    const Ended r = run(vector_of({far, -0.3 * far}), vector_of({1.0, 1.0}), cost);
    SCOPED_TRACE(far);
    ASSERT_TRUE(r.search.settled());
    EXPECT_LT(r.search.surface().minimum.norm(), 0.1);
    // stencils of 1.5 sigmas see a little of the flanks
    EXPECT_LT((r.search.surface().information - H).cwiseAbs().maxCoeff(), 0.2);
  }
}

TEST(SurfaceSearch, retreats_to_the_lowest_point_seen) {
  // Begun where the curvature is about zero: the fit leaps across the minimum and up the other side.
  const auto cost = [](const SurfaceVector& x) { return 20.0 * (1.0 - std::cos(x[0])) + 0.5 * x[1] * x[1]; };
  double lowest = kInfinity;
  SurfaceVector lowest_at;
  bool back = false;
  int retreats = 0;
  const auto watch = [&](const std::vector<SurfaceVector>& points, const std::vector<double>& y) {
    if (back) {
      EXPECT_LT((points[0] - lowest_at).norm(), 1e-12);
    }
    back = y[0] > lowest + 0.5;
    retreats += back ? 1 : 0;
    for (std::size_t i = 0; i < y.size(); ++i) {
      if (y[i] < lowest) lowest = y[i], lowest_at = points[i];
    }
  };
  const Ended r = run(vector_of({1.6, 0.5}), vector_of({1.0, 1.0}), cost, watch);
  EXPECT_GT(retreats, 0);
  ASSERT_TRUE(r.search.settled());
  EXPECT_NEAR(r.search.surface().minimum[0], 0.0, 0.1 / std::sqrt(20.0));  // a tenth of its sigma
}

TEST(SurfaceSearch, survives_evaluations_that_fail) {
  for (const double failure : {kNan, kInfinity}) {
    const auto cost = [&](const SurfaceVector& x) {
      return x[0] > 3.0 || x[1] < -2.5 ? failure : 0.5 * x.squaredNorm();
    };
    const Ended r = run(vector_of({2.8, -2.2}), vector_of({1.0, 1.0}), cost);
    ASSERT_TRUE(r.search.settled());
    EXPECT_LT(r.search.surface().minimum.norm(), 1e-6);
    EXPECT_LT((r.search.surface().information - SurfaceMatrix::Identity(2, 2)).norm(), 1e-6);
    const Ended nothing = run(vector_of({5.0, 0.0}), vector_of({0.1, 0.1}), cost);
    EXPECT_FALSE(nothing.search.settled());
    EXPECT_FALSE(nothing.search.surface().has_minimum);
  }
}

TEST(SurfaceSearch, has_no_minimum_on_a_flat_or_a_saddle) {
  const Ended flat = run(vector_of({1.0, 2.0}), vector_of({1.0, 1.0}), [](const SurfaceVector&) { return 3.0; });
  EXPECT_FALSE(flat.search.settled());
  EXPECT_FALSE(flat.search.surface().has_minimum);
  for (const double off : {0.0, 0.3}) {
    const Ended saddle = run(vector_of({1.0, off}), vector_of({1.0, 1.0}),
                             [](const SurfaceVector& x) { return x[0] * x[0] - x[1] * x[1]; });
    EXPECT_FALSE(saddle.search.settled());
    EXPECT_FALSE(saddle.search.surface().has_minimum);
  }
}

TEST(SurfaceSearch, ends_within_its_rounds) {
  for (const int most : {1, 4, 20}) {
    for (const Eigen::Index n : {1, 3}) {
      const auto watch = [&](const std::vector<SurfaceVector>& points, const std::vector<double>&) {
        EXPECT_EQ(points.size(), static_cast<std::size_t>(1 + n + n * n));  // the stencil of (Eq. 59)
      };
      const Ended r = run(SurfaceVector::Zero(n), SurfaceVector::Ones(n),
                          [](const SurfaceVector& x) { return -x.sum(); }, watch, {0.1, most});
      EXPECT_EQ(r.rounds, most);
      EXPECT_FALSE(r.search.settled());
    }
  }
}

TEST(SurfaceSearch, axis_index_names_the_points_on_the_axes) {
  for (const Eigen::Index n : {1, 2, 5}) {
    const SurfaceVector centre = SurfaceVector::LinSpaced(n, 1.0, 2.0), steps = SurfaceVector::LinSpaced(n, 0.1, 0.5);
    const SurfaceSearch search(centre, steps, {});
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t plus = SurfaceSearch::axis_index(i, n);
      const SurfaceVector h = steps[i] * SurfaceVector::Unit(n, i);
      EXPECT_LT((search.ask()[plus] - centre - h).norm(), 1e-15);
      EXPECT_LT((search.ask()[plus + 1] - centre + h).norm(), 1e-15);
    }
  }
}

// The stencil of a score of one term a second, whose gradients are normal with the information H in sum, `run_s`
// successive ones the same.
std::vector<CandidateScore> stencil_of(std::mt19937& rng, const SurfaceMatrix& H, const SurfaceVector& steps,
                                       int seconds, int run_s) {
  const Eigen::Index n = steps.size();
  const SurfaceMatrix L = (H / seconds).llt().matrixL();
  std::vector<CandidateScore> stencil(static_cast<std::size_t>(1 + n + n * n));
  SurfaceVector g;
  for (int t = 0; t < seconds; ++t) {
    if (t % run_s == 0) g = L * normal_vector(rng, n);
    for (CandidateScore& s : stencil) s.terms.push_back({100.0 + t, 1.0});
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t plus = SurfaceSearch::axis_index(i, n);
      stencil[plus].terms.back().cost += g[i] * steps[i];
      stencil[plus + 1].terms.back().cost -= g[i] * steps[i];
    }
  }
  return stencil;
}

const SurfaceMatrix kH = (SurfaceMatrix(2, 2) << 4.0, -300.0, -300.0, 90000.0).finished();
const SurfaceMatrix kCovariance = kH.llt().solve(SurfaceMatrix::Identity(2, 2));
const SurfaceVector kSteps = vector_of({0.5, 0.003});

TEST(BlockMisfit, is_1_where_the_gradients_are_independent) {
  std::mt19937 rng(2);
  int above = 0;
  for (int draw = 0; draw < 200; ++draw) {
    const SurfaceVector misfit = block_misfit(kCovariance, kSteps, stencil_of(rng, kH, kSteps, 400, 1));
    above += (misfit.array() > 1.0).cast<int>().sum();
    EXPECT_LT(misfit.maxCoeff(), 1.6);  // 7 sigmas of the ratio of 40 blocks
  }
  EXPECT_LT(above, 0.06 * 400);  // beyond two sigmas of a chi-square of 40: 3.2 %
}

TEST(BlockMisfit, is_the_root_of_how_many_gradients_in_a_row_are_one) {
  std::mt19937 rng(3);
  for (const int run_s : {2, 5, 10}) {
    const SurfaceVector misfit = block_misfit(kCovariance, kSteps, stencil_of(rng, kH, kSteps, 4000, run_s));
    const double scatter = 1.0 / std::sqrt(2.0 * 400);  // of the root of the mean of 400 squares
    for (const double m : misfit) EXPECT_NEAR(m / std::sqrt(run_s), 1.0, 4.0 * scatter) << run_s;
  }
}

TEST(BlockMisfit, is_the_factor_by_which_all_gradients_are_larger) {
  std::mt19937 rng(4);
  const SurfaceVector misfit = block_misfit(kCovariance, kSteps, stencil_of(rng, 9.0 * kH, kSteps, 4000, 1));
  for (const double m : misfit) EXPECT_NEAR(m / 3.0, 1.0, 4.0 / std::sqrt(2.0 * 400));
}

TEST(BlockMisfit, is_1_for_a_log_of_less_than_ten_blocks_or_a_filter_that_stopped) {
  std::mt19937 rng(5);
  EXPECT_EQ(block_misfit(kCovariance, kSteps, stencil_of(rng, 100.0 * kH, kSteps, 90, 1)).maxCoeff(), 1.0);
  std::vector<CandidateScore> whole = stencil_of(rng, 100.0 * kH, kSteps, 91, 1);
  EXPECT_GT(block_misfit(kCovariance, kSteps, whole).minCoeff(), 4.0);
  whole[SurfaceSearch::axis_index(1, 2)].terms.pop_back();
  EXPECT_EQ(block_misfit(kCovariance, kSteps, whole).maxCoeff(), 1.0);
}

}  // namespace
}  // namespace liealign
