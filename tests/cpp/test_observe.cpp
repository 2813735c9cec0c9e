// Laws of the observations: the derivatives of every kind, by the left error and by the tail; lanes; the motion of an antenna;
// and that a kind nobody has foreseen needs nothing but itself.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "flights.hpp"
#include "liealign/estimate/interval_smoother.hpp"
#include "liealign/estimate/score.hpp"
#include "liealign/estimate/smoother.hpp"
#include "observations.hpp"

namespace liealign {
namespace {

using namespace testing;

// A kind of this file alone: the distance of an antenna from a point on the ground.
struct Range {
  static constexpr std::string_view kName = "range";
  static constexpr int kRows = 1;
  static constexpr GateClass kGate = GateClass::scalar;
  static constexpr ResidualAxes kAxes = ResidualAxes::own;  // m
  static constexpr unsigned kBlocks = kSeesPhi | kSeesRho;
  static constexpr bool kHasJitter = false;

  static void see(const StateView<double>& view, const Observation& o, Sighting<double>& out) {
    const Seen<double> p = position_of(view.X, o.lever_b);
    const Vector3d away = p.h - o.place_e;
    out.z[0] = o.y[0] - away.norm();
    out.H.row(0) = away.normalized().transpose() * p.H;
    out.R(0, 0) = o.R(0, 0);
  }
};
const ObservationKind kRange = kind_of<Range>();

std::vector<const ObservationKind*> all_kinds() {
  std::vector<const ObservationKind*> all(observation_kinds().begin(), observation_kinds().end());
  all.push_back(&kRange);
  return all;
}

// Steps of the tail that no rounding of ECEF metres is large against.
TailVector<double> tail_steps() {
  TailVector<double> s = TailVector<double>::Constant(0.1);
  s.segment<3>(kTailPositionLatency).setConstant(1e-3);
  return s;
}

struct Drawn {
  NavState<double> X;
  Vector3d omega, f;
  Observation o;
  TailVector<double> tail;

