// Laws of the density over the circle and of the two harmonics.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "liealign/align/harmonic_fit.hpp"
#include "liealign/align/heading_posterior.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

constexpr double kDeg = kDegToRad;

// `cost` of the distance to psi, by steps of a hundredth of sigma out to 6 of them and by 5 degrees beyond.
template <typename Cost>
std::vector<PosteriorSample> sampled_about(double psi, double sigma, Cost cost) {
  std::vector<PosteriorSample> samples;
  for (int i = -600; i <= 600; ++i) samples.push_back({psi + 0.01 * sigma * i, cost(0.01 * sigma * i)});
  for (double off = -179 * kDeg; off < kPi; off += 5 * kDeg) {
    if (std::abs(off) > 6.01 * sigma) samples.push_back({psi + off, cost(off)});
  }
  return samples;
}

template <typename Cost>
std::vector<PosteriorSample> circle(int n, Cost cost) {
  std::vector<PosteriorSample> samples;
  for (int i = 0; i < n; ++i) samples.push_back({2 * kPi * i / n, cost(2 * kPi * i / n)});
  return samples;
}

// Log-linear between the samples: (Eq. 61) of two of them.
double integral(const std::vector<PosteriorSample>& samples) {
  double sum = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const PosteriorSample &a = samples[i], &b = samples[(i + 1) % samples.size()];
    const double width =
        i + 1 < samples.size() ? b.heading_rad - a.heading_rad : b.heading_rad - a.heading_rad + 2 * kPi;
    const double p = std::exp(-a.cost), q = std::exp(-b.cost), rise = b.cost - a.cost;
    sum += width * (std::abs(rise) < 1e-4 ? 0.5 * (p + q) : (p - q) / rise);
  }
  return sum;
}

TEST(Posterior, of_a_narrow_normal_law_is_that_law_also_across_north) {
  for (const double psi : {0.0, 1e-9, 0.005 * kDeg, 137 * kDeg, 359.999 * kDeg, 2 * kPi - 1e-9}) {
    for (const double sigma : {0.01 * kDeg, 2 * kDeg}) {
      SCOPED_TRACE(std::to_string(psi / kDeg) + " deg, sigma " + std::to_string(sigma / kDeg));
      const HeadingPosterior p =
          heading_posterior(sampled_about(psi, sigma, [&](double x) { return 0.5 * x * x / (sigma * sigma); }), psi);
      // of a sigma: sampled to a hundredth of it, which chords of a parabola leave by the square of that
      const double close = 1e-3;
      EXPECT_NEAR(wrap_pi(p.mean_rad - psi) / sigma, 0.0, close);
      EXPECT_GE(p.mean_rad, 0.0);
      EXPECT_LT(p.mean_rad, 2 * kPi);
      EXPECT_NEAR((p.low_rad - psi) / sigma, -1.959964, close);
      EXPECT_NEAR((p.high_rad - psi) / sigma, 1.959964, close);
      EXPECT_NEAR(p.width_rad / sigma, 2 * 1.959964, 0.02);  // steps of the sampling
      ASSERT_EQ(p.modes.size(), 1u);
      EXPECT_NEAR(wrap_pi(p.modes[0].heading_rad - psi), 0.0, 1e-9);
      EXPECT_EQ(p.modes[0].mass, 1.0);
    }
  }
}

TEST(Posterior, mean_follows_the_mass_and_not_psi) {
  const double sigma = 0.1 * kDeg;
  for (const double truth : {0.05 * kDeg, 200 * kDeg}) {
    const double psi = truth - sigma;  // where the search has stopped
    const HeadingPosterior p =
        heading_posterior(sampled_about(truth, sigma, [&](double x) { return 0.5 * x * x / (sigma * sigma); }), psi);
    EXPECT_NEAR(wrap_pi(p.mean_rad - truth) / sigma, 0.0, 1e-3);
    EXPECT_NEAR((p.low_rad - psi) / sigma, 1 - 1.959964, 2e-3);
    EXPECT_NEAR((p.high_rad - psi) / sigma, 1 + 1.959964, 2e-3);
  }
}

TEST(Posterior, density_integrates_to_1_and_is_that_of_the_law) {
  const double sigma = 0.3 * kDeg;
  const HeadingPosterior narrow =
      heading_posterior(sampled_about(0.002, sigma, [&](double x) { return 0.5 * x * x / (sigma * sigma); }), 0.002);
  EXPECT_NEAR(integral(narrow.samples), 1.0, 1e-8);
  double highest = 0.0;
  for (const PosteriorSample& s : narrow.samples) highest = std::max(highest, std::exp(-s.cost));
  EXPECT_NEAR(highest * sigma * std::sqrt(2 * kPi), 1.0, 1e-4);
  const HeadingPosterior rough =
      heading_posterior(circle(24, [](double x) { return 3 * std::cos(x - 1) + 2 * std::sin(3 * x); }), 4.0);
  EXPECT_NEAR(integral(rough.samples), 1.0, 1e-12);
  for (std::size_t i = 1; i < rough.samples.size(); ++i)
    EXPECT_LT(rough.samples[i - 1].heading_rad, rough.samples[i].heading_rad);
}

