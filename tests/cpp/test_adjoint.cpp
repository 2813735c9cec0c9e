// Laws of the smoother by information: back through an update, weighted, rejected or one of a re-acquisition, and over a
// transition it is what Rauch, Tung and Striebel's formulas give.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "liealign/estimate/filter_steps.hpp"
#include "liealign/observe/kinds.hpp"
#include "observations.hpp"

namespace liealign {
namespace {

using testing::normal3;
using testing::random_state;
using testing::sandwich;
using testing::times;

// Of any size, so that the compiler sees the formulas once.
using Cov = Eigen::MatrixXd;

template <int tail>
struct AnyTail {
  using Model = LieModel<double, tail>;
  using Tangent = typename Model::Tangent;
  static constexpr int kSize = tail;
};
template <typename Case>
class AdjointLaws : public ::testing::Test {};
using Tails = ::testing::Types<AnyTail<kNoTail>, AnyTail<kLongTail>>;
TYPED_TEST_SUITE(AdjointLaws, Tails);

// Errors so small that the group is linear: what is left of the second order is some 1e-6 of a sigma.
constexpr double kSmall = 1e-3;

Cov scaled(const Cov& M, const Eigen::VectorXd& s) { return M.cwiseProduct(times(s, s.transpose())); }

// Ratios of one: each component by its own sigma.
double relative(const Cov& difference, const Cov& P) {
  return scaled(difference, P.diagonal().cwiseSqrt().cwiseInverse()).cwiseAbs().maxCoeff();
}

// P^-1, by its correlations.
Cov inverse(const Cov& P) {
  const Eigen::VectorXd s = P.diagonal().cwiseSqrt().cwiseInverse();
  return scaled(scaled(P, s).inverse(), s);
}

Cov identity(Eigen::Index n) { return Cov::Identity(n, n); }

// A belief, an observation of it, and what the future says after the update: a smoothed belief beside it.
template <typename Case>
struct Scene {
  using Model = typename Case::Model;
  using Tangent = typename Case::Tangent;
  std::mt19937 rng{3};
  FilterOptions options;
  Belief<Model> before, after;
  Observation o;
  NodeChanges<Model> changes;
  ObservationMemory memory;
  Innovation<double> innovation;

  Scene() {
    before.X.first = random_state(rng).first;
    const Cov A = Cov::NullaryExpr(Model::Dim, Model::Dim, [&] { return normal3(rng).x(); });
    Tangent sigma = Tangent::Constant(0.1);
    sigma.template head<15>() << 0.01, 0.01, 0.02, 0.1, 0.1, 0.1, 0.5, 0.4, 0.5, 0.01, 0.01, 0.01, 1e-3, 1e-3, 1e-3;
    sigma *= kSmall;
    before.P = scaled(times(A, A.transpose()) / Model::Dim + 0.3 * identity(Model::Dim), sigma);
    o.kind = &kGnssPosition;
    o.t_s = 7.0;
    o.R = kSmall * kSmall * Vector3d(0.04, 0.05, 0.09).asDiagonal();
    o.root = kSmall * Matrix3d::Identity();
    o.lever_b = Vector3d(0.1, -0.05, -0.3);
  }

  // With a residual of so many sigmas along each axis.
  void observe(double sigmas) {
    after = before;
    typename Ekf<Model>::Tall Ht;
    o.y.setZero();
    const Sighting<double> seen = sight(o, options, ImuReading{Vector3d::Zero(), Vector3d::Zero()}, true, before, Ht);
    const Matrix3d S = sandwich(Ht.transpose(), before.P);
    o.y = -seen.z + sigmas * Matrix3d(S + seen.R).diagonal().cwiseSqrt();
    changes.clear();
    const Ekf<Model> ekf{options.dynamics, options.covariance_reset, options.tail};
    innovation = update(o, ekf, options, {Vector3d::Zero(), Vector3d::Zero()}, memory, after, &changes);
  }