  Drawn(const ObservationKind& kind, std::mt19937& rng)
      : X(random_state(rng)),
        omega(normal3(rng)),
        f(normal3(rng, 3.0) + Vector3d(0, 0, -9.8)),
        o(some_observation(kind, X, rng)),
        tail(some_tail(rng)) {}
};

TEST(Observations, derivatives_by_the_left_error_are_those_of_what_is_seen) {
  std::mt19937 rng(1);
  for (const ObservationKind* kind : all_kinds()) {
    for (int draw = 0; draw < 20; ++draw) {
      const Drawn d(*kind, rng);
      for (const TailVector<double>* tail : {static_cast<const TailVector<double>*>(nullptr), &d.tail}) {
        const Eigen::MatrixXd numeric = derivative_by_left_error(
            d.X, [&](const NavState<double>& Y) -> Eigen::VectorXd { return -seen_of(d.o, Y, d.omega, d.f, tail).z; },
            default_steps());
        const Sighting<double> seen = seen_of(d.o, d.X, d.omega, d.f, tail);
        // 2e-9 m of rounding and the second order, both over the attitude step of 1e-3
        EXPECT_LT((numeric - seen.H).cwiseAbs().maxCoeff(), 5e-6) << kind->name << (tail ? " with a tail" : "");
        for (int block = 0; tail == nullptr && block < 5; ++block) {
          if ((kind->blocks >> static_cast<unsigned>(block) & 1U) == 0) {
            EXPECT_TRUE(seen.H.middleCols<3>(3 * block).isZero(0.0)) << kind->name << " block " << block;
          }
        }
      }
    }
  }
}

TEST(Observations, derivatives_by_the_tail_are_those_of_what_is_seen) {
  std::mt19937 rng(2);
  const TailVector<double> step = tail_steps();
  for (const ObservationKind* kind : all_kinds()) {
    for (int draw = 0; draw < 20; ++draw) {
      const Drawn d(*kind, rng);
      const Sighting<double> seen = seen_of(d.o, d.X, d.omega, d.f, &d.tail);
      for (int i = 0; i < kLongTail; ++i) {
        const TailVector<double> by = step[i] * TailVector<double>::Unit(i), plus = d.tail + by, minus = d.tail - by;
        const Vector3d numeric =
            (seen_of(d.o, d.X, d.omega, d.f, &minus).z - seen_of(d.o, d.X, d.omega, d.f, &plus).z) / (2.0 * step[i]);
        // 2e-9 m of rounding over the step of a latency
        EXPECT_LT((numeric - seen.H_tail.col(i)).cwiseAbs().maxCoeff(), 3e-6) << kind->name << " tail " << i;
      }
    }
  }
}

TEST(Observations, rows_that_a_kind_does_not_have_say_nothing) {
  std::mt19937 rng(3);
  for (const ObservationKind* kind : all_kinds()) {
    const Drawn d(*kind, rng);
    const Sighting<double> seen = seen_of(d.o, d.X, d.omega, d.f, &d.tail);
    const int rest = kMostRows - kind->rows;
    EXPECT_TRUE(seen.z.tail(rest).isZero(0.0)) << kind->name;
    EXPECT_TRUE(seen.H.bottomRows(rest).isZero(0.0)) << kind->name;
    EXPECT_TRUE(seen.H_tail.bottomRows(rest).isZero(0.0)) << kind->name;
    EXPECT_TRUE(seen.R.bottomRightCorner(rest, rest).isIdentity(0.0)) << kind->name;
    EXPECT_TRUE(seen.R.bottomLeftCorner(rest, kind->rows).isZero(0.0)) << kind->name;
    EXPECT_GT(seen.R.diagonal().minCoeff(), 0.0) << kind->name;
  }
}

TEST(Observations, in_lanes_are_those_of_each_lane) {
  std::mt19937 rng(4);
  for (const ObservationKind* kind : all_kinds()) {
    const Drawn d(*kind, rng);
    NavState<Lanes> X;
    TailVector<Lanes> tail;
    std::vector<NavState<double>> states;
    std::vector<TailVector<double>> tails;
    for (int i = 0; i < Lanes::kCount; ++i) {
      Vector<double, 15> eps;
      eps << normal3(rng, 0.1), normal3(rng), normal3(rng), normal3(rng, 0.01), normal3(rng, 0.01);
      states.push_back(d.X * NavState<double>::exp(eps));
      tails.push_back(some_tail(rng));
      set_lane(X, i, states.back());
      set_lane(tail, i, tails.back());
    }
    StateView<Lanes> view{X.first, d.omega.cast<Lanes>() - b_g(X), d.f.cast<Lanes>() - b_a(X), b_g(X), tail, true, 1e-5,
                          0.0};
    Sighting<Lanes> seen;
    see(view, d.o, seen);
    for (int i = 0; i < Lanes::kCount; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const Sighting<double> one = seen_of(d.o, states[at], d.omega, d.f, &tails[at]);
      // 6e6 m carry a nanometre
      EXPECT_LT((lane(seen.z, i) - one.z).norm(), 1e-8) << kind->name;
      EXPECT_LT((lane(seen.H, i) - one.H).norm(), 1e-12 * (1.0 + one.H.norm())) << kind->name;
      EXPECT_LT((lane(seen.H_tail, i) - one.H_tail).norm(), 1e-12 * (1.0 + one.H_tail.norm())) << kind->name;
      EXPECT_LT((lane(seen.R, i) - one.R).norm(), 1e-12 * one.R.norm()) << kind->name;
    }
  }
}

TEST(Observations, jitter_that_is_no_state_is_noise_along_the_motion) {
  std::mt19937 rng(5);
  for (const ObservationKind* kind : {&kGnssPosition, &kGnssVelocity}) {
    const Drawn d(*kind, rng);
    StateView<double> view{d.X.first, d.omega, d.f, b_g(d.X), TailVector<double>::Zero(), true, 1e-5, 0.0};
    Sighting<double> without, with;
    see(view, d.o, without);
    view.jitter_variance = 9e-6;
    see(view, d.o, with);
    const Vector3d along = without.H_tail.col(kTailJitter);
    EXPECT_GT(along.norm(), 0.1);
    EXPECT_LT((with.R - without.R - 9e-6 * along * along.transpose()).norm(), 1e-15) << kind->name;
  }
}

// What the gyros of a rest read has at least their own noise; what the config adds is added to whichever is more.
TEST(Observations, a_zero_rate_is_no_surer_than_its_gyros) {
  std::mt19937 rng(6);
  const NavState<double> X = random_state(rng);
  const double arw = 1e-5, T = 2.0, zaru = 3e-5;
  for (const double scatter : {0.0, 1e-4}) {
    std::vector<Observation> two;
    add_observations(RestUpdate{0.0, T, Vector3d::Zero(), Vector3d::Constant(scatter)}, {0.005, zaru}, two);
    ASSERT_EQ(two.size(), 2U);
    const Sighting<double> seen = seen_of(two[1], X, Vector3d::Zero(), Vector3d::Zero());
    const double expected = std::max(scatter * scatter, arw * arw / T) + zaru * zaru;
    EXPECT_LT((seen.R - expected * Matrix3d::Identity()).norm(), 1e-12 * expected) << scatter;
  }
}

TEST(AntennaMotion, each_is_the_derivative_of_the_one_before) {
  std::mt19937 rng(7);
  const Vector3d l(0.4, -0.3, -0.8);
  const SE23<double> X = random_state(rng).first;
  const Vector3d omega = normal3(rng, 1.0), f = normal3(rng, 10.0);
  const double h = 1e-3;
  const SE23<double> plus = mechanize_exact(X, {omega, f, h}, GravityModel::normal),
                     minus = mechanize_exact(X, {omega, f, -h}, GravityModel::normal);
  const Vector3d v = (position_of(plus, l).h - position_of(minus, l).h) / (2 * h);
  EXPECT_LT((v - velocity_of(X, l, omega).h).norm(), 1e-5);
  const Vector3d a = (velocity_of(plus, l, omega).h - velocity_of(minus, l, omega).h) / (2 * h);
  // The Earth's turn of the arm's own velocity, 2 omega_ie |w x l|, is left out.
  EXPECT_LT((a - acceleration_of(X, l, omega, f).h).norm(), 2.0 * 7.3e-5 * omega.cross(l).norm() + 1e-5);
}

// ---- A kind that nobody has foreseen --------------------------------------------------------------------------------

// A flight whose ranges to two points are seen as well: the last of them wrong.
struct Ranged {
  SimulatedFlight simulated = table_1_flight(70.0, 4);
  PreparedFlight prepared = prepare_flight(simulated.flight);
  std::size_t ranges = 0;

