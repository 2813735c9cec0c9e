// Laws of the alignment: rest detection, levelling, the turn to a heading, the quadratic fit, the search.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "liealign/align/heading_search.hpp"
#include "liealign/align/initial.hpp"
#include "liealign/observe/antenna_motion.hpp"
#include "liealign/pipeline/settings.hpp"
#include "numeric.hpp"

namespace liealign {
namespace {

using testing::normal3;
using Model = LieModel<double>;

constexpr double kDeg = kDegToRad;

const RestLimits kLimits = rest_limits(Config{});

// 100 Hz log: at rest in [0, 20) and [40, 60), moving between; a bias on the gyro, vibration everywhere.
ImuSeries rest_move_rest(double vibration) {
  std::mt19937 rng(1);
  ImuSeries imu;
  for (int k = 0; k <= 6000; ++k) {
    const double t = 0.01 * k;
    const bool moving = t >= 20 && t < 40;
    const Vector3d turn = moving ? Vector3d(0.1 * std::sin(t), 0.05, 0.3 * std::cos(0.7 * t)) : Vector3d::Zero();
    const Vector3d push = moving ? Vector3d(std::sin(t), 0.5 * std::cos(t), 0) : Vector3d::Zero();
    imu.push_back({t, Vector3d(0.003, -0.002, 0.001) + turn + normal3(rng, 0.02 * vibration),
                   Vector3d(0.1, -0.2, -9.8) + push + normal3(rng, 0.1 * vibration)});
  }
  return imu;
}

TEST(Rest, is_found_before_and_after_the_motion_and_not_inside_it) {
  const std::vector<RestPeriod> rests = find_rests(rest_move_rest(1.0), {}, kLimits);
  ASSERT_EQ(rests.size(), 2u);
  EXPECT_NEAR(rests[0].begin_s, 0.0, 0.6);
  EXPECT_NEAR(rests[0].end_s, 20.0, 1.1);
  EXPECT_LE(rests[0].end_s, 20.0);
  EXPECT_NEAR(rests[1].begin_s, 40.0, 1.1);
  EXPECT_GE(rests[1].begin_s, 40.0);
  EXPECT_NEAR(rests[1].end_s, 60.0, 0.6);
}

TEST(Rest, may_be_nowhere) { EXPECT_TRUE(find_rests(rest_move_rest(20.0), {}, kLimits).empty()); }

TEST(Rest, ends_where_fixes_move_although_the_imu_is_calm) {
  ImuSeries imu = rest_move_rest(1.0);
  imu.resize(1800);  // all calm
  std::vector<GnssFix> fixes;
  for (int i = 1; i < 18; ++i) {
    GnssFix f;
    f.t_s = i;
    f.p_ea_e = Vector3d(6378137.0 + (i > 10 ? 2.0 * (i - 10) : 0.0), 0, 0);  // constant speed: no IMU can see it
    f.R_p_e = 1e-4 * Matrix3d::Identity();
    fixes.push_back(f);
  }
  const std::vector<RestPeriod> rests = find_rests(imu, fixes, kLimits);
  ASSERT_FALSE(rests.empty());
  EXPECT_LE(rests[0].end_s, 11.0);
}

TEST(Rest, is_not_claimed_where_a_velocity_or_no_fix_speaks_against_it) {
  ImuSeries imu = rest_move_rest(1.0);
  imu.resize(1800);  // all calm: a cruise looks like this as well
  std::vector<GnssFix> fixes;
  for (int i = 1; i < 18; ++i) {
    GnssFix f;
    f.t_s = i;
    f.p_ea_e = Vector3d(6378137.0 + 3.0 * i, 0, 0);
    f.R_p_e = 8.0 * Matrix3d::Identity();  // a consumer receiver: its position alone says little
    f.has_velocity = true;
    f.v_ea_e = Vector3d(3, 0, 0);
    f.R_v_e = 0.0025 * Matrix3d::Identity();
    fixes.push_back(f);
  }
  EXPECT_TRUE(find_rests(imu, fixes, kLimits).empty());
  for (GnssFix& f : fixes) f.v_ea_e.setZero(), f.p_ea_e = Vector3d(6378137.0, 0, 0);
  fixes.resize(8);  // an outage from 8 s on: nobody knows
  const std::vector<RestPeriod> rests = find_rests(imu, fixes, kLimits);
  ASSERT_EQ(rests.size(), 1u);
  EXPECT_LE(rests[0].end_s, 8.0);
}

TEST(Rest, ends_where_a_gentle_take_off_begins) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    std::mt19937 rng(seed);
    ImuSeries imu;
    for (int k = 0; k <= 4000; ++k) {
      const double t = 0.01 * k, push = std::clamp(0.05 * (t - 20), 0.0, 0.3);  // m/s^2, by 0.05 m/s^3
      imu.push_back({t, Vector3d(0.003, -0.002, 0.001) + normal3(rng, 0.001),
                     Vector3d(0.1, -0.2, -9.8) + Vector3d(0.8, 0, -0.6) * push + normal3(rng, 0.01)});
    }
    const std::vector<RestPeriod> rests = find_rests(imu, {}, kLimits);
    ASSERT_FALSE(rests.empty());
    EXPECT_GT(rests[0].end_s, 18.5) << seed;
    EXPECT_LT(rests[0].end_s, 20.6) << seed;
  }
}