  Adjoint<Model> future(Belief<Model>& smoothed) {
    const Tangent z =
        0.5 * after.P.diagonal().cwiseSqrt().cwiseProduct(Tangent::NullaryExpr([&] { return normal3(rng).x(); }));
    const Cov information = inverse(after.P);
    Cov P_s = inverse(Cov(1.7 * information + Cov(after.P.diagonal().cwiseInverse().asDiagonal())));
    smoothed = {Model::retract(after.X, z), P_s};
    if (options.covariance_reset) {
      smoothed.P = sandwich(Model::right_jacobian(z), P_s);
    }
    Adjoint<Model> adjoint;
    adjoint.lambda = information * z;
    adjoint.Lambda = sandwich(information, after.P - P_s);
    return adjoint;
  }
};

// The state at one time has one smoothed belief, before and after an update.
template <typename Case>
void expect_smoothed_is_the_same_before(Scene<Case>& s, double tolerance) {
  using Model = typename Case::Model;
  Belief<Model> smoothed;
  Adjoint<Model> adjoint = s.future(smoothed);
  const Belief<Model> at_end = adjoint.smoothed(s.after, s.options.covariance_reset);
  EXPECT_LT(relative(at_end.P - smoothed.P, smoothed.P), tolerance);
  adjoint.back_through(s.changes, s.options.covariance_reset);
  const Belief<Model> back = adjoint.smoothed(s.before, s.options.covariance_reset);
  const typename Case::Tangent sigma = smoothed.P.diagonal().cwiseSqrt();
  EXPECT_LT(Model::local(smoothed.X, back.X).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT(relative(back.P - smoothed.P, smoothed.P), tolerance);
}

// An ECEF position carries 1e-9 m against sigmas of 1e-4 m; the group is linear to kSmall of a sigma.
constexpr double kTolerance = 2e-3;

TYPED_TEST(AdjointLaws, goes_back_through_an_update_and_a_weighted_one) {
  for (const bool reset : {false, true}) {
    for (const double sigmas : {0.5, 6.0}) {
      Scene<TypeParam> s;
      s.options.covariance_reset = reset;
      s.options.gate = {Outliers::weight, 16.27};
      s.observe(sigmas);
      EXPECT_EQ(s.innovation.verdict, sigmas < 3.0 ? Verdict::used : Verdict::weighted);
      ASSERT_EQ(s.changes.size(), 1U);
      expect_smoothed_is_the_same_before(s, kTolerance);
    }
  }
}

// The covariances alone are linear: to rounding, whatever the weight.
TYPED_TEST(AdjointLaws, of_a_weight_is_that_of_the_gain_that_was_applied) {
  Scene<TypeParam> s;
  s.options.covariance_reset = false;
  s.options.gate = {Outliers::weight, 16.27};
  s.observe(6.0);
  const Correction<typename TypeParam::Model>& c = s.changes.front().correction;
  ASSERT_LT(c.weight, 0.9);
  Belief<typename TypeParam::Model> smoothed;
  Adjoint<typename TypeParam::Model> adjoint = s.future(smoothed);
  const Cov one = identity(TypeParam::Model::Dim), KH = times(c.K, c.Ht.transpose());
  EXPECT_LT(relative(s.after.P - sandwich(one - c.weight * KH, s.before.P) - c.weight * c.weight * sandwich(c.K, s.o.R),
                     s.after.P),
            1e-9);
  const double gain = c.weight * (2.0 - c.weight);
  const Cov Bt = (one - gain * KH).transpose();
  const Cov expected = sandwich(Bt, adjoint.Lambda) + gain * sandwich(c.Ht, c.S_inverse);
  const typename TypeParam::Tangent lambda = times(Bt, adjoint.lambda) + c.weight * times(c.Ht, c.S_inverse_z);
  adjoint.back_through(c, false);
  const Cov P = s.before.P;
  EXPECT_LT(relative(sandwich(P, adjoint.Lambda - expected), P), 1e-9);
  EXPECT_LT(times(P, adjoint.lambda - lambda).cwiseQuotient(P.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff(), 1e-9);
}

TYPED_TEST(AdjointLaws, of_a_rejected_update_changes_nothing) {
  Scene<TypeParam> s;
  s.options.gate = {Outliers::reject, 16.27};
  s.observe(6.0);
  EXPECT_EQ(s.innovation.verdict, Verdict::rejected);
  EXPECT_EQ(s.after.P, s.before.P);
  Belief<typename TypeParam::Model> smoothed;
  Adjoint<typename TypeParam::Model> adjoint = s.future(smoothed);
  const Adjoint<typename TypeParam::Model> at_end = adjoint;
  adjoint.back_through(s.changes, true);
  EXPECT_EQ(adjoint.lambda, at_end.lambda);
  EXPECT_EQ(adjoint.Lambda, at_end.Lambda);
}

// A re-acquisition is noise D that comes to the state before its fix: RTS over x' = x + d, then the update.
TYPED_TEST(AdjointLaws, of_a_reacquisition_is_rts_over_the_noise_that_it_adds) {
  using Model = typename TypeParam::Model;
  using Tangent = typename TypeParam::Tangent;
  Scene<TypeParam> s;
  s.options.gate = {Outliers::reject, 16.27};
  s.options.reacquire_after = 1;
  s.memory.reacquisition = {1, 2.0};
  s.observe(6.0);
  ASSERT_EQ(s.innovation.verdict, Verdict::reacquired);
  const double z2 = s.innovation.z.squaredNorm();
  Cov D = Cov::Zero(Model::Dim, Model::Dim);
  D.diagonal().segment<3>(kRho).setConstant(z2);
  D.diagonal().segment<3>(kNu).setConstant(z2 / 25.0);
  const Cov P = s.before.P, P_next = P + D;
  Belief<Model> smoothed;
  Adjoint<Model> adjoint = s.future(smoothed);
  adjoint.back_through(s.changes, true);
  const Belief<Model> back = adjoint.smoothed(s.before, true);
  // RTS, in the tangent of the state before.
  const Cov G = times(P, inverse(P_next));
  const Tangent z_s = Model::local(s.before.X, smoothed.X), x = times(G, z_s);
  const Cov J_0 = Cov(Model::right_jacobian(z_s)).inverse(), J_1 = Model::right_jacobian(x);
  const Cov expected = sandwich(J_1, P + sandwich(G, sandwich(J_0, smoothed.P) - P_next));
  const Tangent sigma = expected.diagonal().cwiseSqrt();
  EXPECT_LT((Model::local(s.before.X, back.X) - x).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), kTolerance);
  EXPECT_LT(relative(back.P - expected, expected), kTolerance);
}

TYPED_TEST(AdjointLaws, goes_back_over_a_transition_as_rts_does) {
  using Tangent = typename TypeParam::Tangent;
  constexpr int tail = TypeParam::kSize;
  Scene<TypeParam> s;
  TailModel m;
  m.sigma_c = 1.0;
  if constexpr (tail == kLongTail) m.tau_u_s = 20.0;
  m.baro_std_m = 1.0;
  const TailStep step = tail_step(m, 3.0);
  NavTransition<double> t;
  t.F = SquareMatrix<double, 9>::Identity() +
        0.1 * SquareMatrix<double, 9>::NullaryExpr([&] { return normal3(s.rng).x(); });
  t.B = Eigen::Matrix<double, 9, 6>::NullaryExpr([&] { return 0.3 * normal3(s.rng).x(); });
  Cov F = identity(TypeParam::Model::Dim);
  F.topLeftCorner<9, 9>() = t.F;
  F.block<9, 6>(0, 9) = t.B;
  for (int i = 0; i < tail; ++i) {
    F(kTail + i, kTail + i) = step.keep[static_cast<std::size_t>(i)];
    const int driver = TailStep::driver(i);
    if (driver >= 0 && driver < tail) F(kTail + i, kTail + driver) = step.from_driver[static_cast<std::size_t>(i)];
  }
  const Cov Q = 0.2 * s.before.P, P = s.before.P, P_next = sandwich(F, P) + Q;
  s.after.X = s.before.X;
  s.after.P = P_next;
  s.options.covariance_reset = false;
  Belief<typename TypeParam::Model> smoothed;
  Adjoint<typename TypeParam::Model> adjoint = s.future(smoothed);
  const Tangent z_s = times(P_next, adjoint.lambda);
  const Cov P_s = smoothed.P;
  adjoint.back_over(t, step);
  const Cov G = times(times(P, F.transpose()), inverse(P_next)), expected = P + sandwich(G, P_s - P_next);
  EXPECT_LT(relative(P - sandwich(P, adjoint.Lambda) - expected, expected), 1e-8);
  const Tangent sigma = expected.diagonal().cwiseSqrt();
  EXPECT_LT((times(P, adjoint.lambda) - times(G, z_s)).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 1e-8);
}

// What starts anew has no past: the future says nothing of what it was before.
TEST(Adjoint, of_what_is_drawn_anew_says_nothing_of_the_past) {
  Scene<AnyTail<kLongTail>> s;
  s.options.tail.sigma_c = 1.0;
  s.options.tail.tau_u_s = 10.0;
  s.options.tail.jitter_s = 1e-3;
  s.o.new_datum = true;
  s.observe(1.0);
  ASSERT_EQ(s.changes.size(), 3U);  // datum, jitter, correction
  Belief<LieModel<double, kLongTail>> smoothed;
  auto adjoint = s.future(smoothed);
  adjoint.back_through(s.changes, true);
  for (const int i : {kTailC, kTailC + 2, kTailU, kTailU + 2, kTailJitter}) {
    EXPECT_EQ(adjoint.lambda[kTail + i], 0.0) << i;
    EXPECT_TRUE(adjoint.Lambda.row(kTail + i).isZero(0.0) && adjoint.Lambda.col(kTail + i).isZero(0.0)) << i;
  }
  EXPECT_GT(adjoint.Lambda(kTail + kTailPositionLatency, kTail + kTailPositionLatency), 0.0);
}

}  // namespace
}  // namespace liealign
