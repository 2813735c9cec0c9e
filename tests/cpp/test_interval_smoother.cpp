// Laws of the filter and smoother over intervals: inside one they equal the recursion sample by sample, over a flight the
// pass sample by sample; parts come in order, and what fails in one comes out.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <set>

#include "flights.hpp"
#include "liealign/estimate/interval_smoother.hpp"
#include "liealign/estimate/parts.hpp"
#include "liealign/estimate/smoother.hpp"

namespace liealign {
namespace {

using namespace testing;
using Model = LieModel<double>;
using Cov = Model::Covariance;
using Vec15 = Model::Tangent;

// An interval of a shaken drone, with what stands at each of its samples.
struct Shaken {
  IntervalStep<kNoTail> step;
  std::vector<Preintegrated<double>> at;
  FilterOptions options;
  Vector<double, 6> half_walk;
  Belief<Model> predicted, smoothed_end;

  explicit Shaken(int n) {
    std::mt19937 rng(11);
    step.before.X = random_state(rng);
    Cov A;
    for (int j = 0; j < 15; ++j) A.col(j) << normal3(rng), normal3(rng), normal3(rng), normal3(rng), normal3(rng);
    Vec15 sigma;
    sigma << 1e-3, 2e-3, 0.05, 0.02, 0.02, 0.03, 0.01, 0.02, 0.02, 0.01, 0.01, 0.02, 1e-4, 1e-4, 2e-4;
    const Cov correlation = A * A.transpose() / 15.0 + 0.2 * Cov::Identity();
    step.before.P = sigma.asDiagonal() * correlation * sigma.asDiagonal();
    const double dt = 1.0 / n;
    for (int k = 0; k < n; ++k) {
      const double t = (k + 0.5) * dt;
      const Vector3d f = -step.before.X.first.C.transpose() * gravity_e(step.before.X.first.p, GravityModel::normal);
      step.pre.append({Vector3d(1.2 * std::sin(5 * t), 0.9 * std::cos(7 * t), 1.5 * std::sin(2 * t)),
                       f + Vector3d(3 * std::sin(4 * t), 4 * std::cos(3 * t), 5 * std::sin(9 * t)), dt},
                      4e-5 * dt, 1e-8 * dt);
      at.push_back(step.pre);
    }
    options.dynamics.noise.accel_bias_rw = 1e-4;
    options.dynamics.noise.gyro_bias_rw = 1e-6;
    const Ekf<Model> ekf{options.dynamics, true};
    half_walk = ekf.half_walk(step.pre.T);
    predicted = step.before;
    step.pull = ekf.predict(predicted, step.pre, predicted.X.second.x);
    // A future that is sure of a state beside the prediction.
    Vec15 z = 0.7 * sigma;
    z[2] = -0.04;
    smoothed_end = {Model::retract(predicted.X, z), 0.3 * predicted.P};
  }