TEST(Posterior, two_equal_peaks_are_two_modes_of_half_the_mass) {
  for (const double first : {0.0, 0.4, 3.0}) {
    // sampled where neither peak is an end of the list alone
    const auto cost = [&](double x) { return 40 * (1 - std::cos(2 * (x - first))); };
    const HeadingPosterior p = heading_posterior(circle(720, cost), first);
    ASSERT_EQ(p.modes.size(), 2u);
    for (const HeadingMode& m : p.modes) EXPECT_NEAR(m.mass, 0.5, 1e-3);
    EXPECT_NEAR(std::abs(wrap_pi(p.modes[0].heading_rad - p.modes[1].heading_rad)), kPi, 1e-9);
    EXPECT_LT(std::abs(std::remainder(p.modes[0].heading_rad - first, kPi)), 0.6 * kDeg);
    // the least set is two pieces of the interval of one: sigma^2 = 1 / (4 * 40)
    EXPECT_NEAR(p.width_rad, 2 * 2 * 1.96 / std::sqrt(160.0), 0.03 * 0.62);  // the law is a little wider than normal
  }
}

TEST(Posterior, modes_weigh_as_their_masses_the_heaviest_first) {
  const double sigma = 2 * kDeg;
  const auto peak = [&](double x, double at) { return std::exp(-0.5 * std::pow(wrap_pi(x - at) / sigma, 2)); };
  const HeadingPosterior p = heading_posterior(
      circle(3600, [&](double x) { return -std::log(peak(x, 10 * kDeg) + 3 * peak(x, 250 * kDeg) + 1e-12); }),
      250 * kDeg);
  ASSERT_EQ(p.modes.size(), 2u);
  EXPECT_NEAR(p.modes[0].mass, 0.75, 1e-3);
  EXPECT_NEAR(p.modes[1].mass, 0.25, 1e-3);
  EXPECT_NEAR(p.modes[0].heading_rad, 250 * kDeg, 1e-9);
  EXPECT_NEAR(p.modes[1].heading_rad, 10 * kDeg, 1e-9);
}

TEST(Posterior, a_ripple_of_less_than_half_a_nat_makes_no_modes) {
  const auto modes = [](double ripple) {
    const auto cost = [=](double x) { return 4 * (1 - std::cos(x)) + ripple * (1 - std::cos(20 * x)); };
    return heading_posterior(circle(720, cost), 0.0).modes;
  };
  EXPECT_EQ(modes(0.2).size(), 1u);
  EXPECT_GT(modes(1.0).size(), 1u);
  double sum = 0.0;
  for (const HeadingMode& m : modes(1.0)) sum += m.mass;
  EXPECT_NEAR(sum, 1.0, 1e-9);
}

TEST(Posterior, of_a_flat_circle_is_the_whole_circle) {
  for (const int n : {3, 24, 25}) {
    const HeadingPosterior p = heading_posterior(circle(n, [](double) { return 12.0; }), 1.0);
    EXPECT_NEAR(p.width_rad, 0.95 * 2 * kPi, 1e-9);
    EXPECT_NEAR(p.low_rad, 1.0 - 0.95 * kPi, 1e-9);
    EXPECT_NEAR(p.high_rad, 1.0 + 0.95 * kPi, 1e-9);
    ASSERT_EQ(p.modes.size(), 1u);
    EXPECT_EQ(p.modes[0].mass, 1.0);
    for (const PosteriorSample& s : p.samples) EXPECT_NEAR(std::exp(-s.cost), 1 / (2 * kPi), 1e-12);
  }
}

TEST(Posterior, does_not_depend_on_a_constant) {
  const auto cost = [](double x) { return 6 * std::cos(x - 2) + 3 * std::sin(2 * x) + 1.5 * std::cos(5 * x); };
  const HeadingPosterior a = heading_posterior(circle(72, cost), 5.0);
  for (const double constant : {-4000.0, 4096.0, 1e6}) {
    const HeadingPosterior b = heading_posterior(circle(72, [&](double x) { return cost(x) + constant; }), 5.0);
    const double close = 1e-8;  // rounding of a cost of 1e6, times a few hundred
    EXPECT_NEAR(a.mean_rad, b.mean_rad, close);
    EXPECT_NEAR(a.low_rad, b.low_rad, close);
    EXPECT_NEAR(a.high_rad, b.high_rad, close);
    EXPECT_NEAR(a.width_rad, b.width_rad, close);
    ASSERT_EQ(a.modes.size(), b.modes.size());
    for (std::size_t i = 0; i < a.modes.size(); ++i) EXPECT_NEAR(a.modes[i].mass, b.modes[i].mass, close);
    for (std::size_t i = 0; i < a.samples.size(); ++i) EXPECT_NEAR(a.samples[i].cost, b.samples[i].cost, close);
  }
}