TEST(Rest, updates_carry_mean_rates_and_their_scatter) {
  const ImuSeries imu = rest_move_rest(1.0);
  const std::vector<RestUpdate> updates = rest_updates(imu, {0.0, 19.0}, 1.0);
  ASSERT_EQ(updates.size(), 19u);
  for (const RestUpdate& u : updates) {
    EXPECT_LT((u.mean_omega_ib_b - Vector3d(0.003, -0.002, 0.001)).cwiseAbs().maxCoeff(), 5 * 0.02 / 10);
    EXPECT_NEAR(u.std_omega_ib_b.norm() / std::sqrt(3.0), 0.02 / 10, 0.0008);  // 100 samples of 0.02 rad/s
  }
}

TEST(Level, gives_roll_and_pitch_of_a_body_at_rest) {
  for (double roll : {-2.0, -0.3, 0.0, 0.5, 3.0}) {
    for (double pitch : {-1.4, -0.2, 0.0, 1.0}) {
      const Vector3d f = C_b_n_from_rpy({roll, pitch, 0.7}).transpose() * Vector3d(0, 0, -9.8);
      EXPECT_NEAR(level(f)[0], roll, 1e-12);
      EXPECT_NEAR(level(f)[1], pitch, 1e-12);
    }
  }
}

RestStatistics some_rest() {
  RestStatistics rest;
  rest.period = {0, 30};
  rest.p_ea_e = ecef_from_geodetic({0.8, 0.3, 250});
  rest.R_p_e = 1e-4 * Matrix3d::Identity();
  rest.mean_f_ib_b = C_b_n_from_rpy({0.1, -0.05, 0}).transpose() * Vector3d(0, 0, -9.83);
  rest.mean_omega_ib_b = Vector3d(1e-4, -2e-4, 3e-4);
  rest.fixes = 10;
  return rest;
}

const InitialStd kStd{0.006, 3e-4, 2.4e-5, 3.3e-3};
const Vector3d kLever(0.1, -0.05, -0.3);
constexpr double kAxes =
    1e-7;  // rad: north-east-down axes at the antenna and at the IMU differ by the lever arm over the Earth's radius

