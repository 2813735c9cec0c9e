// Laws of the filter and the smoother: one update equals least squares, prediction equals dense integration of the linear
// system, rejection and weighting, re-acquisition, the reset of the covariance, backward pass against brute force.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "liealign/estimate/filter_steps.hpp"
#include "liealign/estimate/score.hpp"
#include "liealign/estimate/smoother.hpp"
#include "liealign/estimate/solution.hpp"
#include "liealign/observe/antenna_motion.hpp"
#include "liealign/observe/kinds.hpp"
#include "numeric.hpp"

namespace liealign {
namespace {

using testing::normal3;
using testing::random_state;
using Model = LieModel<double>;
using Cov = Model::Covariance;

ImuNoise table_1_noise() {
  ImuNoise n;
  n.gyro_arw = 0.09 * kDegPerSqrtHourToRadPerSqrtSecond;
  n.accel_vrw = 0.008 * kMpsPerSqrtHourToMpsPerSqrtSecond;
  n.gyro_bias_rw = std::sqrt(2.0 / 100.0) * 0.8 * kDegPerHourToRadPerSecond;
  n.accel_bias_rw = std::sqrt(2.0 / 100.0) * 3.2 * kMicroGToMps2;
  n.gyro_gap_rps = 0.3;
  n.accel_gap_mps2 = 2.0;
  return n;
}

Cov random_covariance(std::mt19937& rng) {
  Vector<double, 15> sigma;
  sigma << 0.01, 0.01, 0.02, 0.1, 0.1, 0.1, 0.5, 0.5, 0.5, 0.01, 0.01, 0.01, 1e-3, 1e-3, 1e-3;
  Cov A;
  std::normal_distribution<double> normal;
  for (int i = 0; i < 15; ++i)
    for (int j = 0; j < 15; ++j) A(i, j) = normal(rng);
  const Cov correlation = testing::times(A, A.transpose()) / 15.0 + Cov::Identity();
  return correlation.cwiseProduct(Cov(sigma * sigma.transpose()));
}

TEST(Ekf, one_update_equals_linear_least_squares) {
  std::mt19937 rng(1);
  for (int draw = 0; draw < 20; ++draw) {
    Belief<Model> belief{random_state(rng), random_covariance(rng)};
    const Belief<Model> prior = belief;
    const Seen<double> m = position_of(belief.X.first, Vector3d(0.1, -0.05, -0.3));
    const Matrix3d R = Vector3d(0.01, 0.02, 0.05).cwiseAbs2().asDiagonal();
    const Vector3d z = normal3(rng, 1e-4);  // small, so that the group is linear
    const Ekf<Model> ekf{{}, true};
    Sighting<double> seen;
    seen.z = z;
    seen.R = R;
    const Ekf<Model>::Tall Ht = m.H.transpose();
    Ekf<Model>::Tall PHt;
    Innovation<double> innovation = ekf.innovate(belief, seen, Ht, kSeesPhi | kSeesRho, PHt);
    ekf.correct(belief, innovation, Ht, PHt, 1.0);
    // (P^-1 + H^T R^-1 H) eps = H^T R^-1 z, scaled by sigma for the conditioning
    const Vector<double, 15> s = prior.P.diagonal().cwiseSqrt();
    const Cov by_sigmas = s * s.transpose();
    const Eigen::MatrixXd scaled_P = prior.P.cwiseQuotient(by_sigmas), Ht_scaled = s.asDiagonal() * Ht;
    const Eigen::MatrixXd scaled_P_s =
        (scaled_P.inverse() + testing::sandwich(Ht_scaled, Matrix3d(R.inverse()))).inverse();
    const Eigen::VectorXd right_side = testing::times(Ht_scaled, Vector3d(R.inverse() * z));
    const Vector<double, 15> eps = s.cwiseProduct(Vector<double, 15>(testing::times(scaled_P_s, right_side)));
    const Vector<double, 15> moved = Model::local(prior.X, belief.X);
    for (int i = 0; i < 15; ++i)
      EXPECT_NEAR(moved[i] / s[i], eps[i] / s[i], 3e-8 / s[i] * (i >= 6 && i < 9 ? 1.0 : 1e-3) + 1e-7);
    const Cov relative = belief.P.cwiseQuotient(by_sigmas) - Cov(scaled_P_s);
    EXPECT_LT(relative.cwiseAbs().maxCoeff(), 1e-3);  // the reset moves P by |eps|
    // negative log-likelihood: S and zeta by their definitions
    const Matrix3d S = testing::sandwich(m.H, prior.P) + R;
    EXPECT_NEAR(innovation.nis, z.dot(S.inverse() * z), 1e-9);
    EXPECT_NEAR(innovation.half_log_det_S, 0.5 * std::log(S.determinant()), 1e-9);
  }
}

TEST(Ekf, prediction_equals_the_full_matrix_product) {
  std::mt19937 rng(2);
  Ekf<Model> ekf;
  ekf.dynamics.noise = table_1_noise();
  for (double dt : {0.005, 0.05, 0.5}) {
    Belief<Model> belief{random_state(rng), random_covariance(rng)};
    const Belief<Model> before = belief;
    const NavTransition<double> t = ekf.predict(belief, {0, normal3(rng), normal3(rng, 10)}, dt);
    Cov F = Cov::Identity(), Q = Cov::Zero();
    F.topLeftCorner<9, 9>() = t.F;
    F.topRightCorner<9, 6>() = t.B;
    Q.topLeftCorner<9, 9>() = testing::sandwich(t.B, input_variance(ekf.dynamics.noise, dt).asDiagonal());
    Q.diagonal().tail<6>() += bias_variance(ekf.dynamics.noise, dt);
    const Cov expected = testing::sandwich(F, before.P) + Q;
    EXPECT_LT((belief.P - expected).cwiseAbs().maxCoeff(), 1e-14);
  }
}

TEST(Ekf, a_split_sample_predicts_what_the_whole_one_does) {
  std::mt19937 rng(3);
  Ekf<Model> ekf;
  ekf.dynamics.noise = table_1_noise();
  Belief<Model> whole{random_state(rng), random_covariance(rng)}, split = whole;
  const ImuSample sample{0, normal3(rng), normal3(rng, 10)};
  ekf.predict(whole, sample, 0.01);
  ekf.predict(split, sample, 0.003);
  ekf.predict(split, sample, 0.007);
  EXPECT_LT(Model::local(whole.X, split.X).cwiseAbs().maxCoeff(), 1e-8);
  const Vector<double, 15> s = whole.P.diagonal().cwiseSqrt().cwiseInverse();
  // position noise inside a sample, N^2 dt^3, is the only difference
  EXPECT_LT((s.asDiagonal() * (whole.P - split.P) * s.asDiagonal()).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(Ekf, a_gap_adds_its_noise) {
  Ekf<Model> ekf;
  ekf.dynamics.noise = table_1_noise();
  EXPECT_NEAR(input_variance(ekf.dynamics.noise, 0.5, 0.5)[0], 4.0, 1e-3);
  EXPECT_LT(input_variance(ekf.dynamics.noise, 0.5)[0], 1e-4);
  // split by fixes it adds up to the same velocity variance: sum of variance dt^2
  EXPECT_NEAR(5 * input_variance(ekf.dynamics.noise, 0.1, 0.5)[0] * 0.01,
              input_variance(ekf.dynamics.noise, 0.5, 0.5)[0] * 0.25, 1e-3);
}

TEST(Ekf, the_reset_makes_the_covariance_that_of_the_updated_error) {
  // Monte Carlo of the posterior: eps ~ N(K z, P_J) about the old state, seen from the new one. A correction of 0.7 rad.
  std::mt19937 rng(4);
  Belief<Model> belief{random_state(rng), Cov::Zero()};
  Vector<double, 15> sigma;
  for (int i = 0; i < 15; ++i) sigma[i] = i % 3 == 2 ? 0.03 : 0.003;
  belief.P = sigma.cwiseAbs2().asDiagonal();
  Vector<double, 15> eps = Vector<double, 15>::Zero();
  eps.segment<3>(kPhi) = 0.7 * Vector3d(1, 2, -1).normalized();
  const NavState<double> X_new = Model::retract(belief.X, eps);
  std::normal_distribution<double> normal;
  Cov sampled = Cov::Zero();
  const int n = 40000;
  for (int k = 0; k < n; ++k) {
    Vector<double, 15> d;
    for (int i = 0; i < 15; ++i) d[i] = eps[i] + sigma[i] * normal(rng);
    const Vector<double, 15> e = Model::local(X_new, Model::retract(belief.X, d));
    sampled += e * e.transpose() / n;
  }
  const Cov J = Model::right_jacobian(eps);
  const Cov reset = testing::sandwich(J, belief.P);
  EXPECT_LT((reset - sampled).norm() / sampled.norm(), 0.02);
  EXPECT_GT((belief.P - sampled).norm() / sampled.norm(), 0.1);
}

TEST(Gating, quantile_inverts_the_chi_square_distribution) {
  // Abramowitz & Stegun table 26.8, three degrees of freedom.
  EXPECT_NEAR(chi_square_3_quantile(0.95), 7.814727903251179, 1e-9);
  EXPECT_NEAR(chi_square_3_quantile(0.999), 16.26623619623813, 1e-9);
  EXPECT_NEAR(chi_square_3_quantile(0.5), 2.365973884375338, 1e-9);
}

TEST(Gating, the_loss_of_weighting_has_the_weight_as_its_slope) {
  const Gate gate{Outliers::weight, 16.27};
  for (double zeta : {1.0, 10.0, 16.0, 17.0, 100.0, 1e4}) {
    const double h = 1e-4 * zeta;
    const double slope = (bounded_loss(gate, zeta + h) - bounded_loss(gate, zeta - h)) / (2 * h);
    EXPECT_NEAR(2 * slope, gate_weight(gate, zeta), 1e-6);
  }
  EXPECT_EQ(bounded_loss(Gate{Outliers::reject, 10.0}, 1e9), 5.0);
  EXPECT_EQ(gate_weight(Gate{Outliers::reject, 10.0}, 11.0), 0.0);
  EXPECT_EQ(gate_weight(Gate{Outliers::off, 10.0}, 1e9), 1.0);
}

TEST(Gating, joseph_form_takes_the_applied_gain) {
  // With gain gamma K the covariance is that of the estimator actually used: linear, so by its definition.
  std::mt19937 rng(5);
  Belief<Model> belief{random_state(rng), random_covariance(rng)};
  const Cov P = belief.P;
  const Seen<double> m = position_of(belief.X.first, Vector3d(0, 0, 0));
  const Matrix3d R = 0.01 * Matrix3d::Identity();
  const Ekf<Model> ekf{{}, false};
  Sighting<double> seen;
  seen.z = Vector3d(1e-3, 0, 0);
  seen.R = R;
  const Ekf<Model>::Tall Ht = m.H.transpose();
  Ekf<Model>::Tall PHt;
  Innovation<double> innovation = ekf.innovate(belief, seen, Ht, kSeesPhi | kSeesRho, PHt);
  ekf.correct(belief, innovation, Ht, PHt, 0.3);
  const Eigen::Matrix<double, 15, 3> K = 0.3 * P * m.H.transpose() * innovation.S.inverse();
  const Cov A = Cov::Identity() - K * m.H;
  EXPECT_LT((belief.P - (testing::sandwich(A, P) + testing::sandwich(K, R))).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(innovation.verdict, Verdict::weighted);
}

// A belief at rest at 48 deg north, and fixes at one point.
struct RestCase {
  FlightData data;
  Belief<Model> belief;
  FilterOptions options;

  RestCase() {
    std::mt19937 rng(6);
    belief.X = random_state(rng);
    belief.X.first.v.setZero();
    belief.X.second.x.setZero();
    Vector<double, 15> sigma;
    sigma << Vector3d::Constant(1e-3), Vector3d::Constant(1e-3), Vector3d::Constant(0.02), Vector3d::Constant(1e-3),
        Vector3d::Constant(1e-5);
    belief.P = sigma.cwiseAbs2().asDiagonal();
    options.dynamics.noise = table_1_noise();
    const Vector3d f = -belief.X.first.C.transpose() * gravity_e(belief.X.first.p, GravityModel::normal);
    const Vector3d w = belief.X.first.C.transpose() * wgs84::omega_ie_e();
    ImuSeries imu;
    for (int k = 0; k <= 2000; ++k) imu.push_back({0.01 * k, w, f});
    data.samples = std::make_shared<const ImuSeries>(std::move(imu));
  }

  template <typename Change>
  void change_imu(Change change) {
    ImuSeries imu = data.imu();
    change(imu);
    data.samples = std::make_shared<const ImuSeries>(std::move(imu));
  }

  void add_fix(double t, const Vector3d& offset_e) {
    GnssFix fix;
    fix.t_s = t;
    fix.p_ea_e = belief.X.first.p + offset_e;
    fix.R_p_e = 1e-4 * Matrix3d::Identity();
    data.fixes.push_back(fix);
  }
};

struct VerdictVisitor : SilentVisitor<Model> {
  std::vector<Verdict> verdicts;
  void updated(const Observation&, const Innovation<double>& i) { verdicts.push_back(i.verdict); }
};

struct CheckpointKeeper : VerdictVisitor {
  static constexpr bool keeps_changes = true;
  std::vector<Checkpoint<Model>> checkpoints;
  void node(std::size_t, const Belief<Model>& b, const ImuCursor& cursor, const NodeChanges<Model>& changes) {
    checkpoints.push_back({b, cursor, changes});
  }
};

TEST(ForwardPass, one_outlier_is_rejected_or_weighted_and_hardly_moves_the_state) {
  for (Outliers treatment : {Outliers::reject, Outliers::weight}) {
    RestCase c;
    c.options.gate.outliers = treatment;
    for (int i = 1; i < 15; ++i) c.add_fix(i, i == 8 ? Vector3d(5, -5, 5) : Vector3d::Zero());
    list_observations(c.data);
    VerdictVisitor visitor;
    Belief<Model> belief = c.belief;
    forward_pass(c.data, c.options, belief, cursor_at(c.data.imu(), 0.0), 20.0, visitor);
    EXPECT_EQ(visitor.verdicts[7], treatment == Outliers::reject ? Verdict::rejected : Verdict::weighted);
    EXPECT_LT((belief.X.first.p - c.belief.X.first.p).norm(), 0.01);
  }
}

TEST(ForwardPass, a_wrong_filter_gives_way_to_good_fixes) {
  for (Outliers treatment : {Outliers::reject, Outliers::weight}) {
    RestCase c;
    c.options.gate.outliers = treatment;
    c.options.reacquire_after = 3;
    for (int i = 1; i <= 15; ++i) c.add_fix(i, Vector3d(30, -40, 20));  // the filter is 54 m off
    list_observations(c.data);
    VerdictVisitor visitor;
    Belief<Model> belief = c.belief;
    forward_pass(c.data, c.options, belief, cursor_at(c.data.imu(), 0.0), 20.0, visitor);
    EXPECT_EQ(visitor.verdicts[3], Verdict::reacquired);
    EXPECT_LT((belief.X.first.p - c.data.fixes[0].p_ea_e).norm(), 0.5);
  }
}

TEST(ForwardPass, two_events_at_one_time_both_count_and_give_one_epoch) {
  RestCase c;
  for (int i = 1; i < 15; ++i) c.add_fix(i, Vector3d::Zero());
  for (int i = 1; i < 15; ++i) {
    c.data.rests.push_back({static_cast<double>(i), 1.0, c.data.imu()[0].omega_ib_b, Vector3d::Zero()});
  }
  list_observations(c.data);
  CheckpointKeeper keeper;
  Belief<Model> belief = c.belief;
  const ImuCursor start = cursor_at(c.data.imu(), 0.0);
  keeper.checkpoints.push_back({belief, start, {}});
  forward_pass(c.data, c.options, belief, start, 20.0, keeper);
  EXPECT_EQ(keeper.verdicts.size(), 14u * 3u);  // position, zero velocity, zero rate
  std::vector<std::size_t> emitted;
  smooth(
      Ekf<Model>{c.options.dynamics, true}, c.data, keeper.checkpoints, kEverySample,
      [&](std::size_t k, const Belief<Model>&) { emitted.push_back(k); }, [](std::size_t, const Belief<Model>&) {});
  ASSERT_EQ(emitted.size(), 1401u);
  for (std::size_t i = 0; i < emitted.size(); ++i) EXPECT_EQ(emitted[i], 1400 - i);
}

TEST(ForwardPass, fixes_between_samples_are_used_at_their_own_time) {
  // A body in free fall direction: constant acceleration of 1 m/s^2 seen by fixes half-way between samples.
  RestCase c;
  const Vector3d a_e = c.belief.X.first.C * Vector3d(1, 0, 0);
  c.change_imu([](ImuSeries& imu) {
    for (ImuSample& s : imu) s.f_ib_b += Vector3d(1, 0, 0);
  });
  for (double t = 1.005; t < 15; t += 1.0) c.add_fix(t, 0.5 * t * t * a_e);
  list_observations(c.data);
  struct Worst : SilentVisitor<Model> {
    double worst = 0;
    void updated(const Observation&, const Innovation<double>& i) { worst = std::max(worst, i.z.norm()); }
  } visitor;
  Belief<Model> belief = c.belief;
  forward_pass(c.data, c.options, belief, cursor_at(c.data.imu(), 0.0), 20.0, visitor);
  // 5 ms of time error at 14 m/s would be 7 cm; Coriolis and gravity change over 100 m give the rest
  EXPECT_LT(visitor.worst, 0.03);
}

// The smoother against the batch solution it must equal: a linear problem small enough for one big least squares.
TEST(Smoother, equals_batch_least_squares_on_a_small_problem) {
  RestCase c;
  c.change_imu([](ImuSeries& imu) { imu.resize(41); });  // 0.4 s
  std::mt19937 rng(7);
  c.belief.P *= 1e-6;  // small enough for the group to be linear
  c.options.dynamics.noise.gyro_arw *= 1e-3;
  c.options.dynamics.noise.accel_vrw *= 1e-3;
  c.options.dynamics.noise.gyro_bias_rw = 1e-8;
  c.options.dynamics.noise.accel_bias_rw = 1e-7;
  for (double t : {0.1, 0.2, 0.3, 0.4}) c.add_fix(t, normal3(rng, 1e-5));
  for (GnssFix& f : c.data.fixes) f.R_p_e = 1e-10 * Matrix3d::Identity();
  list_observations(c.data);

  const Ekf<Model> ekf{c.options.dynamics, true};
  CheckpointKeeper keeper;
  Belief<Model> belief = c.belief;
  const ImuCursor start = cursor_at(c.data.imu(), 0.0);
  keeper.checkpoints.push_back({belief, start, {}});
  forward_pass(c.data, c.options, belief, start, 1.0, keeper);
  std::vector<Belief<Model>> smoothed(c.data.imu().size());
  smooth(
      ekf, c.data, keeper.checkpoints, kEverySample, [&](std::size_t k, const Belief<Model>& b) { smoothed[k] = b; },
      [](std::size_t, const Belief<Model>&) {});

  // Batch: unknown eps_0 and the process noises; eps_{k+1} = F_k eps_k + w_k about the unaided trajectory.
  const int n = 40;
  std::vector<NavState<double>> reference(n + 1);
  std::vector<Cov> F(n), Q(n);
  Belief<Model> free = c.belief;
  reference[0] = free.X;
  for (int k = 0; k < n; ++k) {
    const NavTransition<double> t = ekf.predict(free, c.data.imu()[static_cast<std::size_t>(k + 1)], 0.01);
    F[static_cast<std::size_t>(k)].setIdentity();
    F[static_cast<std::size_t>(k)].topLeftCorner<9, 9>() = t.F;
    F[static_cast<std::size_t>(k)].topRightCorner<9, 6>() = t.B;
    Cov q = Cov::Zero();
    q.topLeftCorner<9, 9>() = testing::sandwich(t.B, input_variance(ekf.dynamics.noise, 0.01).asDiagonal());
    q.diagonal().tail<6>() += bias_variance(ekf.dynamics.noise, 0.01);
    Q[static_cast<std::size_t>(k)] = q;
    reference[static_cast<std::size_t>(k + 1)] = free.X;
  }
  // Joint covariance of (eps_0 ... eps_n), conditioned on the four fixes: plain Gaussian conditioning.
  const int N = 15 * (n + 1);
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(N, N);
  P.topLeftCorner<15, 15>() = c.belief.P;
  for (int k = 0; k < n; ++k) {
    const Cov& Fk = F[static_cast<std::size_t>(k)];
    P.block(15 * (k + 1), 0, 15, 15 * (k + 1)) = testing::times(Fk, P.block(15 * k, 0, 15, 15 * (k + 1)));
    P.block(0, 15 * (k + 1), 15 * (k + 1), 15) = P.block(15 * (k + 1), 0, 15, 15 * (k + 1)).transpose();
    P.block<15, 15>(15 * (k + 1), 15 * (k + 1)) =
        testing::sandwich(Fk, P.block<15, 15>(15 * k, 15 * k)) + Q[static_cast<std::size_t>(k)];
  }
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(12, N);
  Eigen::VectorXd z(12);
  for (int i = 0; i < 4; ++i) {
    const int k = 10 * (i + 1);
    const Seen<double> m = position_of(reference[static_cast<std::size_t>(k)].first, Vector3d(0, 0, 0));
    H.block<3, 15>(3 * i, 15 * k) = m.H;
    z.segment<3>(3 * i) = c.data.fixes[static_cast<std::size_t>(i)].p_ea_e - m.h;
  }
  const Eigen::MatrixXd S = testing::sandwich(H, P) + 1e-10 * Eigen::MatrixXd::Identity(12, 12);
  const Eigen::MatrixXd PHt = testing::times(P, H.transpose()), K = S.ldlt().solve(PHt.transpose()).transpose();
  const Eigen::VectorXd eps = testing::times(K, z);
  const Eigen::MatrixXd P_post = P - testing::times(K, PHt.transpose());
  for (int k = 1; k <= n; ++k) {
    const Belief<Model>& b = smoothed[static_cast<std::size_t>(k)];
    const Vector<double, 15> moved = Model::local(reference[static_cast<std::size_t>(k)], b.X);
    for (int i = 0; i < 15; ++i) {
      const double sigma = std::sqrt(P_post(15 * k + i, 15 * k + i));
      EXPECT_NEAR(std::sqrt(b.P(i, i)) / sigma, 1.0, 2e-3) << "epoch " << k << " state " << i;
      // ECEF rounding of 1e-9 m against fixes of 1e-5 m
      EXPECT_NEAR(moved[i], eps[15 * k + i], 0.02 * sigma) << "epoch " << k << " state " << i;
    }
  }
}

TEST(Solution, output_sigmas_follow_the_left_error) {
  std::mt19937 rng(8);
  NavState<double> X = random_state(rng);
  X.first.C = C_n_e(X.first.p) * C_b_n_from_rpy({0.2, -0.3, 1.0});
  Belief<Model> belief{X, 1e-8 * random_covariance(rng)};
  const NavRow row = nav_row(epoch_of(0, node_belief<kNoTail>(belief, Matrix3d::Zero())));
  const auto angles = [](const NavState<double>& Y) -> Eigen::VectorXd {
    return rpy_from_C_b_n(C_n_e(Y.first.p).transpose() * Y.first.C);
  };
  Eigen::MatrixXd J = testing::derivative_by_left_error(X, angles, testing::default_steps());
  J.rightCols(9).setZero();  // attitude of the axes by position: not part of a standard deviation of attitude
  const Vector3d expected = testing::sandwich(J, belief.P).diagonal().cwiseSqrt();
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(row.std_rpy_rad[i] / expected[i], 1.0, 1e-4);
  const Matrix3d C_b_n = C_b_n_from_rpy({0.2, -0.3, 1.0});
  const auto sigma = [&](int block) -> Vector3d {
    return (C_b_n * belief.P.block<3, 3>(block, block) * C_b_n.transpose()).diagonal().cwiseSqrt();
  };
  EXPECT_LT((row.std_v_n_mps - sigma(kNu)).norm(), 1e-12 * row.std_v_n_mps.norm());
  EXPECT_LT((row.std_p_n_m - sigma(kRho)).norm(), 1e-12 * row.std_p_n_m.norm());
}

TEST(Solution, output_is_finite_where_the_body_points_straight_up) {
  std::mt19937 rng(8);
  NavState<double> X = random_state(rng);
  Matrix3d C_b_n;
  C_b_n << 0, 0, 1, 0, 1, 0, -1, 0, 0;     // pitch of 90 degrees without a rounding
  for (const double p : {0.0, kPi / 2}) {  // latitudes at which C_b_n comes back with and without a rounding
    X.first.p = ecef_from_geodetic({p, 0.0, 100.0});
    X.first.C = C_n_e(X.first.p) * C_b_n;
    const NavRow row = nav_row(epoch_of(0, node_belief<kNoTail>({X, 1e-8 * random_covariance(rng)}, Matrix3d::Zero())));
    EXPECT_NEAR(row.rpy_rad[1], kPi / 2, 1e-7);
    EXPECT_TRUE(row.rpy_rad.allFinite() && row.std_rpy_rad.allFinite()) << p;
    EXPECT_GT(row.std_rpy_rad[2], 1.0) << p;  // roll and heading are not told apart
  }
}

TEST(Score, p_rms_is_the_root_of_the_mean_square) {
  Score<double> score;
  Observation fix;
  fix.kind = &kGnssPosition;
  Innovation<double> i;
  i.half_log_det_S = 0;
  i.nis = 1;
  for (double x : {3.0, 4.0}) {
    i.z = Vector3d(x, 0, 0);
    score.add(FilterOptions{}, fix, i);
  }
  EXPECT_DOUBLE_EQ(score.p_rms(), std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(score.negative_log_likelihood, 1.0);
}

}  // namespace
}  // namespace liealign
