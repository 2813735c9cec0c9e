// Laws of preintegration: the interval equals the samples, one by one, in state, transition and noise.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "liealign/estimate/ekf.hpp"
#include "liealign/estimate/intervals.hpp"
#include "liealign/estimate/lie_model.hpp"
#include "liealign/ins/preintegration.hpp"
#include "numeric.hpp"

namespace liealign {
namespace {

using namespace testing;
using Model = LieModel<double>;

struct Samples {
  std::vector<ImuInput<double>> u;
  double dt;
};

// A drone that turns, shakes and pushes: up to 2 rad/s and 5 m/s^2 beside gravity.
Samples shaken(const NavState<double>& X, int n, double dt) {
  Samples s{{}, dt};
  const Vector3d hover = -X.first.C.transpose() * gravity_e(X.first.p, GravityModel::normal);
  for (int k = 0; k < n; ++k) {
    const double t = (k + 0.5) * dt;
    const Vector3d w(1.2 * std::sin(5 * t), 0.9 * std::cos(7 * t), 1.5 * std::sin(2 * t + 1));
    const Vector3d f = hover + Vector3d(3 * std::sin(4 * t), 4 * std::cos(3 * t), 5 * std::sin(9 * t));
    s.u.push_back({w, f, dt});
  }
  return s;
}

Dynamics noisy() {
  Dynamics d;
  d.noise.gyro_arw = 3e-5;
  d.noise.accel_vrw = 2e-4;
  d.noise.gyro_bias_rw = 1e-6;
  d.noise.accel_bias_rw = 1e-5;
  return d;
}

Preintegrated<double> summed(const Samples& s, const Vector<double, 6>& b0, const Dynamics& d) {
  Preintegrated<double> pre;
  for (const ImuInput<double>& u : s.u) {
    pre.append({u.omega_ib_b - b0.tail<3>(), u.f_ib_b - b0.head<3>(), u.dt},
               d.noise.accel_vrw * d.noise.accel_vrw * u.dt, d.noise.gyro_arw * d.noise.gyro_arw * u.dt);
  }
  return pre;
}

const Vector<double, 6> kNone = Vector<double, 6>::Zero();

SE23<double> advance_interval(SE23<double>& X, const Preintegrated<double>& pre, const Vector<double, 6>& delta_b) {
  const SE23<double> d = increments(pre, delta_b);
  X = liealign::advance_interval(X, d, pre.T, IntervalPull<double>(X, d, pre.T, GravityModel::normal));
  return d;
}

TEST(Preintegration, state_equals_the_samples_one_by_one) {
  std::mt19937 rng(3);
  for (const double T : {0.1, 0.2, 1.0}) {
    const NavState<double> X = random_state(rng);
    const Samples s = shaken(X, static_cast<int>(T * 200 + 0.5), 0.005);
    SE23<double> one_by_one = X.first, at_once = X.first;
    for (const ImuInput<double>& u : s.u) one_by_one = mechanize_exact(one_by_one, u, GravityModel::normal);
    advance_interval(at_once, summed(s, kNone, noisy()), kNone);
    EXPECT_LT(SO3<double>(SO3<double>{one_by_one.C.transpose() * at_once.C}).log().norm(), 1e-13);
    EXPECT_LT((one_by_one.v - at_once.v).norm(), 3e-7) << T;
    EXPECT_LT((one_by_one.p - at_once.p).norm(), 1e-7) << T;
  }
}

TEST(Preintegration, another_bias_is_a_correction_of_first_order) {
  std::mt19937 rng(4);
  const NavState<double> X = random_state(rng);
  const Samples s = shaken(X, 200, 0.005);
  Vector<double, 6> delta;
  delta << 0.02, -0.03, 0.01, 2e-4, -3e-4, 1e-4;
  SE23<double> far = X.first, corrected = X.first, plain = X.first;
  advance_interval(far, summed(s, delta, noisy()), kNone);
  advance_interval(corrected, summed(s, kNone, noisy()), delta);
  advance_interval(plain, summed(s, kNone, noisy()), kNone);
  const Vector<double, 9> effect = (plain.inverse() * far).log(), left = (corrected.inverse() * far).log();
  EXPECT_GT(effect.norm(), 1e-2);
  EXPECT_LT(left.norm(), 1e-4 * effect.norm());
}

// Tilt and bias are told apart by the small difference of large terms: F has to follow the bias of the state.
TEST(Preintegration, transition_of_another_bias_is_that_of_the_samples_corrected_by_it) {
  std::mt19937 rng(6);
  const NavState<double> X = random_state(rng);
  const Samples s = shaken(X, 200, 0.005);
  Vector<double, 6> delta;
  delta << 0.3, -0.4, 0.5, 1e-4, -2e-4, 1e-4;
  const auto transition = [&](const Vector<double, 6>& b0, const Vector<double, 6>& left) {
    const Preintegrated<double> pre = summed(s, b0, noisy());
    return interval_transition(StartAxes<double>(X.first, pre.T), increments(pre, left), pre).F;
  };
  const SquareMatrix<double, 9> truth = transition(delta, kNone);
  EXPECT_GT((transition(kNone, kNone) - truth).norm(), 0.1) << "the bias matters";
  EXPECT_LT((transition(kNone, delta) - truth).norm(), 1e-3);
}

TEST(Preintegration, transition_and_noise_equal_those_of_the_samples) {
  std::mt19937 rng(5);
  const Ekf<Model> ekf{noisy(), true};
  for (const double T : {0.1, 1.0}) {
    const NavState<double> X = random_state(rng);
    const Samples s = shaken(X, static_cast<int>(T * 200 + 0.5), 0.005);
    Belief<Model> belief{X, Model::Covariance::Zero()};
    belief.X.second.x.setZero();
    SquareMatrix<double, 15> F = SquareMatrix<double, 15>::Identity();
    for (const ImuInput<double>& u : s.u) {
      const NavTransition<double> t = ekf.predict(belief, {0.0, u.omega_ib_b, u.f_ib_b}, u.dt);
      SquareMatrix<double, 15> step = SquareMatrix<double, 15>::Identity();
      step.topLeftCorner<9, 9>() = t.F;
      step.topRightCorner<9, 6>() = t.B;
      F = (step * F).eval();
    }
    const Preintegrated<double> pre = summed(s, kNone, noisy());
    const SE23<double> d = increments(pre, kNone);
    const NavTransition<double> t = interval_transition(StartAxes<double>(X.first, T), d, pre);
    const SquareMatrix<double, 9> F_nav = F.topLeftCorner<9, 9>();
    const Eigen::Matrix<double, 9, 6> B = F.topRightCorner<9, 6>();
    EXPECT_LT((t.F - F_nav).norm(), 1e-6 * F_nav.norm());
    EXPECT_LT((t.B - B).norm(), 1e-4 * B.norm());
    // By standard deviations: entries of very different size.
    const Eigen::VectorXd sigma = belief.P.diagonal().cwiseSqrt();
    Belief<Model> at_once{X, Model::Covariance::Zero()};
    propagate_interval<double>(at_once.P, StartAxes<double>(X.first, T), d, pre, ekf.half_walk(T));
    const Eigen::MatrixXd difference =
        sigma.cwiseInverse().asDiagonal() * (at_once.P - belief.P) * sigma.cwiseInverse().asDiagonal();
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 0.01) << T << "\n" << difference;
  }
}

// The largest difference of a member, of its largest entry.
double difference(Preintegrated<double> a, const Preintegrated<double>& b) {
  double most = 0.0;
  a.each(
      b, [&](const auto& x, const auto& y) { most = std::max(most, (x - y).norm() / std::max(1e-30, y.norm())); },
      [&](double x, double y) { most = std::max(most, std::abs(x - y) / std::max(1e-30, std::abs(y))); });
  return most;
}

TEST(Preintegration, two_intervals_in_a_row_are_one) {
  std::mt19937 rng(7);
  const Samples all = shaken(random_state(rng), 200, 0.005);
  for (const std::ptrdiff_t n : {1, 37, 100, 199}) {
    Preintegrated<double> both = summed({{all.u.begin(), all.u.begin() + n}, all.dt}, kNone, noisy());
    both.append(summed({{all.u.begin() + n, all.u.end()}, all.dt}, kNone, noisy()));
    EXPECT_LT(difference(both, summed(all, kNone, noisy())), 1e-11) << n;
  }
}

TEST(Preintegration, cut_anywhere_blocks_are_the_samples) {
  std::mt19937 rng(8);
  const Samples shaking = shaken(random_state(rng), 400, 0.005);
  ImuSeries imu(1);
  for (const ImuInput<double>& u : shaking.u) {
    ImuSample sample;
    sample.t_s = 0.005 * static_cast<double>(imu.size());
    sample.omega_ib_b = u.omega_ib_b;
    sample.f_ib_b = u.f_ib_b;
    imu.push_back(sample);
  }
  const ImuNoise noise = noisy().noise;
  const SampleBlocks blocks(imu, 0.3, 1.7, kNone, noise);
  const auto nothing_inside = [](std::size_t, const Preintegrated<double>&) {};
  std::uniform_real_distribution<double> anywhere(0.0, 2.0);
  std::uniform_int_distribution<std::size_t> stamp(0, 400);
  for (int i = 0; i < 300; ++i) {
    // between stamps, on them, before the first block and behind the last
    double from = i % 2 ? anywhere(rng) : imu[stamp(rng)].t_s, to = i % 3 ? anywhere(rng) : imu[stamp(rng)].t_s;
    if (to < from) std::swap(from, to);
    ImuCursor a = cursor_at(imu, from), b = a;
    const Preintegrated<double> by_blocks = blocks.preintegrate_to(to, imu, a);
    const Preintegrated<double> by_samples = preintegrate_to(to, imu, kNone, noise, b, nothing_inside);
    EXPECT_LT(difference(by_blocks, by_samples), 1e-9) << from << " to " << to;
    EXPECT_EQ(a.k, b.k);
    EXPECT_EQ(a.t_s, b.t_s);
  }
}

}  // namespace
}  // namespace liealign