TEST(Posterior, turns_with_its_samples) {
  const auto cost = [](double x) { return 6 * std::cos(x - 2) + 2 * std::sin(2 * x); };
  const HeadingPosterior a = heading_posterior(circle(360, cost), 5.0);
  for (const double turn : {0.7, 1.3, 4.0, -9.0}) {
    std::vector<PosteriorSample> turned = circle(360, cost);
    for (PosteriorSample& s : turned) s.heading_rad += turn;
    const HeadingPosterior b = heading_posterior(turned, 5.0 + turn);
    EXPECT_NEAR(wrap_pi(b.mean_rad - a.mean_rad - turn), 0.0, 1e-9);
    EXPECT_NEAR(b.low_rad - a.low_rad, turn, 1e-9);
    EXPECT_NEAR(b.high_rad - a.high_rad, turn, 1e-9);
    EXPECT_NEAR(b.width_rad, a.width_rad, 1e-9);
    ASSERT_EQ(b.modes.size(), a.modes.size());
    EXPECT_NEAR(b.modes[0].mass, a.modes[0].mass, 1e-9);
  }
}

TEST(Posterior, a_failed_filter_takes_no_mass) {
  const double sigma = 5 * kDeg;
  for (const double failure : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    const auto cost = [&](double x) {
      const double off = wrap_pi(x - 1.0);
      return std::abs(off) > 60 * kDeg ? failure : 0.5 * std::pow(off / sigma, 2);
    };
    const HeadingPosterior p = heading_posterior(circle(3600, cost), 1.0);
    EXPECT_NEAR(p.mean_rad, 1.0, 1e-3 * sigma);
    EXPECT_NEAR((p.high_rad - p.low_rad) / sigma, 2 * 1.96, 0.01);
    EXPECT_EQ(p.modes.size(), 1u);
  }
}

TEST(Harmonics, are_exact_on_two_of_them) {
  std::mt19937 rng(1);
  std::normal_distribution<double> normal;
  for (const int n : {5, 8, 13}) {
    const HarmonicFit truth{normal(rng), {normal(rng), normal(rng)}, {normal(rng), normal(rng)}, 0.0};
    std::vector<double> y;
    for (int i = 0; i < n; ++i) y.push_back(truth.at(2 * kPi * i / n));
    const HarmonicFit fit = fit_harmonics(y);
    EXPECT_NEAR(fit.mean, truth.mean, 1e-14);
    for (int m = 0; m < 2; ++m) {
      EXPECT_NEAR(fit.c[m], truth.c[m], 1e-14);
      EXPECT_NEAR(fit.s[m], truth.s[m], 1e-14);
    }
    EXPECT_LT(fit.worst, 1e-13);
    const double psi = 0.4;  // between the samples, (Eq. 60) as printed
    EXPECT_NEAR(fit.at(psi),
                truth.mean + truth.c[0] * std::cos(psi) + truth.s[0] * std::sin(psi) + truth.c[1] * std::cos(2 * psi) +
                    truth.s[1] * std::sin(2 * psi),
                1e-13);
  }
}

TEST(Harmonics, worst_is_the_largest_residual) {
  std::vector<double> third;  // orthogonal to the two: all of it is left
  for (int i = 0; i < 8; ++i) third.push_back(5 + std::cos(2 * kPi * i / 8) + 0.25 * (i % 2 == 0 ? 1 : -1));
  EXPECT_NEAR(fit_harmonics(third).worst, 0.25, 1e-14);
  std::mt19937 rng(2);
  std::normal_distribution<double> normal;
  std::vector<double> y;
  for (int i = 0; i < 12; ++i) y.push_back(normal(rng));
  const HarmonicFit fit = fit_harmonics(y);
  double worst = 0.0;
  for (int i = 0; i < 12; ++i)
    worst = std::max(worst, std::abs(y[static_cast<std::size_t>(i)] - fit.at(2 * kPi * i / 12)));
  EXPECT_GT(worst, 0.1);
  EXPECT_NEAR(fit.worst, worst, 1e-14);
}

}  // namespace
}  // namespace liealign