  Ranged() {
    FlightData& data = prepared.data;
    const Vector3d origin = data.fixes.front().p_ea_e;
    const Matrix3d C = C_n_e(origin);
    Observation o;
    o.kind = &kRange;
    o.lever_b = data.l_ba_b;
    o.R(0, 0) = 0.003 * 0.003;
    std::mt19937 rng(8);
    for (double t = prepared.t_begin_s + 20.3; t < data.imu().back().t_s - 1.0; t += 0.7, ++ranges) {
      o.t_s = t;
      o.place_e = origin + C * (ranges % 2 == 0 ? Vector3d(-80, 30, 5) : Vector3d(40, 90, 5));
      const SE23<double> X = truth_at(simulated.truth, t);
      o.y[0] = (position_of(X, data.l_ba_b).h - o.place_e).norm() + normal3(rng, 0.003).x();
      data.others.push_back(o);
    }
    data.others.back().y[0] += 1.0;
    list_observations(data);
  }

  Belief<LieModel<double>> start() const {
    const AlignmentProblem& problem = prepared.problem;
    return belief_at_rest(problem.rest, 70.0 * kDegToRad, 0.02, problem.initial, prepared.data.l_ba_b,
                          prepared.filter.dynamics.gravity);
  }
};

const Ranged& ranged() {
  static const Ranged r;
  return r;
}

TEST(NewKind, goes_through_the_forward_pass_and_its_gate) {
  const Ranged& r = ranged();
  struct Counts : SilentVisitor<LieModel<double>> {
    std::size_t seen = 0, outliers = 0;
    double nis = 0.0;
    void updated(const Observation& o, const Innovation<double>& i) {
      if (o.kind != &kRange) return;
      ++seen;
      outliers += i.verdict == Verdict::used ? 0 : 1;
      if (i.verdict == Verdict::used) nis += i.nis;
    }
  } counts;
  Belief<LieModel<double>> belief = r.start();
  const ImuSeries& imu = r.prepared.data.imu();
  forward_pass(r.prepared.data, r.prepared.filter, belief, cursor_at(imu, r.prepared.t_begin_s), imu.back().t_s,
               counts);
  EXPECT_EQ(counts.seen, r.ranges);
  EXPECT_GE(counts.outliers, 1U);
  EXPECT_LE(counts.outliers, 3U);  // one in a thousand is beyond the gate by chance
  const auto n = static_cast<double>(counts.seen - counts.outliers);
  EXPECT_NEAR(counts.nis / n, 1.0, 4.0 * std::sqrt(2.0 / n));  // chi-square with one degree of freedom
}

TEST(NewKind, sharpens_the_smoother_of_a_short_tail) {
  const Ranged& r = ranged();
  FlightData without = r.prepared.data;
  std::erase_if(without.observations, [](const Observation& o) { return o.kind == &kRange; });
  FilterOptions options = r.prepared.filter;
  options.tail.sigma_c = 1.0;
  const Belief<LieModel<double>> core = r.start();
  Belief<LieModel<double, kShortTail>> belief;
  belief.X.first = core.X.first;
  belief.X.second.x.head<6>() = core.X.second.x;
  belief.P.setZero();
  belief.P.topLeftCorner<kTail, kTail>() = core.P;
  belief.P.bottomRightCorner<kShortTail, kShortTail>() =
      tail_prior(options.tail).topLeftCorner<kShortTail, kShortTail>();
  const ImuCursor start = cursor_at(without.imu(), r.prepared.t_begin_s);
  const auto end_error = [&](const FlightData& data, std::size_t& nodes, double& sigma) {
    const ForwardRun<kShortTail> run = run_forward<kShortTail>(data, options, belief, start);
    double squares = 0.0;
    nodes = 0;
    sigma = 0.0;
    SmootherSink sink;
    sink.wanted = [](std::size_t) { return false; };
    sink.node = [&](std::size_t, double t_s, const NodeBelief&, const NodeBelief& smoothed) {
      if (t_s < r.prepared.t_begin_s + 21.0) return;
      squares += (smoothed.belief.X.first.p - truth_at(r.simulated.truth, t_s).p).squaredNorm();
      sigma += std::sqrt(smoothed.belief.P.block<3, 3>(kRho, kRho).trace());
      ++nodes;
    };
    sink.made = sink.take = [](std::size_t) {};
    smooth_run<kShortTail>(data, options, run, sink);
    sigma /= static_cast<double>(nodes);
    return std::sqrt(squares / static_cast<double>(nodes));
  };
  std::size_t nodes = 0, nodes_without = 0;
  double sigma = 0.0, sigma_without = 0.0;
  const double with = end_error(r.prepared.data, nodes, sigma),
               fixes = end_error(without, nodes_without, sigma_without);
  EXPECT_GT(nodes, nodes_without);
  EXPECT_LT(sigma, sigma_without);
  EXPECT_LT(with, fixes);
}

TEST(NewKind, is_scored_and_recorded) {
  const Ranged& r = ranged();
  HeadingResult heading;
  heading.heading_rad = 70.0 * kDegToRad;
  heading.sigma_rad = 0.2 * kDegToRad;
  const Solution solution = process(r.prepared, heading);
  ASSERT_EQ(solution.others.size(), r.ranges);
  for (const UpdateRecord& record : solution.others) EXPECT_EQ(record.kind->name, "range");
  EXPECT_NE(solution.others.back().update.verdict, Verdict::used);
  EXPECT_NEAR(solution.others.back().update.residual_n[0], 1.0, 0.1);
  EXPECT_LT(solution.others.front().update.std_n[0], 0.05);

  Score<double> score;
  Innovation<double> innovation;
  innovation.nis = 3.0;
  innovation.half_log_det_S = -1.0;
  Observation range;
  range.kind = &kRange;
  score.add(FilterOptions{}, range, innovation);
  EXPECT_DOUBLE_EQ(score.negative_log_likelihood, 0.5);
  EXPECT_EQ(score.positions, 0U);
}

}  // namespace
}  // namespace liealign
