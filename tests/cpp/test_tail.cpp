// Laws of the tail: its step is the solution of its differential equations, leaves the prior as it is, and goes through the
// filter's covariance as the matrix that it is.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "liealign/estimate/ekf.hpp"
#include "liealign/estimate/lie_model.hpp"
#include "numeric.hpp"

namespace liealign {
namespace {

using Tail = SquareMatrix<double, kLongTail>;
using Double = SquareMatrix<double, 2 * kLongTail>;

// Of orders and times as they come: the driver faster, slower, close to c, and equal.
std::vector<TailModel> some_models() {
  std::vector<TailModel> models;
  for (const double tau_u : {0.0, 0.5, 20.0, 99.9, 99.999, 100.0, 100.2, 400.0}) {
    TailModel m;
    m.sigma_c = 1.3;
    m.tau_c_s = 100.0;
    m.tau_u_s = tau_u;
    m.sigma_s_mps = 0.02;
    m.tau_s_s = 2.5;
    m.latency_std_s = 1e-3;
    m.velocity_latency_std_s = 2e-3;
    m.jitter_s = 5e-4;
    m.baro_std_m = 1.7;
    models.push_back(m);
  }
  return models;
}

// x' = A x + w, E w w' = W, of all components: the definitions, not their solution.
struct Process {
  Tail A = Tail::Zero(), W = Tail::Zero();