TEST(Initial, belief_reproduces_what_the_rest_measured) {
  const RestStatistics rest = some_rest();
  const Belief<Model> b = belief_at_rest(rest, 2.0, 0.03, kStd, kLever, GravityModel::normal);
  EXPECT_NEAR(heading_of(b.X), 2.0, kAxes);
  EXPECT_LT((position_of(b.X.first, kLever).h - rest.p_ea_e).norm(), 1e-8);
  const Vector3d rate = b.X.first.C.transpose() * wgs84::omega_ie_e<double>() + b_g(b.X);
  EXPECT_LT((rate - rest.mean_omega_ib_b).norm(), 1e-15);
  const Vector3d f = b.X.first.C.transpose() * -gravity_e(b.X.first.p, GravityModel::normal) + b_a(b.X);
  // the plumb line and the ellipsoid's normal differ by some 1e-7 rad at this height
  EXPECT_LT((f - rest.mean_f_ib_b).norm(), 1e-5);
  // the antenna's variance is that of the fix, whatever heading and lever arm
  const Seen<double> m = position_of(b.X.first, kLever);
  EXPECT_LT((m.H * b.P * m.H.transpose() - rest.R_p_e).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Initial, heading_variance_lies_along_down) {
  const Belief<Model> b = belief_at_rest(some_rest(), 2.0, 0.3, kStd, kLever, GravityModel::normal);
  const Vector3d down = b.X.first.C.transpose() * C_n_e(b.X.first.p).col(2);
  const Matrix3d P = b.P.block<3, 3>(kPhi, kPhi);
  EXPECT_NEAR(down.dot(P * down), 0.09, 1e-9);
  EXPECT_NEAR(P.trace(), 0.09 + 2 * 0.006 * 0.006, 1e-9);
}

TEST(SetHeading, turns_about_down_through_the_antenna_and_replaces_the_heading_variance) {
  Belief<Model> b = belief_at_rest(some_rest(), 2.0, 0.3, kStd, kLever, GravityModel::normal);
  const Vector3d antenna = position_of(b.X.first, kLever).h;
  set_heading(b, -1.0, 0.01, kLever);
  EXPECT_NEAR(heading_of(b.X), -1.0, kAxes);
  EXPECT_LT((position_of(b.X.first, kLever).h - antenna).norm(), 1e-8);
  const Belief<Model> direct = belief_at_rest(some_rest(), -1.0, 0.01, kStd, kLever, GravityModel::normal);
  EXPECT_LT((b.X.first.C - direct.X.first.C).cwiseAbs().maxCoeff(), kAxes);
  // position errors of the antenna do not turn with the body
  const Seen<double> m = position_of(b.X.first, kLever);
  EXPECT_LT((m.H * b.P * m.H.transpose() - some_rest().R_p_e).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((b.P.block<3, 3>(kPhi, kPhi) - direct.P.block<3, 3>(kPhi, kPhi)).cwiseAbs().maxCoeff(), 1e-4 * kAxes);
}

// DRONES (7) as printed, in long double.
double minimum_as_printed(const FitPoint& p1, const FitPoint& p2, const FitPoint& p3) {
  const auto a = [](const FitPoint& i, const FitPoint& j) { return static_cast<long double>(i.x) - j.x; };
  const auto b = [](const FitPoint& i, const FitPoint& j) {
    return static_cast<long double>(i.x) * i.x - static_cast<long double>(j.x) * j.x;
  };
  return static_cast<double>(0.5L * (b(p2, p3) * p1.y + b(p3, p1) * p2.y + b(p1, p2) * p3.y) /
                             (a(p2, p3) * p1.y + a(p3, p1) * p2.y + a(p1, p2) * p3.y));
}

TEST(QuadraticFit, is_the_printed_formula_and_exact_on_parabolas) {
  std::mt19937 rng(2);
  std::uniform_real_distribution<double> u(-3, 3);
  for (int draw = 0; draw < 100; ++draw) {
    const double c = 0.1 + std::abs(u(rng)), x0 = u(rng), y0 = u(rng);
    const auto at = [&](double x) { return FitPoint{x, y0 + c * (x - x0) * (x - x0)}; };
    const FitPoint p1 = at(-2 + 0.1 * u(rng)), p2 = at(0.1 * u(rng)), p3 = at(2 + 0.1 * u(rng));
    const Parabola q = fit_parabola(p1, p2, p3);
    EXPECT_NEAR(q.minimum_x, x0, 1e-10);
    EXPECT_NEAR(q.minimum_x, minimum_as_printed(p1, p2, p3), 1e-10);
    EXPECT_NEAR(q.minimum_y, y0, 1e-10);
    EXPECT_NEAR(q.curvature, 2 * c, 1e-10);
    // DRONES (8)
    const double test = p1.y / ((p1.x - p2.x) * (p1.x - p3.x)) + p2.y / ((p2.x - p1.x) * (p2.x - p3.x)) +
                        p3.y / ((p3.x - p1.x) * (p3.x - p2.x));
    EXPECT_NEAR(q.curvature, 2 * test, 1e-10);
    EXPECT_TRUE(q.has_minimum());
    EXPECT_FALSE(fit_parabola({p1.x, -p1.y}, {p2.x, -p2.y}, {p3.x, -p3.y}).has_minimum());
  }
}

template <typename Cost>
QuadraticSearch run(double centre, double step, Cost cost, int most = 60) {
  QuadraticSearch s(centre, step, 180, 1e-3, most);
  while (!s.done()) {
    std::vector<double> y;
    for (double x : s.ask()) y.push_back(cost(x));
    s.tell(y);
  }
  return s;
}

TEST(QuadraticSearch, settles_on_minimum_and_sigma_of_smooth_curves) {
  // a parabola, the papers' sinusoid, and a curve whose flanks a bounded loss has bent
  for (double x0 : {-170.0, -33.0, 0.0, 4.38, 90.0}) {
    const auto parabola = [&](double x) { return 0.5 * std::pow((x - x0) / 0.3, 2); };
    const auto sinusoid = [&](double x) { return 5000 * (1 - std::cos((x - x0) * kDeg)); };
    const auto bent = [&](double x) { return 8 * std::log1p(std::pow((x - x0) / 0.3, 2) / 16); };
    const double sinusoid_sigma = 1 / std::sqrt(5000.0) / kDeg;
    for (double start : {x0 - 8, x0 + 3, x0}) {
      const QuadraticSearch p = run(start, 6, parabola), s = run(start, 6, sinusoid), b = run(start, 6, bent);
      EXPECT_TRUE(p.settled() && s.settled() && b.settled()) << x0 << " " << start;
      EXPECT_NEAR(p.parabola().minimum_x, x0, 1e-6);
      EXPECT_NEAR(p.parabola().sigma(), 0.3, 1e-6);
      EXPECT_NEAR(s.parabola().minimum_x, x0, 1e-3);
      EXPECT_NEAR(s.parabola().sigma(), sinusoid_sigma, 0.01 * sinusoid_sigma);
      EXPECT_NEAR(b.parabola().minimum_x, x0, 0.05);
      EXPECT_LE(p.evaluations(), 12);
      EXPECT_LE(s.evaluations(), 20);
    }
  }
}

TEST(QuadraticSearch, says_that_a_flat_curve_has_no_minimum) {
  const QuadraticSearch s = run(0, 6, [](double) { return 3.0; });
  EXPECT_FALSE(s.settled());
  EXPECT_FALSE(s.parabola().has_minimum());
}

TEST(QuadraticSearch, survives_failed_evaluations_and_its_budget) {
  const QuadraticSearch s =
      run(0, 6, [](double x) { return x < -5 ? std::numeric_limits<double>::quiet_NaN() : 0.5 * x * x; });
  EXPECT_TRUE(s.settled());
  EXPECT_LE(run(
                0, 6, [](double x) { return -x; }, 20)
                .evaluations(),
            22);
}

HeadingSearchOptions search_options() {
  HeadingSearchOptions o;
  o.guess_std_rad = 20 * kDeg;
  o.grid_step_rad = 15 * kDeg;
  o.grid_std_rad = 15 * kDeg;
  o.triple_step_rad = 6 * kDeg;
  o.tolerance_rad = 0.005 * kDeg;
  o.max_sigma_rad = kDeg;
  return o;
}

// Scores as DESIGN 4.13 says they look: wide candidates carry the prior's curvature, conditional ones the data's.
template <typename Curve>
HeadingResult search(HeadingSearchOptions options, Curve curve) {
  HeadingSearch s(options);
  while (!s.done()) {
    std::vector<CandidateScore> scores;
    for (const HeadingCandidate& c : s.ask()) scores.push_back({curve(c), 0.02, 5.0, {}, {}, 100});
    s.tell(scores);
  }
  return s.result();
}

double sinusoidal(const HeadingCandidate& c, double truth, double sigma) {
  const double variance = sigma * sigma + c.heading_std_rad * c.heading_std_rad;
  return (1 - std::cos(c.heading_rad - truth)) / variance;
}

TEST(HeadingSearch, finds_any_heading_of_the_circle_without_a_guess) {
  for (double truth = 0; truth < 360; truth += 7.3) {
    const HeadingResult r =
        search(search_options(), [&](const HeadingCandidate& c) { return sinusoidal(c, truth * kDeg, 0.05 * kDeg); });
    EXPECT_NEAR(wrap_pi(r.heading_rad - truth * kDeg) / kDeg, 0, 0.005);
    ASSERT_TRUE(r.sigma_rad);
    EXPECT_NEAR(*r.sigma_rad / kDeg, 0.05, 0.001);
    EXPECT_EQ(r.verdict, "aligned");
    EXPECT_LE(r.evaluations, 8 + 20 + 42);
  }
}

TEST(HeadingSearch, a_guess_is_a_prior_with_its_own_weight) {
  HeadingSearchOptions o = search_options();
  o.guess_rad = 10 * kDeg;
  o.guess_std_rad = 2 * kDeg;
  const HeadingResult r = search(o, [&](const HeadingCandidate& c) { return sinusoidal(c, 13 * kDeg, 1.0 * kDeg); });
  EXPECT_NEAR(r.heading_rad / kDeg, (10.0 / 4 + 13.0) / (1.0 / 4 + 1.0), 0.01);  // information-weighted mean
  EXPECT_NEAR(*r.sigma_rad / kDeg, 1 / std::sqrt(1.25), 0.01);
}

TEST(HeadingSearch, verdicts_say_what_the_curve_says) {
  const auto with_sigma = [](double sigma) {
    return search(search_options(), [=](const HeadingCandidate& c) { return sinusoidal(c, 1.0, sigma); });
  };
  EXPECT_EQ(with_sigma(0.5 * kDeg).verdict, "aligned");
  EXPECT_EQ(with_sigma(5 * kDeg).verdict, "weak");
  const HeadingResult nothing = search(search_options(), [](const HeadingCandidate&) { return 1.0; });
  EXPECT_EQ(nothing.verdict, "unobservable");
  EXPECT_FALSE(nothing.sigma_rad);
  const HeadingResult two = search(search_options(), [](const HeadingCandidate& c) {
    return 1000 * (1 - std::cos(2 * c.heading_rad)) / (1 + 1e4 * c.heading_std_rad * c.heading_std_rad);
  });
  EXPECT_EQ(two.verdict, "ambiguous");
  EXPECT_EQ(two.modes().size(), 2u);
}

// As search(), of scores that say more than their cost.
template <typename Score>
HeadingResult search_scores(const HeadingSearchOptions& options, Score score) {
  HeadingSearch s(options);
  while (!s.done()) {
    std::vector<CandidateScore> scores;
    for (const HeadingCandidate& c : s.ask()) scores.push_back(score(c));
    s.tell(scores);
  }
  return s.result();
}

TEST(HeadingSearch, a_flight_that_does_not_fit_is_not_aligned) {
  const auto misfitting = [](double scale) {
    return search_scores(search_options(), [=](const HeadingCandidate& c) {
      CandidateScore score;
      score.cost = sinusoidal(c, 1.0, 0.05 * kDeg);
      score.gate_scales_of_most.position = scale;
      score.fixes = 100;
      return score;
    });
  };
  EXPECT_EQ(misfitting(1.0).verdict, "aligned");
  const HeadingResult off = misfitting(30.0);
  EXPECT_EQ(off.verdict, "weak");
  EXPECT_NE(off.advice.find("does not fit"), std::string::npos);
}

TEST(HeadingSearch, gates_are_those_of_the_tightest_filter_that_copes) {
  // Open filters follow outliers and take everything for noise, a gated one finds its own. Those in force are doubled
  // each time: 4 is the first that finds no more than half as much again.
  const auto found = [](const HeadingCandidate& c) {
    if (!c.gated) return GateScales{500, 1};
    return c.gate_scales.position < 4 ? GateScales{6.1, 1} : GateScales{5, 1};
  };
  const auto score = [&](const HeadingCandidate& c) {
    return CandidateScore{sinusoidal(c, 1.0, 0.1 * kDeg), 0.02, 5.0, found(c), {}, 100};
  };
  std::vector<double> in_force;  // of the conditional candidates
  const HeadingResult r = search_scores(search_options(), [&](const HeadingCandidate& c) {
    if (c.gated && c.heading_std_rad == 0) in_force.push_back(c.gate_scales.position);
    return score(c);
  });
  EXPECT_EQ(r.gate_scales.position, 5.0);
  EXPECT_EQ(r.gate_scales.velocity, 1.0);
  ASSERT_FALSE(in_force.empty());
  for (double gates : in_force) EXPECT_EQ(gates, 5.0);
  EXPECT_NEAR(r.heading_rad, 1.0, 0.005 * kDeg);
}

// Their 80 % point is an outlier in every filter, so that none copes by it; most of the fixes fit the tight ones.
TEST(HeadingSearch, more_outliers_than_a_fifth_do_not_open_the_gates) {
  const HeadingResult r = search_scores(search_options(), [&](const HeadingCandidate& c) {
    const bool tight = c.gated && c.gate_scales.position < 500;
    return CandidateScore{sinusoidal(c, 1.0, 0.1 * kDeg), 0.02, 5.0, {5000, 1}, {tight ? 1.2 : 300.0, 1}, 100};
  });
  EXPECT_EQ(r.gate_scales.position, 1.2);
  EXPECT_EQ(r.verdict, "aligned");
}

// Everything that follows outliers, the open candidates and the wide ones, says 3 rad; so does a hollow of the gated ones.
// What they have at 1 rad is far lower, and 0.9 deg beside a sample of the circle at most.
TEST(HeadingSearch, a_minimum_of_the_outliers_is_left_for_the_lower_one) {
  for (const double truth : {1.0, 1.1, 4.5}) {
    const HeadingResult r = search(search_options(), [=](const HeadingCandidate& c) {
      const double feigned = 5000.0 + std::min(sinusoidal(c, 3.0, 0.1 * kDeg), 4000.0);
      if (!c.gated || c.heading_std_rad > 0) return sinusoidal(c, 3.0, 0.1 * kDeg);
      return std::min(feigned, sinusoidal(c, truth, 0.1 * kDeg));
    });
    EXPECT_NEAR(wrap_pi(r.heading_rad - truth) / kDeg, 0.0, 0.005);
    EXPECT_NEAR(r.sigma_rad.value_or(0.0) / kDeg, 0.1, 0.002);
    EXPECT_EQ(r.verdict, "aligned");
  }
}

// Two basins of which the second is the better one, then a lower minimum beside both whose flight was level to degrees only: the
// whole circle is searched again, and nothing of the fits before it is left.
TEST(HeadingSearch, a_lower_minimum_may_ask_for_another_start) {
  bool tilted = false;
  const HeadingResult r = search_scores(search_options(), [&](const HeadingCandidate& c) {
    const bool open = !c.gated || c.heading_std_rad > 0;
    const double first = sinusoidal(c, 5.0, 0.1 * kDeg) + (open ? 0.0 : 6000.0);
    const double second = sinusoidal(c, 3.0, 0.1 * kDeg) + (open ? 5.0 : 5000.0);
    // From the corrected start there is one basin, and so one fit where there were three.
    const double feigned = c.start.roll_rad > 0 ? sinusoidal(c, 1.0, 0.1 * kDeg) : std::min({first, second, 9000.0});
    CandidateScore score{feigned, 0.02, 5.0, {}, {}, 100};
    if (!open) score.cost = std::min(feigned, sinusoidal(c, 1.0, 0.1 * kDeg));
    if (!c.smoothed) return score;
    score.start.emplace();
    if (std::abs(wrap_pi(c.heading_rad - 1.0)) < 0.1) {
      score.start->roll_rad = 2.0 * kDeg;
      tilted = true;
    }
    return score;
  });
  EXPECT_TRUE(tilted);
  EXPECT_NEAR(wrap_pi(r.heading_rad - 1.0) / kDeg, 0.0, 0.005);
  EXPECT_NEAR(r.start.roll_rad, 2.0 * kDeg, 1e-12);
}

TEST(HeadingSearch, a_latency_far_from_the_coarse_one_is_found) {
  for (const double wrong : {-0.3, 0.3}) {
    HeadingSearchOptions o = search_options();
    o.estimate_latency = true;
    o.seeds = {{1.0 + 2 * kDeg, 2 * kDeg, 0.1 + wrong}};
    const HeadingResult r = search(o, [](const HeadingCandidate& c) {
      return sinusoidal(c, 1.0, 0.1 * kDeg) + 0.5 * std::pow((c.parameters.latency_s - 0.1) / 0.004, 2);
    });
    EXPECT_NEAR(r.parameters.latency_s, 0.1, 0.0004);  // a tenth of its sigma, the tolerance of SurfaceLimits
    ASSERT_TRUE(r.parameters_std.latency_s);
    EXPECT_NEAR(*r.parameters_std.latency_s, 0.004, 1e-4);
    EXPECT_NEAR(wrap_pi(r.heading_rad - 1.0) / kDeg, 0.0, 0.01);
    ASSERT_TRUE(r.sigma_rad);
    EXPECT_NEAR(*r.sigma_rad / kDeg, 0.1, 0.002);
    EXPECT_FALSE(r.parameters_std.clock_drift);  // nobody asked for it in a flight this short
  }
}

TEST(HeadingSearch, a_clock_drift_is_used_only_where_it_is_significant) {
  HeadingSearchOptions o = search_options();
  o.span_s = 300;
  o.estimate_latency = true;
  o.seeds = {{1.0, 2 * kDeg, 0.05}};
  const auto with_drift = [&](double drift, double std) {
    return search(o, [=](const HeadingCandidate& c) {
      const double middle = c.parameters.latency_s + 150 * c.parameters.clock_drift;  // where a flight shows it best
      return sinusoidal(c, 1.0, 0.1 * kDeg) + 0.5 * std::pow((middle - 0.1) / 0.004, 2) +
             0.5 * std::pow((c.parameters.clock_drift - drift) / std, 2);
    });
  };
  for (const double drift : {-4e-5, 4e-5}) {
    const HeadingResult sharp = with_drift(drift, 2e-6);
    EXPECT_NEAR(sharp.parameters.clock_drift, drift,
                2e-7);  // a tenth of its sigma, which is more than the prior's pull
    ASSERT_TRUE(sharp.parameters_std.clock_drift);
    EXPECT_NEAR(*sharp.parameters_std.clock_drift, 2e-6, 1e-7);
    EXPECT_NEAR(sharp.parameters.latency_s + 150 * drift, 0.1, 0.0004);  // at the start, half a flight from there
    ASSERT_TRUE(sharp.parameters_std.latency_s);
    EXPECT_NEAR(*sharp.parameters_std.latency_s, std::hypot(0.004, 150 * 2e-6), 1e-4);
    EXPECT_NEAR(wrap_pi(sharp.heading_rad - 1.0) / kDeg, 0.0, 0.01);
    const HeadingResult flat = with_drift(drift, 1e-3);
    EXPECT_EQ(flat.parameters.clock_drift, 0.0);
    ASSERT_TRUE(flat.parameters_std.clock_drift);
    EXPECT_NEAR(*flat.parameters_std.clock_drift, 5e-5, 1e-6);  // the prior's
    EXPECT_NEAR(flat.parameters.latency_s, 0.1, 0.0004);
  }
}

TEST(HeadingSearch, wraps_stay_in_their_intervals) {
  for (double x = -20; x < 20; x += 0.37) {
    EXPECT_GT(wrap_pi(x), -kPi);
    EXPECT_LE(wrap_pi(x), kPi);
    EXPECT_GE(wrap_2pi(x), 0.0);
    EXPECT_LT(wrap_2pi(x), 2 * kPi);
    EXPECT_NEAR(std::remainder(wrap_pi(x) - x, 2 * kPi), 0, 1e-12);
    EXPECT_NEAR(std::remainder(wrap_2pi(x) - x, 2 * kPi), 0, 1e-12);
  }
  EXPECT_EQ(wrap_2pi(-1e-20), 0.0);
}

}  // namespace
}  // namespace liealign