  // What that future says at the end, (Eq. 54), and by (Eq. 32) at the start.
  Adjoint<Model> adjoint() const {
    const Vec15 z = Model::local(predicted.X, smoothed_end.X), s = predicted.P.diagonal().cwiseSqrt().cwiseInverse();
    const Cov J_0 = Model::right_jacobian(z).inverse(), P_s = testing::sandwich(J_0, smoothed_end.P);
    const Cov inverse =
        s.asDiagonal() * Cov(Cov(s.asDiagonal() * predicted.P * s.asDiagonal()).inverse()) * s.asDiagonal();
    Adjoint<Model> adjoint;
    adjoint.lambda = inverse * z;
    adjoint.Lambda = inverse * (predicted.P - P_s) * inverse;
    const StartAxes<double> axes(step.before.X.first, step.pre.T);
    adjoint.back_over(interval_transition(axes, SE23<double>{step.pre.dC, step.pre.dv, step.pre.dp}, step.pre),
                      tail_step({}, step.pre.T));
    return adjoint;
  }
};

// x_t = A x_0 of (Eq. 53) as a matrix.
Cov transition_to(const Preintegrated<double>& pre) {
  Cov A = Cov::Identity();
  A.topRightCorner<9, 6>() = bias_columns(pre);
  return A;
}

Cov noise_to(const Preintegrated<double>& pre) {
  Cov Q = Cov::Zero();
  NavCovariance<double, 6> noise = nav_covariance(Q);
  add_noise(noise, IntervalNoise<double>(pre));
  set_nav_covariance(Q, noise);
  mirror(Q);
  return Q;
}

// Left error at the sample from x_t, without the gradient's second half.
Cov to_left_error(const Shaken& s, const Preintegrated<double>& pre) {
  StartAxes<double> axes(s.step.before.X.first, s.step.pre.T);
  axes.kick.setZero();
  Cov out = Cov::Identity();
  out.topLeftCorner<9, 9>() = leave_matrix(SE23<double>{pre.dC, pre.dv, pre.dp}, pre.T, axes);
  return out;
}

// Sample k of the interval, alone in its lane.
Belief<Model> belief_at(const InsideInterval& inside, const Shaken& s, std::size_t k) {
  SampleLanes samples;
  samples.add(k, s.at[k]);
  return lane(inside.at(samples).belief, 0);
}

TEST(InsideInterval, equals_the_smoother_that_steps_from_sample_to_sample) {
  const int n = 40;
  const Shaken s(n);
  const Adjoint<Model> adjoint = s.adjoint();
  const InsideInterval inside(AtStart<kNoTail>{s.step, &adjoint}, s.options),
      filter(AtStart<kNoTail>{s.step, nullptr}, s.options);

  // The same linear system, forward and back one sample at a time, (Eq. 30)-(Eq. 32) in its textbook form.
  const StartAxes<double> axes(s.step.before.X.first, s.step.pre.T);
  Cov K = Cov::Identity();
  K.block<3, 3>(kNu, kRho) = hat(axes.omega_ie_b) + axes.kick;
  Cov P_0 = s.step.before.P;
  P_0.diagonal().tail<6>() += s.half_walk;
  std::vector<Cov> P(n + 1), F(n + 1), Q(n + 1);
  P[0] = testing::sandwich(K, P_0);
  Cov A_before = Cov::Identity(), Q_before = Cov::Zero();
  for (std::size_t k = 1; k <= n; ++k) {
    const Cov A = transition_to(s.at[k - 1]), Q_all = noise_to(s.at[k - 1]);
    F[k] = A * A_before.inverse();
    Q[k] = Q_all - testing::sandwich(F[k], Q_before);
    P[k] = testing::sandwich(F[k], P[k - 1]) + Q[k];
    A_before = A;
    Q_before = Q_all;
  }
  // At the end: the left error with the second half of gradient and walk.
  Cov L_end = Cov::Identity();
  L_end.topLeftCorner<9, 9>() =
      leave_matrix(SE23<double>{s.step.pre.dC, s.step.pre.dv, s.step.pre.dp}, s.step.pre.T, axes);
  Cov walk = Cov::Zero();
  walk.diagonal().tail<6>() = s.half_walk;
  Cov P_next = testing::sandwich(L_end, P[n]) + walk;
  EXPECT_LT((P_next - s.predicted.P).norm(), 1e-12 * P_next.norm());
  Vec15 x = Model::local(s.predicted.X, s.smoothed_end.X);
  const Cov J_0 = Model::right_jacobian(x).inverse();
  Cov P_s = testing::sandwich(J_0, s.smoothed_end.P), step = L_end;
  for (std::size_t k = n + 1; k-- > 1;) {
    const Cov G = P[k] * step.transpose() * P_next.inverse();
    P_s = P[k] + G * (P_s - P_next) * G.transpose();
    x = G * x;
    P_next = P[k];
    step = F[k];

    const Cov to_left = to_left_error(s, s.at[k - 1]);
    const Vec15 eps = to_left * x;
    const Cov J = Model::right_jacobian(eps);
    const Cov expected = testing::sandwich(J, testing::sandwich(to_left, P_s));
    const Belief<Model> smoothed = belief_at(inside, s, k - 1), filtered = belief_at(filter, s, k - 1);
    const Vec15 sigma = expected.diagonal().cwiseSqrt();
    const Cov difference =
        sigma.cwiseInverse().asDiagonal() * (smoothed.P - expected) * sigma.cwiseInverse().asDiagonal();
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-8) << k;
    const Vec15 moved = Model::local(Model::retract(filtered.X, eps), smoothed.X);
    EXPECT_LT((moved.array() / sigma.array()).abs().maxCoeff(), 1e-6) << k;  // ECEF metres carry 1e-9
    const Cov left_P = testing::sandwich(to_left, P[k]);
    EXPECT_LT((sigma.cwiseInverse().asDiagonal() * (filtered.P - left_P) * sigma.cwiseInverse().asDiagonal())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-9 * (sigma.cwiseInverse().asDiagonal() * left_P * sigma.cwiseInverse().asDiagonal()).norm());
  }
}

// A sample alone, in any lane, beside whatever others: the same bits. The blocks of nav_at() are those of at().
TEST(InsideInterval, of_four_samples_at_once_is_that_of_each) {
  const Shaken s(40);
  const Adjoint<Model> adjoint = s.adjoint();
  for (const Adjoint<Model>* future : {static_cast<const Adjoint<Model>*>(nullptr), &adjoint}) {
    const InsideInterval inside(AtStart<kNoTail>{s.step, future}, s.options);
    SampleLanes samples;
    for (const std::size_t k : {3U, 11U, 39U}) samples.add(k, s.at[k]);
    const NavBelief<Lanes> nav = inside.nav_at(samples);
    const WholeBelief<Lanes> all = inside.at(samples);
    for (int i = 0; i < samples.count; ++i) {
      const Belief<Model> one = belief_at(inside, s, samples.k[static_cast<std::size_t>(i)]),
                          of_all = lane(all.belief, i);
      EXPECT_EQ(of_all.P, one.P);
      EXPECT_EQ(of_all.X.first.C, one.X.first.C);
      EXPECT_EQ(of_all.X.first.p, one.X.first.p);
      EXPECT_EQ(of_all.X.second.x, one.X.second.x);
      const Vec15 sigma = one.P.diagonal().cwiseSqrt();
      const NavState<double> X = lane(nav.X, i);
      EXPECT_LT((Model::local(one.X, X).cwiseQuotient(sigma)).cwiseAbs().maxCoeff(), 1e-6);
      const std::pair<int, Matrix3d> blocks[] = {
          {kPhi, lane(nav.P_phi, i)}, {kNu, lane(nav.P_nu, i)}, {kRho, lane(nav.P_rho, i)}};
      for (const auto& [block, P] : blocks)
        EXPECT_LT((P - one.P.block<3, 3>(block, block)).norm(), 1e-10 * P.norm()) << block;
      EXPECT_EQ(lane(nav.P_relative, i), lane(nav.P_rho, i));  // without a tail there is one position error
      EXPECT_TRUE(lane(all.error.V, i).isZero(0.0));
    }
  }
}

TEST(InsideInterval, meets_the_smoothed_belief_at_the_start) {
  const Shaken s(40);
  const Adjoint<Model> adjoint = s.adjoint();
  const Belief<Model> start = adjoint.smoothed(s.step.before, true);
  IntervalStep<kNoTail> still = s.step;
  still.pre.T = 1e-12;  // no walk, no gradient
  const InsideInterval inside(AtStart<kNoTail>{still, &adjoint}, s.options);
  SampleLanes samples;
  samples.add(0, Preintegrated<double>{});
  const Belief<Model> at_once = lane(inside.at(samples).belief, 0);
  const Vec15 sigma = start.P.diagonal().cwiseSqrt();
  EXPECT_LT((Model::local(start.X, at_once.X).array() / sigma.array()).abs().maxCoeff(), 1e-6);
  EXPECT_LT((sigma.cwiseInverse().asDiagonal() * (at_once.P - start.P) * sigma.cwiseInverse().asDiagonal())
                .cwiseAbs()
                .maxCoeff(),
            1e-9);
}

// A flight whose fixes with velocity fall between samples, beside rests, and with a gap in the log.
PreparedFlight rough_flight() {
  DroneFlight drone = short_flight();
  drone.oversample = 4;
  GnssErrors gnss;
  gnss.l_ba_b = Vector3d(0.1, -0.05, -0.3);
  gnss.rate_hz = 3.0;
  gnss.velocity = true;
  Config config;
  config.output.filtered = true;
  Flight flight = simulate_flight(drone, gnss, testing::with_given_parameters(config), 3).flight;
  ImuSeries& imu = flight.imu;
  imu.erase(imu.begin() + 3000, imu.begin() + 3020);
  return prepare_flight(flight);
}

struct KeepCheckpoints : SilentVisitor<Model> {
  static constexpr bool keeps_changes = true;
  const ImuSeries& imu;
  std::vector<Checkpoint<Model>> checkpoints;
  std::vector<std::pair<std::size_t, Belief<Model>>> filtered;

