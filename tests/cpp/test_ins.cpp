// Laws of the INS models: mechanization against dense integration, transitions and measurements against numeric
// derivatives, coning and sculling against a dense integration, axes and gaps.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "liealign/core/error.hpp"
#include "liealign/ins/mechanization.hpp"
#include "liealign/ins/prepare_imu.hpp"
#include "liealign/ins/profiles.hpp"
#include "numeric.hpp"

namespace liealign {
namespace {

using testing::default_steps;
using testing::derivative_by_left_error;
using testing::normal3;
using testing::random_state;

using Nav = SE23<double>;

// TAES (16) with omega_ie_e = [0 0 omega_e]: the differential equations in ECEF, integrated by RK4.
struct Derivative {
  Matrix3d C;
  Vector3d v, p;
};

Derivative equations(const Nav& X, const Vector3d& omega, const Vector3d& f) {
  const Vector3d omega_ie = wgs84::omega_ie_e();
  return {X.C * hat(omega) - hat(omega_ie) * X.C,
          X.C * f - 2 * omega_ie.cross(X.v) + gravity_e(X.p, GravityModel::normal), X.v};
}

Nav add(const Nav& X, const Derivative& d, double h) { return {X.C + h * d.C, X.v + h * d.v, X.p + h * d.p}; }

template <typename Rate, typename Force>
Nav integrate_rk4(Nav X, double t0, double t1, int steps, Rate omega, Force f) {
  const double h = (t1 - t0) / steps;
  for (int i = 0; i < steps; ++i) {
    const double t = t0 + i * h;
    const Derivative k1 = equations(X, omega(t), f(t));
    const Derivative k2 = equations(add(X, k1, h / 2), omega(t + h / 2), f(t + h / 2));
    const Derivative k3 = equations(add(X, k2, h / 2), omega(t + h / 2), f(t + h / 2));
    const Derivative k4 = equations(add(X, k3, h), omega(t + h), f(t + h));
    X.C += h / 6 * (k1.C + 2 * k2.C + 2 * k3.C + k4.C);
    X.v += h / 6 * (k1.v + 2 * k2.v + 2 * k3.v + k4.v);
    X.p += h / 6 * (k1.p + 2 * k2.p + 2 * k3.p + k4.p);
  }
  return X;
}

TEST(MechanizationExact, equals_dense_integration_of_the_navigation_equations) {
  std::mt19937 rng(1);
  for (int draw = 0; draw < 10; ++draw) {
    const Nav X = random_state(rng).first;
    const Vector3d omega = normal3(rng, 1.0), f = normal3(rng, 10.0);
    for (double dt : {0.005, 0.1, 1.0}) {
      const Nav dense = integrate_rk4(
          X, 0, dt, 400, [&](double) { return omega; }, [&](double) { return f; });
      const Nav exact = mechanize_exact(X, {omega, f, dt}, GravityModel::normal);
      // Left out: gravitation changing along the step, (3e-6 v + 7e-5 g) dt^3/12 in position.
      const double gravitation = 1e-4 * dt * dt * dt;
      EXPECT_LT((exact.C - dense.C).cwiseAbs().maxCoeff(), 1e-9) << dt;
      EXPECT_LT((exact.v - dense.v).norm(), 1e-8 + gravitation) << dt;
      EXPECT_LT((exact.p - dense.p).norm(), 2e-8 + gravitation) << dt;
    }
  }
}

TEST(MechanizationPaper, misses_the_half_acceleration_term_as_the_design_measured) {
  // 1 rad/s, 10 m/s, 200 Hz for 1 s: some centimetres per second off; `exact` is not.
  std::mt19937 rng(2);
  Nav X = random_state(rng).first;
  X.v = 10 * X.v.normalized();
  const Vector3d omega(0, 0, 1.0), f = -X.C.transpose() * gravity_e(X.p, GravityModel::normal);
  Nav paper = X, exact = X;
  for (int i = 0; i < 200; ++i) {
    paper = mechanize_paper(paper, {omega, f, 0.005}, GravityModel::normal);
    exact = mechanize_exact(exact, {omega, f, 0.005}, GravityModel::normal);
  }
  const Nav dense = integrate_rk4(
      X, 0, 1, 2000, [&](double) { return omega; }, [&](double) { return f; });
  EXPECT_GT((paper.v - dense.v).norm(), 0.01);
  EXPECT_LT((paper.v - dense.v).norm(), 0.1);
  EXPECT_LT((exact.v - dense.v).norm(), 1e-6);
}

class TransitionLaws : public ::testing::TestWithParam<Mechanization> {};

TEST_P(TransitionLaws, equal_numeric_derivatives_block_by_block) {
  std::mt19937 rng(3);
  const Mechanization kind = GetParam();
  for (int draw = 0; draw < 10; ++draw) {
    const NavState<double> X = random_state(rng);
    const Vector3d omega = normal3(rng, 1.5), f = normal3(rng, 10.0);
    for (double dt : {0.005, 0.1, 0.5}) {
      const auto step = [&](const NavState<double>& Y) {
        return mechanize<double>(Y.first, {omega - b_g(Y), f - b_a(Y), dt}, kind, GravityModel::normal);
      };
      const Nav next = step(X);
      const auto error = [&](const NavState<double>& Y) -> Eigen::VectorXd { return (next.inverse() * step(Y)).log(); };
      const Eigen::MatrixXd numeric = derivative_by_left_error(X, error, default_steps());
      Nav advanced = X.first;
      const NavTransition<double> t =
          advance<double>(advanced, {omega - b_g(X), f - b_a(X), dt}, kind, GravityModel::normal);
      EXPECT_EQ(advanced.p, next.p);
      Eigen::Matrix<double, 9, 15> analytic;
      analytic << t.F, t.B;
      for (int column = 0; column < 15; ++column) {
        // Rounding of ECEF coordinates (1e-9 m) over the step; second order of the attitude step; 1 % of the gravitation
        // gradient (3e-6 dt) and its part by velocity (3e-6 dt^2 / 2), which the transition leaves out.
        const double second_order = column < kNu ? 1e-6 * std::max(1.0, 15 * dt) : 0.0;
        const double tolerance = 2e-9 / default_steps()[column] + second_order + 3e-8 * dt + 1.6e-6 * dt * dt;
        EXPECT_LT((numeric.col(column) - analytic.col(column)).cwiseAbs().maxCoeff(), tolerance)
            << "column " << column << " dt " << dt;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Both, TransitionLaws, ::testing::Values(Mechanization::exact, Mechanization::paper));

class InverseStrapdown : public ::testing::TestWithParam<Mechanization> {};

TEST_P(InverseStrapdown, inverts_the_mechanization) {
  std::mt19937 rng(4);
  for (int draw = 0; draw < 20; ++draw) {
    const Nav X = random_state(rng).first;
    const ImuInput<double> u{normal3(rng, 2.0), normal3(rng, 10.0), 0.01};
    const Nav next = mechanize<double>(X, u, GetParam(), GravityModel::normal);
    const ImuInput<double> back = inverse_mechanize<double>(X, next, u.dt, GetParam(), GravityModel::normal);
    EXPECT_LT((back.omega_ib_b - u.omega_ib_b).norm(), 1e-12);
    EXPECT_LT((back.f_ib_b - u.f_ib_b).norm(), 2e-10);  // velocity rounding 1e-12 over dt
  }
}

INSTANTIATE_TEST_SUITE_P(Both, InverseStrapdown, ::testing::Values(Mechanization::exact, Mechanization::paper));

// Mean rates of a vibrating, turning body, integrated with and without the two-sample corrections.
TEST(PrepareImu, coning_and_sculling_corrections_gain_an_order_of_magnitude) {
  std::mt19937 rng(7);
  const Nav X = random_state(rng).first;
  const double amplitude = 0.05, frequency = 2 * kPi * 5.0, dt = 0.01;
  const auto omega = [&](double t) {
    return Vector3d(amplitude * frequency * std::cos(frequency * t), amplitude * frequency * std::sin(frequency * t),
                    0.3);
  };
  const auto force = [&](double t) {
    return Vector3d(3 * std::sin(frequency * t), -3 * std::cos(frequency * t), -9.8);
  };
  ImuSeries log;
  for (int k = 0; k <= 400; ++k) {
    ImuSample s;
    s.t_s = k * dt;
    const int n = 20;  // Simpson over the interval
    for (int i = 0; i <= n; ++i) {
      const double weight = (i == 0 || i == n ? 1 : (i % 2 ? 4 : 2)) / (3.0 * n), t = (k - 1) * dt + i * dt / n;
      s.omega_ib_b += weight * omega(t);
      s.f_ib_b += weight * force(t);
    }
    log.push_back(s);
  }
  const Nav truth = integrate_rk4(X, 0, 4, 40000, omega, force);
  const auto error = [&](const ImuSeries& samples) {
    Nav Y = X;
    for (std::size_t k = 1; k < samples.size(); ++k)
      Y = mechanize_exact(Y, {samples[k].omega_ib_b, samples[k].f_ib_b, dt}, GravityModel::normal);
    return std::pair{SO3<double>{truth.C.transpose() * Y.C}.log().norm(), (Y.v - truth.v).norm()};
  };
  const auto [angle_raw, speed_raw] = error(log);
  const auto [angle, speed] = error(prepare_imu(log, ImuSampleKind::mean, Matrix3d::Identity(), 0.1).samples);
  EXPECT_LT(angle, 0.1 * angle_raw);
  EXPECT_LT(speed, 0.1 * speed_raw);
}

TEST(PrepareImu, increments_means_and_slow_instants_agree) {
  ImuSeries mean, instant, increment;
  const double dt = 0.01;
  for (int k = 0; k <= 100; ++k) {
    const double t = k * dt;
    // linear in time: the mean is the value at the middle
    const auto w = [](double s) { return Vector3d(0.1 + s, 0.2 - s, 0.3 * s); };
    const auto f = [](double s) { return Vector3d(s, 2 * s, -9.8 + s); };
    mean.push_back({t, w(t - dt / 2), f(t - dt / 2)});
    instant.push_back({t, w(t), f(t)});
    increment.push_back({t, dt * w(t - dt / 2), dt * f(t - dt / 2)});
  }
  const auto a = prepare_imu(mean, ImuSampleKind::mean, Matrix3d::Identity(), 0.1).samples;
  const auto b = prepare_imu(instant, ImuSampleKind::instant, Matrix3d::Identity(), 0.1).samples;
  const auto c = prepare_imu(increment, ImuSampleKind::increment, Matrix3d::Identity(), 0.1).samples;
  for (std::size_t k = 2; k < a.size(); ++k) {
    EXPECT_LT((a[k].omega_ib_b - b[k].omega_ib_b).norm(), 1e-12);
    EXPECT_LT((a[k].f_ib_b - b[k].f_ib_b).norm(), 1e-12);
    EXPECT_LT((a[k].f_ib_b - c[k].f_ib_b).norm(), 1e-12);
  }
}

TEST(PrepareImu, reports_gaps_and_bridges_them_by_the_mean_of_the_neighbours) {
  ImuSeries log;
  for (int k = 0; k < 20; ++k)
    log.push_back({k < 10 ? 0.01 * k : 0.5 + 0.01 * k, Vector3d(k, 0, 0), Vector3d(0, k, 0)});
  const PreparedImu p = prepare_imu(log, ImuSampleKind::mean, Matrix3d::Identity(), 0.1);
  ASSERT_EQ(p.gaps.size(), 1u);
  EXPECT_DOUBLE_EQ(p.gaps[0].begin_s, 0.09);
  EXPECT_DOUBLE_EQ(p.gaps[0].end_s, 0.6);
  EXPECT_DOUBLE_EQ(p.samples[10].omega_ib_b.x(), 9.5);
  EXPECT_NEAR(p.median_dt_s, 0.01, 1e-12);
}

TEST(PrepareImu, an_increment_after_a_gap_counts_for_a_usual_interval) {
  ImuSeries log;
  for (int k = 0; k < 20; ++k)
    log.push_back({k < 10 ? 0.01 * k : 0.5 + 0.01 * k, Vector3d(0.02, 0, 0), Vector3d(0, 0, -0.1)});
  const PreparedImu p = prepare_imu(log, ImuSampleKind::increment, Matrix3d::Identity(), 0.1);
  for (std::size_t k = 1; k < p.samples.size(); ++k) EXPECT_NEAR(p.samples[k].omega_ib_b.x(), 2.0, 1e-9) << k;
}

TEST(PrepareImu, axes_declarations_turn_the_sensor_into_forward_right_down) {
  EXPECT_EQ(C_s_b_from_axes("FRD"), Matrix3d::Identity());
  EXPECT_EQ(C_s_b_from_axes("FLU") * Vector3d(1, 2, 3), Vector3d(1, -2, -3));
  EXPECT_EQ(C_s_b_from_axes("RFU") * Vector3d(1, 2, 3), Vector3d(2, 1, -3));
  EXPECT_EQ(C_s_b_from_axes("BLD") * Vector3d(1, 2, 3), Vector3d(-1, -2, 3));
  for (const char* wrong : {"FRU", "FFD", "FR", "XYZ", "frd", ""})
    EXPECT_THROW(C_s_b_from_axes(wrong), ConfigError) << wrong;
}

TEST(ImuProfiles, unknown_name_lists_the_known_ones) {
  EXPECT_EQ(imu_profile("adis16495").gyro_arw_deg_sqrt_h, 0.09);
  try {
    imu_profile("adis");
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_EQ(std::string(e.what()).rfind("imu.model is \"adis\"; expected one of: adis16495, ", 0), 0u) << e.what();
  }
}

}  // namespace
}  // namespace liealign