  explicit Process(const TailModel& m) {
    const auto markov = [&](int i, double variance, double tau) {
      A(i, i) = -1.0 / tau;
      W(i, i) = 2.0 * variance / tau;
    };
    for (int i = 0; i < 3; ++i) {
      const double variance_c = m.sigma_c * m.sigma_c;
      if (m.tau_u_s > 0.0) {
        A(kTailC + i, kTailC + i) = -1.0 / m.tau_c_s;
        A(kTailC + i, kTailU + i) = 1.0;
        markov(kTailU + i, variance_c / m.tau_c_s * (1.0 / m.tau_c_s + 1.0 / m.tau_u_s), m.tau_u_s);
      } else {
        markov(kTailC + i, variance_c, m.tau_c_s);
      }
      markov(kTailS + i, m.sigma_s_mps * m.sigma_s_mps, m.tau_s_s);
    }
    markov(kTailBaro, m.baro_std_m * m.baro_std_m, m.baro_tau_s);
  }
};

struct Solved {
  Tail F, Q;
};

// Van Loan (1978) over a short time, exp([-A W; 0 A^T] h) = [.. F^-1 Q; 0 F^T], and doubled until T: no large exponent.
Solved solved(const Process& p, double T) {
  int doublings = 0;
  for (double h = T; h * p.A.cwiseAbs().maxCoeff() > 0.1; h /= 2.0) ++doublings;
  const double h = T / std::pow(2.0, doublings);
  Double M = Double::Zero(), sum = Double::Identity(), term = sum;
  M.topLeftCorner<kLongTail, kLongTail>() = -p.A * h;
  M.topRightCorner<kLongTail, kLongTail>() = p.W * h;
  M.bottomRightCorner<kLongTail, kLongTail>() = p.A.transpose() * h;
  for (int n = 1; n < 25; ++n) {
    term = (term * M / n).eval();
    sum += term;
  }
  Solved s;
  s.F = sum.bottomRightCorner<kLongTail, kLongTail>().transpose();
  s.Q = s.F * sum.topRightCorner<kLongTail, kLongTail>();
  for (int i = 0; i < doublings; ++i) {
    s.Q = (testing::sandwich(s.F, s.Q) + s.Q).eval();
    s.F = (s.F * s.F).eval();
  }
  return s;
}

Solved as_matrices(const TailStep& step) {
  Solved s{Tail::Zero(), Tail::Zero()};
  for (int i = 0; i < kLongTail; ++i) {
    const auto at = static_cast<std::size_t>(i);
    s.F(i, i) = step.keep[at];
    s.Q(i, i) = step.noise[at];
    const int driver = TailStep::driver(i);
    if (driver < 0) continue;
    s.F(i, driver) = step.from_driver[at];
    s.Q(i, driver) = s.Q(driver, i) = step.with_driver[at];
  }
  return s;
}

constexpr double kTimes[] = {1e-4, 5e-3, 0.2, 1.0, 30.0, 100.0, 2000.0, 1e5};

TEST(Tail, step_solves_the_differential_equations) {
  for (const TailModel& m : some_models()) {
    const Process process(m);
    for (const double T : kTimes) {
      const Solved expected = solved(process, T), step = as_matrices(tail_step(m, T));
      EXPECT_LT((step.F - expected.F).cwiseAbs().maxCoeff(), 1e-11 * (1.0 + expected.F.cwiseAbs().maxCoeff()))
          << "tau_u " << m.tau_u_s << " T " << T;
      // Relative to each noise; of one that grows by T^3 what is left of a stationary covariance of 1 is its rounding.
      const Vector<double, kLongTail> stationary = tail_prior(m).diagonal().cwiseSqrt();
      for (int i = 0; i < kLongTail; ++i) {
        for (int j = 0; j < kLongTail; ++j) {
          const double sigma = std::sqrt(expected.Q(i, i) * expected.Q(j, j));
          EXPECT_NEAR(step.Q(i, j), expected.Q(i, j), 1e-9 * sigma + 2e-16 * stationary[i] * stationary[j])
              << i << " " << j << " tau_u " << m.tau_u_s << " T " << T;
        }
      }
    }
  }
}

TEST(Tail, prior_is_what_the_step_leaves_as_it_is) {
  for (const TailModel& m : some_models()) {
    Tail P = tail_prior(m);
    // The jitter is no process: it starts anew with every message.
    EXPECT_EQ(P(kTailJitter, kTailJitter), 0.0);
    for (const double T : kTimes) {
      const Solved step = as_matrices(tail_step(m, T));
      EXPECT_LT((testing::sandwich(step.F, P) + step.Q - P).cwiseAbs().maxCoeff(), 1e-14) << m.tau_u_s << " " << T;
    }
    EXPECT_GE(Eigen::SelfAdjointEigenSolver<Tail>(P).eigenvalues().minCoeff(), -1e-14);
    EXPECT_NEAR(P(kTailC, kTailC), m.sigma_c * m.sigma_c, 1e-15);
  }
}

TEST(Tail, two_steps_are_one) {
  for (const TailModel& m : some_models()) {
    const Solved first = as_matrices(tail_step(m, 0.7)), second = as_matrices(tail_step(m, 41.0)),
                 both = as_matrices(tail_step(m, 41.7));
    EXPECT_LT((second.F * first.F - both.F).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((testing::sandwich(second.F, first.Q) + second.Q - both.Q).cwiseAbs().maxCoeff(), 1e-13);
  }
}

TEST(Tail, latencies_walk_where_they_are_not_given) {
  TailModel m;
  m.latency_std_s = 0.2;
  m.latency_walk = 7e-4;
  const TailStep step = tail_step(m, 2.5);
  EXPECT_DOUBLE_EQ(step.noise[kTailPositionLatency], 2.5 * 7e-4 * 7e-4);
  EXPECT_EQ(step.keep[kTailPositionLatency], 1.0);
  EXPECT_EQ(step.noise[kTailVelocityLatency], 0.0);
}

TEST(Tail, error_step_is_the_tail_step_of_c) {
  for (const TailModel& m : some_models()) {
    for (const double T : kTimes) {
      const ErrorStep one = error_step(m, T);
      const TailStep all = tail_step(m, T);
      for (std::size_t i = kTailC; i < kTailC + 3; ++i) {
        EXPECT_EQ(one.keep, all.keep[i]);
        EXPECT_EQ(one.from_driver, all.from_driver[i]);
        EXPECT_EQ(one.noise, all.noise[i]);
        EXPECT_EQ(one.with_driver, all.with_driver[i]);
      }
    }
  }
  EXPECT_EQ(error_step({}, 3.0).keep, 1.0);
  EXPECT_EQ(error_step({}, 3.0).noise, 0.0);
}

TEST(Tail, says_what_it_needs) {
  TailModel m;
  EXPECT_TRUE(m.is_empty());
  m.tau_u_s = 5.0;  // of nothing
  EXPECT_TRUE(m.is_empty() && !m.is_long());
  m.sigma_c = 1.0;
  EXPECT_TRUE(m.is_long() && m.is_coloured());
  m.tau_u_s = 0.0;
  EXPECT_FALSE(m.is_long() || m.is_empty());
  m.sigma_s_mps = 0.1;
  EXPECT_TRUE(m.is_long() && !m.is_coloured());
}

template <int tail>
void expect_filter_moves_the_tail(const TailModel& m) {
  using Model = LieModel<double, tail>;
  using Cov = typename Model::Covariance;
  std::mt19937 rng(1);
  Belief<Model> belief;
  const Cov A = Cov::NullaryExpr([&] { return testing::normal3(rng).x(); });
  belief.P = A * A.transpose();
  for (int i = 0; i < 6 + tail; ++i) belief.X.second.x[i] = testing::normal3(rng).x();
  const Belief<Model> before = belief;
  const TailStep step = tail_step(m, 7.0);
  Ekf<Model>::predict_tail(belief, step);
  const Solved s = as_matrices(step);
  Cov F = Cov::Identity(), Q = Cov::Zero();
  F.template bottomRightCorner<tail, tail>() = s.F.template topLeftCorner<tail, tail>();
  Q.template bottomRightCorner<tail, tail>() = s.Q.template topLeftCorner<tail, tail>();
  const Cov expected = testing::sandwich(F, before.P) + Q;
  EXPECT_LT((belief.P - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff());
  const Vector<double, 6 + tail> x = F.template bottomRightCorner<6 + tail, 6 + tail>() * before.X.second.x;
  EXPECT_LT((belief.X.second.x - x).norm(), 1e-13 * x.norm());
}

TEST(Tail, step_in_the_filter_is_a_matrix_product) {
  for (const TailModel& m : some_models()) {
    expect_filter_moves_the_tail<kLongTail>(m);
    if (m.is_coloured()) continue;
    TailModel brief = m;
    brief.sigma_s_mps = 0.0;
    expect_filter_moves_the_tail<kShortTail>(brief);
  }
}

}  // namespace
}  // namespace liealign