  void after(const Belief<Model>& belief, const NavTransition<double>&, std::size_t k, bool whole) {
    if (whole) filtered.emplace_back(k, belief);
  }
  void node(std::size_t, const Belief<Model>& belief, const ImuCursor& cursor, const NodeChanges<Model>& changes) {
    checkpoints.push_back({belief, cursor, changes});
    if (imu[cursor.k - 1].t_s == cursor.t_s) filtered.back().second = belief;
  }
};

void expect_close(const Epoch& epoch, const Belief<Model>& belief) {
  const Vec15 sigma = belief.P.diagonal().cwiseSqrt();
  const Vec15 off = Model::local(belief.X, epoch.X);
  EXPECT_LT((off.array() / sigma.array()).abs().maxCoeff(), 0.02) << epoch.t_s;
  Vec15 stated;
  stated << epoch.P_phi.diagonal(), epoch.P_nu.diagonal(), epoch.P_rho.diagonal(), epoch.variance_b_a,
      epoch.variance_b_g;
  EXPECT_LT((stated.cwiseSqrt().array() / sigma.array() - 1.0).abs().maxCoeff(), 0.02) << epoch.t_s;
}

TEST(IntervalSmoother, gives_what_the_filter_and_the_smoother_sample_by_sample_give) {
  const PreparedFlight flight = rough_flight();

  ASSERT_FALSE(flight.gaps.empty());
  const FlightData& data = flight.data;
  const HeadingResult heading = align(flight);
  const Solution solution = process(flight, heading, {}, true);

  const FilterOptions options = with_gates(flight.filter, heading.gate_scales);
  Belief<Model> belief = belief_at_rest(flight.problem.rest, heading.heading_rad, solution.heading_std_initial_rad,
                                        flight.problem.initial, data.l_ba_b, options.dynamics.gravity);
  const ImuCursor start = cursor_at(data.imu(), flight.t_begin_s);
  KeepCheckpoints kept{{}, data.imu(), {{belief, start, {}}}, {{start.k - 1, belief}}};
  forward_pass(data, options, belief, start, data.imu().back().t_s, kept);
  std::vector<std::pair<std::size_t, Belief<Model>>> smoothed;
  smooth(
      Ekf<Model>{options.dynamics, true}, data, kept.checkpoints, kEverySample,
      [&](std::size_t k, const Belief<Model>& b) { smoothed.emplace_back(k, b); },
      [](std::size_t, const Belief<Model>&) {});

  ASSERT_EQ(solution.smoothed.size(), smoothed.size());
  ASSERT_EQ(solution.filtered.size(), kept.filtered.size());
  EXPECT_EQ(solution.digest.epochs, smoothed.size());
  std::set<double> times;
  for (const Observation& o : data.observations) {
    if (o.t_s > flight.t_begin_s) times.insert(o.t_s);
  }
  EXPECT_EQ(solution.filtered_at_events.size(), times.size() + 1);
  for (std::size_t i = 0; i < smoothed.size(); ++i) {
    const auto& [k, b] = smoothed[smoothed.size() - 1 - i];
    ASSERT_EQ(solution.smoothed[i].t_s, data.imu()[k].t_s);
    ASSERT_EQ(solution.filtered[i].t_s, data.imu()[kept.filtered[i].first].t_s);
    expect_close(solution.smoothed[i], b);
    expect_close(solution.filtered[i], kept.filtered[i].second);
  }

  // Steps from one wanted sample to the next: the same where they end, and nothing elsewhere.
  std::size_t seen = 0;
  const auto every_seventh = [](std::size_t k) { return k % 7 == 0; };
  smooth(
      Ekf<Model>{options.dynamics, true}, data, kept.checkpoints, every_seventh,
      [&](std::size_t k, const Belief<Model>& b) {
        const auto dense = std::find_if(smoothed.begin(), smoothed.end(), [&](const auto& s) { return s.first == k; });
        ASSERT_NE(dense, smoothed.end());
        ASSERT_TRUE(every_seventh(k));
        expect_close(epoch_of(data.imu()[k].t_s, node_belief<kNoTail>(b, Matrix3d::Zero())), dense->second);
        ++seen;
      },
      [](std::size_t, const Belief<Model>&) {});
  EXPECT_EQ(seen, static_cast<std::size_t>(std::count_if(smoothed.begin(), smoothed.end(),
                                                         [&](const auto& s) { return every_seventh(s.first); })));
}

TEST(Parts, are_taken_in_order_each_after_its_make) {
  const std::size_t parts = 3 * part_slots() + 1;
  std::vector<std::size_t> lying(part_slots()), taken;
  in_order(
      parts, [&](std::size_t part, std::size_t slot) { lying[slot] = part; },
      [&](std::size_t part, std::size_t slot) {
        EXPECT_EQ(lying[slot], part);
        taken.push_back(part);
      });
  ASSERT_EQ(taken.size(), parts);
  EXPECT_TRUE(std::is_sorted(taken.begin(), taken.end()));
}

TEST(Parts, let_out_the_first_exception) {
  std::size_t taken = 0;
  const auto work = [&] {
    in_order(
        4 * part_slots(),
        [](std::size_t part, std::size_t) {
          if (part % part_slots() == 1) throw std::runtime_error("part " + std::to_string(part));
        },
        [&](std::size_t, std::size_t) { ++taken; });
  };
  try {
    work();
    FAIL() << "no exception";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "part 1");
  }
  EXPECT_EQ(taken, 1U);
}

}  // namespace
}  // namespace liealign
