// Laws of filter and smoother with a tail: they are the conditional mean and covariance of one joint normal distribution; inside
// an interval stands what a node there would have; a tail of zeros is none.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <map>

#include "liealign/estimate/interval_smoother.hpp"
#include "liealign/estimate/solution.hpp"
#include "liealign/observe/kinds.hpp"
#include "numeric.hpp"

namespace liealign {
namespace {

using testing::normal3;
using testing::random_state;
using Core = LieModel<double>;
using Whole = LieModel<double, kLongTail>;
constexpr int kDim = Whole::Dim;

// So small that the group is linear, and ECEF metres have a rounding of 1e-5 of a sigma.
constexpr double kSmall = 1e-4;

// All there is of c (of first order, or coloured), s, latencies, jitter and barometer.
TailModel some_tail_model(bool is_long) {
  TailModel m;
  m.sigma_c = 1.0;
  m.tau_c_s = 2.0;
  m.latency_std_s = m.velocity_latency_std_s = 0.1 * kSmall;
  m.jitter_s = 0.1 * kSmall;
  m.baro_std_m = 2.0 * kSmall;
  m.baro_tau_s = 5.0;
  if (!is_long) return m;
  m.tau_u_s = 0.7;
  m.sigma_s_mps = kSmall;
  m.tau_s_s = 1.0;
  return m;
}

// A body that is shaken about, seen by a receiver.
struct SmallFlight {
  FlightData data;
  FilterOptions options;
  Belief<Core> start;
  std::mt19937 rng{5};
  std::size_t messages = 0;

  SmallFlight(const TailModel& tail, double seconds) {
    options.tail = tail;
    options.gate.outliers = options.velocity_gate.outliers = options.scalar_gate.outliers = Outliers::off;
    options.dynamics.noise.gyro_arw = 0.02 * kSmall;
    options.dynamics.noise.accel_vrw = 0.3 * kSmall;
    start.X = random_state(rng);
    start.X.first.v *= 2.0;
    Vector<double, 15> sigma;
    sigma << Vector3d::Constant(0.1), Vector3d::Constant(1.0), Vector3d::Constant(1.0), Vector3d::Constant(0.5),
        Vector3d::Constant(0.1);
    start.P = (kSmall * sigma).cwiseAbs2().asDiagonal();
    const Vector3d up = -start.X.first.C.transpose() * gravity_e(start.X.first.p, GravityModel::normal);
    ImuSeries imu;
    for (int k = 0; k <= static_cast<int>(100.0 * seconds); ++k) {
      const double t = 0.01 * k;
      imu.push_back({t, Vector3d(0.8 * std::sin(5 * t), 0.7 * std::cos(7 * t), 0.5 * std::sin(2 * t)),
                     up + Vector3d(3 * std::sin(4 * t), 2 * std::cos(3 * t), 2 * std::sin(9 * t))});
    }
    data.samples = std::make_shared<const ImuSeries>(std::move(imu));
  }

  // A message at time t; its velocity `late` seconds behind its position.
  void add_message(double t, double late, bool new_datum = false) {
    Observation o;
    o.kind = &kGnssPosition;
    o.record = messages++;
    o.t_s = t;
    o.new_datum = new_datum;
    o.lever_b = Vector3d(0.1, -0.05, -0.3);
    const Matrix3d C = C_n_e(start.X.first.p);
    o.root = kSmall * C * Vector3d(1.0, 0.8, 2.0).asDiagonal();
    o.R = kSmall * kSmall * C * Vector3d(0.04, 0.05, 0.09).asDiagonal() * C.transpose();
    data.others.push_back(o);
    o.kind = &kGnssVelocity;
    o.t_s = t + late;
    o.new_datum = false;
    o.root = C;
    o.R *= 2.0;
    data.others.push_back(o);
  }
  void add(const ObservationKind& kind, double t, double sigma) {
    Observation o;
    o.kind = &kind;
    o.t_s = t;
    o.R = sigma * sigma * Matrix3d::Identity();
    data.others.push_back(o);
  }

  template <int tail>
  Belief<LieModel<double, tail>> belief() const {
    Belief<LieModel<double, tail>> b;
    b.X.first = start.X.first;
    b.X.second.x.template head<6>() = start.X.second.x;
    b.P.setZero();
    b.P.template topLeftCorner<kTail, kTail>() = start.P;
    if constexpr (tail > 0)
      b.P.template bottomRightCorner<tail, tail>() = tail_prior(options.tail).topLeftCorner<tail, tail>();
    return b;
  }
};

// ---- One joint normal distribution ----------------------------------------------------------------------------------

// Blocks of kDim, one more after every step x <- A x + w, and what is seen of them.
struct Joint {
  Eigen::MatrixXd P;
  std::vector<Whole::State> reference;  // of each block
  // What is seen of a block.
  struct Seen {
    Eigen::Index block;
    Ekf<Whole>::Tall Ht;
    Vector3d z;
    Matrix3d R;
  };
  std::vector<Seen> seen;
  struct Node {
    Eigen::Index block;
    std::size_t seen;  // after the updates; what is seen up to there
  };
  std::map<double, Node> nodes;

  Eigen::Index blocks() const { return P.rows() / kDim; }
  void step(const Whole::Covariance& A, const Whole::Covariance& Q, const Whole::State& X) {
    const Eigen::Index n = P.rows();
    Eigen::MatrixXd next(n + kDim, n + kDim);
    next.topLeftCorner(n, n) = P;
    next.bottomLeftCorner(kDim, n) = A * P.bottomRows(kDim);
    next.topRightCorner(n, kDim) = next.bottomLeftCorner(kDim, n).transpose();
    next.bottomRightCorner(kDim, kDim) = A * P.bottomRightCorner(kDim, kDim) * A.transpose() + Q;
    P = std::move(next);
    reference.push_back(X);
  }
  // What a block is, given the first `n` of what is seen: the error about its reference, and its covariance.
  std::pair<Whole::Tangent, Whole::Covariance> given(Eigen::Index block, std::size_t n) const {
    const auto between = [&](Eigen::Index a, Eigen::Index b) -> Whole::Covariance {
      return P.block<kDim, kDim>(kDim * a, kDim * b);
    };
    const auto rows = static_cast<Eigen::Index>(3 * n);
    Eigen::MatrixXd S(rows, rows), of_block(kDim, rows);
    Eigen::VectorXd z(rows);
    for (std::size_t i = 0; i < n; ++i) {
      const auto row = static_cast<Eigen::Index>(3 * i);
      z.segment<3>(row) = seen[i].z;
      of_block.middleCols<3>(row) = between(block, seen[i].block) * seen[i].Ht;
      for (std::size_t j = 0; j < n; ++j)
        S.block<3, 3>(row, static_cast<Eigen::Index>(3 * j)) =
            seen[i].Ht.transpose() * between(seen[i].block, seen[j].block) * seen[j].Ht;
      S.block<3, 3>(row, row) += seen[i].R;
    }
    // By correlations: rows that say nothing have a variance of one.
    const Eigen::VectorXd scale = S.diagonal().cwiseSqrt().cwiseInverse();
    S = (scale.asDiagonal() * S * scale.asDiagonal()).eval();
    of_block = (of_block * scale.asDiagonal()).eval();
    const Eigen::LLT<Eigen::MatrixXd> llt(S);
    return {of_block * llt.solve(scale.cwiseProduct(z)),
            between(block, block) - of_block * llt.solve(of_block.transpose())};
  }
};

// x <- the same, with these components drawn anew.
void redraw(Joint& joint, const std::vector<int>& components, const Whole::Covariance& prior) {
  Whole::Covariance A = Whole::Covariance::Identity(), Q = Whole::Covariance::Zero();
  for (const int i : components) {
    A(i, i) = 0.0;
    for (const int j : components) Q(i, j) = prior(i, j);
  }
  joint.step(A, Q, joint.reference.back());
}

void step_over(Joint& joint, const SmallFlight& flight, double end_s, ImuCursor& at, Belief<Whole>& unaided) {
  const auto nothing_inside = [](std::size_t, const Preintegrated<double>&) {};
  const Ekf<Core> ekf{flight.options.dynamics, true};
  const Vector<double, 6> b = biases(unaided.X);
  const Preintegrated<double> pre =
      preintegrate_to(end_s, flight.data.imu(), b, flight.options.dynamics.noise, at, nothing_inside);
  const SE23<double> d{pre.dC, pre.dv, pre.dp};
  const StartAxes<double> axes(unaided.X.first, pre.T);
  const NavTransition<double> t = interval_transition(axes, d, pre);
  Whole::Covariance A = Whole::Covariance::Identity(), Q = Whole::Covariance::Zero();
  A.topLeftCorner<9, 9>() = t.F;
  A.block<9, 6>(0, 9) = t.B;
  Core::Covariance noise = Core::Covariance::Zero();
  propagate_interval<double, Core::Dim>(noise, axes, d, pre, ekf.half_walk(pre.T));
  Q.topLeftCorner<kTail, kTail>() = noise;
  const TailStep step = tail_step(flight.options.tail, pre.T);
  for (int i = 0; i < kLongTail; ++i) {
    const auto k = static_cast<std::size_t>(i);
    A(kTail + i, kTail + i) = step.keep[k];
    Q(kTail + i, kTail + i) = step.noise[k];
    if (TailStep::driver(i) < 0) continue;
    const int driver = kTail + TailStep::driver(i);
    A(kTail + i, driver) = step.from_driver[k];
    Q(kTail + i, driver) = Q(driver, kTail + i) = step.with_driver[k];
  }
  const IntervalPull<double> pull(unaided.X.first, d, pre.T, flight.options.dynamics.gravity);
  unaided.X.first = advance_interval(unaided.X.first, d, pre.T, pull);
  joint.step(A, Q, unaided.X);
}

// Draws what is seen, about the unaided trajectory, and the joint distribution with it.
Joint joint_of(SmallFlight& flight) {
  list_observations(flight.data);
  Joint joint;
  Belief<Whole> unaided = flight.belief<kLongTail>();
  joint.P = unaided.P;
  joint.reference = {unaided.X};
  Whole::Covariance prior = Whole::Covariance::Zero();
  prior.bottomRightCorner<kLongTail, kLongTail>() = tail_prior(flight.options.tail);
  prior(kTail + kTailJitter, kTail + kTailJitter) = flight.options.tail.jitter_s * flight.options.tail.jitter_s;
  ImuCursor at = cursor_at(flight.data.imu(), 0.0);
  std::size_t message = ObservationMemory::kNone;
  for (Observation& o : flight.data.observations) {
    while (at.t_s < o.t_s) step_over(joint, flight, interval_end(at.t_s, o.t_s), at, unaided);
    if (o.new_datum) {
      std::vector<int> error;
      for (int i = 0; i < 3; ++i) error.push_back(kTail + kTailC + i);
      for (int i = 0; i < 3; ++i) error.push_back(kTail + kTailU + i);
      redraw(joint, error, prior);
    }
    if (o.kind->has_jitter && o.record != message) redraw(joint, {kTail + kTailJitter}, prior);
    if (o.kind->has_jitter) message = o.record;
    Ekf<Whole>::Tall Ht;
    const ImuReading reading = reading_at(flight.data.imu(), at);
    o.y.setZero();
    Sighting<double> seen = sight(o, flight.options, reading, true, unaided, Ht);
    const Vector3d drawn = normal3(flight.rng, kSmall);
    o.y = drawn.cwiseProduct(Vector3d(1.0, o.kind->rows > 1 ? 1.0 : 0.0, o.kind->rows > 1 ? 1.0 : 0.0)) - seen.z;
    seen = sight(o, flight.options, reading, true, unaided, Ht);
    joint.seen.push_back({joint.blocks() - 1, Ht, seen.z, seen.R});
    joint.nodes[o.t_s] = {joint.blocks() - 1, joint.seen.size()};
  }
  return joint;
}

// In sigmas: the first `rows` components of the whole state and its covariance.
void expect_equal(const Whole::State& reference, const std::pair<Whole::Tangent, Whole::Covariance>& expected,
                  const Whole::State& X, const Whole::Covariance& P, int rows, const std::string& what) {
  const Whole::Tangent moved = Whole::local(reference, X);
  for (int i = 0; i < rows; ++i) {
    const double sigma = std::sqrt(std::max(expected.second(i, i), 0.0));
    EXPECT_NEAR(moved[i], expected.first[i], 2e-3 * sigma + 1e-20) << what << " state " << i;
    for (int j = 0; j <= i; ++j) {
      const double both = sigma * std::sqrt(std::max(expected.second(j, j), 0.0));
      EXPECT_NEAR(P(i, j), expected.second(i, j), 1e-3 * both + 1e-25) << what << " states " << i << ", " << j;
    }
  }
}

template <int tail>
void expect_whole(const Joint& joint, const Belief<LieModel<double, tail>>& belief, Eigen::Index block,
                  std::size_t seen, const std::string& what) {
  constexpr int dim = kTail + tail;
  Belief<Whole> whole{{belief.X.first, {}}, Whole::Covariance::Zero()};
  whole.X.second.x.template head<6 + tail>() = belief.X.second.x;
  whole.P.template topLeftCorner<dim, dim>() = belief.P;
  expect_equal(joint.reference[static_cast<std::size_t>(block)], joint.given(block, seen), whole.X, whole.P, dim, what);
}

// (phi, nu, rho, biases), and c with (phi, nu, rho).
void expect_node(const Joint& joint, const NodeBelief& node, Eigen::Index block, std::size_t seen,
                 const std::string& what) {
  const auto expected = joint.given(block, seen);
  Belief<Whole> whole{{node.belief.X.first, {}}, Whole::Covariance::Zero()};
  whole.X.second.x.head<6>() = node.belief.X.second.x;
  whole.P.topLeftCorner<kTail, kTail>() = node.belief.P;
  expect_equal(joint.reference[static_cast<std::size_t>(block)], expected, whole.X, whole.P, kTail, what);
  Eigen::Matrix<double, 12, 3> G;
  G << node.error.G.phi, node.error.G.nu, node.error.G.rho, node.error.V;
  constexpr int c = kTail + kTailC;
  Eigen::Matrix<double, 12, 3> G_expected;
  G_expected << expected.second.block<9, 3>(0, c), expected.second.block<3, 3>(c, c);
  for (int i = 0; i < 12; ++i) {
    const int row = i < 9 ? i : c + i - 9;
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR(G(i, j), G_expected(i, j),
                  1e-3 * std::sqrt(expected.second(row, row) * expected.second(c + j, c + j)))
          << what << " c with " << i << ", " << j;
  }
  for (int j = 0; j < 3; ++j) {
    const double sigma = std::sqrt(expected.second(c + j, c + j));
    EXPECT_NEAR(node.error.c[j], expected.first[c + j], 2e-3 * sigma) << what << " c " << j;
  }
  // The position in the receiver's datum: rho + S c.
  const Matrix3d S = node.belief.X.first.C.transpose() * node.root;
  Eigen::Matrix<double, 3, kDim> relative = Eigen::Matrix<double, 3, kDim>::Zero();
  relative.middleCols<3>(kRho).setIdentity();
  relative.middleCols<3>(c) = S;
  const Matrix3d P_relative = testing::sandwich(relative, expected.second);
  EXPECT_LT((epoch_of(0.0, node).P_relative - P_relative).norm(), 1e-3 * P_relative.norm()) << what;
}

template <int tail>
void expect_batch_least_squares(bool covariance_reset) {
  SmallFlight flight(some_tail_model(tail == kLongTail), 6.0);
  flight.options.covariance_reset = covariance_reset;
  flight.options.dynamics.noise.gyro_bias_rw = 0.01 * kSmall;
  flight.options.dynamics.noise.accel_bias_rw = 0.05 * kSmall;
  for (int i = 0; i < 4; ++i) flight.add_message(0.305 + 0.45 * i, i % 2 == 0 ? 0.0 : 0.043);
  flight.add(kBarometer, 1.1, kSmall);
  flight.add(kBarometer, 2.0, kSmall);
  flight.add_message(3.4, 0.02, true);  // after a second and a half without: there is a node where nothing is seen
  for (int i = 0; i < 3; ++i) flight.add_message(3.8 + 0.5 * i, 0.01);
  const Joint joint = joint_of(flight);
  const std::size_t all = joint.seen.size();

  const ForwardRun<tail> run =
      run_forward<tail>(flight.data, flight.options, flight.belief<tail>(), cursor_at(flight.data.imu(), 0.0));
  expect_whole<tail>(joint, run.end.belief, joint.blocks() - 1, all, "at the end");
  expect_whole<tail>(joint, smoothed_at_start<tail>(flight.data, flight.options, run), 0, all, "at the start");
  std::size_t seen = 0;
  SmootherSink sink;
  sink.wanted = [](std::size_t) { return false; };
  sink.node = [&](std::size_t, double t_s, const NodeBelief& filtered, const NodeBelief& smoothed) {
    if (t_s == 0.0) return;
    const Joint::Node& node = joint.nodes.at(t_s);
    expect_node(joint, filtered, node.block, node.seen, "filtered at " + std::to_string(t_s));
    expect_node(joint, smoothed, node.block, all, "smoothed at " + std::to_string(t_s));
    ++seen;
  };
  sink.made = sink.take = [](std::size_t) {};
  smooth_run<tail>(flight.data, flight.options, run, sink);
  EXPECT_EQ(seen, joint.nodes.size());
}

TEST(TailSmoother, with_a_short_tail_equals_batch_least_squares) {
  for (const bool reset : {false, true}) expect_batch_least_squares<kShortTail>(reset);
}

TEST(TailSmoother, with_a_long_tail_equals_batch_least_squares) {
  for (const bool reset : {false, true}) expect_batch_least_squares<kLongTail>(reset);
}

// A velocity that comes after the next message's position: its jitter is noise, for the state is another message's.
TEST(TailSmoother, a_message_that_is_overtaken_keeps_its_jitter_in_its_noise) {
  SmallFlight flight(some_tail_model(false), 2.0);
  flight.add_message(0.5, 0.3);
  flight.add_message(0.7, 0.0);
  list_observations(flight.data);
  Belief<LieModel<double, kShortTail>> belief = flight.belief<kShortTail>();
  const Ekf<LieModel<double, kShortTail>> ekf{flight.options.dynamics, true, flight.options.tail};
  ObservationMemory memory;
  NodeChanges<LieModel<double, kShortTail>>* none = nullptr;
  const auto& all = flight.data.observations;
  ASSERT_EQ(all.size(), 4U);
  EXPECT_TRUE(redraw_for(all[0], ekf, flight.options, memory, belief, none));
  EXPECT_TRUE(redraw_for(all[1], ekf, flight.options, memory, belief, none));
  EXPECT_EQ(all[3].record, all[0].record);
  EXPECT_FALSE(redraw_for(all[3], ekf, flight.options, memory, belief, none));
  Ekf<LieModel<double, kShortTail>>::Tall Ht;
  const ImuReading reading{Vector3d(0.1, 0.2, 0.3), Vector3d(1.0, 2.0, -9.0)};
  const Sighting<double> as_state = sight(all[3], flight.options, reading, true, belief, Ht);
  const Vector3d a = Ht.row(kTail + kTailJitter).transpose();
  const Sighting<double> as_noise = sight(all[3], flight.options, reading, false, belief, Ht);
  EXPECT_TRUE(Ht.row(kTail + kTailJitter).isZero(0.0));
  const double variance = flight.options.tail.jitter_s * flight.options.tail.jitter_s;
  EXPECT_LT((as_noise.R - as_state.R - variance * a * a.transpose()).norm(), 1e-12 * as_state.R.norm());
}

// ---- Inside an interval ---------------------------------------------------------------------------------------------

struct AtSample {
  Belief<Core> belief;
  ErrorCorrelation<double> error;
  Matrix3d P_relative, P_rho;
};
using Samples = std::map<std::size_t, AtSample>;

AtSample at_node(const NodeBelief& b) {
  return {b.belief, b.error, epoch_of(0.0, b).P_relative, epoch_of(0.0, b).P_rho};
}

// Both outputs of an interval; they are to agree.
void add_inside(const SampleLanes& samples, const InsideInterval& inside, Samples& to) {
  const NavBelief<Lanes> nav = inside.nav_at(samples);
  const WholeBelief<Lanes> all = inside.at(samples);
  for (int i = 0; i < samples.count; ++i) {
    const NavRows<Lanes, 3>& G = all.error.G;
    const NodeBelief one{lane(all.belief, i),
                         {{lane(G.phi, i), lane(G.nu, i), lane(G.rho, i)}, lane(all.error.V, i), lane(all.error.c, i)},
                         inside.root()};
    const AtSample of_whole = at_node(one);
    // Sums in another order, of terms that cancel to a part in a hundred million.
    EXPECT_LT((of_whole.P_relative - lane(nav.P_relative, i)).norm(), 1e-5 * of_whole.P_relative.norm());
    EXPECT_LT((of_whole.P_rho - lane(nav.P_rho, i)).norm(), 1e-5 * of_whole.P_rho.norm());
    EXPECT_EQ(one.error.c, lane(nav.c, i));
    to[samples.k[static_cast<std::size_t>(i)]] = of_whole;
  }
}

struct Trajectories {
  Samples filtered, smoothed;
};

template <int tail>
Trajectories trajectories(const SmallFlight& flight, const std::function<bool(std::size_t)>& wanted) {
  Trajectories out;
  FilterSink filter;
  filter.wanted = wanted;
  filter.epoch = [&](std::size_t k, const NodeBelief& b) { out.filtered[k] = at_node(b); };
  filter.inside = [&](const SampleLanes& samples, const InsideInterval& in) { add_inside(samples, in, out.filtered); };
  const ForwardRun<tail> run =
      run_forward<tail>(flight.data, flight.options, flight.belief<tail>(), cursor_at(flight.data.imu(), 0.0), filter);
  std::vector<Samples> parts(64);
  SmootherSink sink;
  sink.wanted = wanted;
  sink.node = [](std::size_t, double, const NodeBelief&, const NodeBelief&) {};
  sink.epoch = [&](std::size_t slot, std::size_t k, const NodeBelief& b) { parts.at(slot)[k] = at_node(b); };
  sink.inside = [&](std::size_t slot, const SampleLanes& samples, const InsideInterval& in) {
    add_inside(samples, in, parts.at(slot));
  };
  sink.made = [](std::size_t) {};
  sink.take = [&](std::size_t slot) {
    out.smoothed.merge(parts[slot]);
    parts[slot].clear();
  };
  smooth_run<tail>(flight.data, flight.options, run, sink);
  return out;
}

void expect_same(const AtSample& a, const AtSample& b, double tolerance, const std::string& what) {
  const Core::Tangent sigma = b.belief.P.diagonal().cwiseSqrt();
  // A node more cuts the intervals elsewhere, and with them where gravitation and biases are held: part of a hundredth of sigma.
  EXPECT_LT(Core::local(b.belief.X, a.belief.X).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 50.0 * tolerance) << what;
  EXPECT_LT((a.belief.P - b.belief.P).cwiseQuotient(sigma * sigma.transpose()).cwiseAbs().maxCoeff(), tolerance)
      << what;
  EXPECT_LT((a.P_relative - b.P_relative).norm(), tolerance * b.P_relative.norm()) << what;
  const Vector3d sigma_c = b.error.V.diagonal().cwiseSqrt();
  const auto close = [&](const Matrix3d& of_a, const Matrix3d& of_b, const Vector3d& rows) {
    return (of_a - of_b).cwiseQuotient(rows * sigma_c.transpose()).cwiseAbs().maxCoeff() < tolerance;
  };
  EXPECT_TRUE(close(a.error.G.phi, b.error.G.phi, sigma.segment<3>(kPhi))) << what;
  EXPECT_TRUE(close(a.error.G.nu, b.error.G.nu, sigma.segment<3>(kNu))) << what;
  EXPECT_TRUE(close(a.error.G.rho, b.error.G.rho, sigma.segment<3>(kRho))) << what;
  EXPECT_TRUE(close(a.error.V, b.error.V, sigma_c)) << what;
  EXPECT_LT((a.error.c - b.error.c).cwiseQuotient(sigma_c).cwiseAbs().maxCoeff(), 50.0 * tolerance) << what;
}

// Fixes for three seconds, none for twenty, and fixes again. The biases do not walk: their steps come at the ends of intervals.
template <int tail>
SmallFlight with_outage() {
  SmallFlight flight(some_tail_model(tail == kLongTail), 27.0);
  for (int i = 0; i < 4; ++i) flight.add_message(0.305 + 0.9 * i, 0.0);
  for (int i = 0; i < 4; ++i) flight.add_message(23.0 + 0.9 * i, 0.0);
  joint_of(flight);  // draws what is seen
  return flight;
}

template <int tail>
void expect_a_node_changes_nothing() {
  const SmallFlight flight = with_outage<tail>();
  const std::vector<std::size_t> where = {60, 118, 260, 338, 866, 1500, 2250, 2350, 2500};
  const auto wanted = [&](std::size_t k) { return std::find(where.begin(), where.end(), k) != where.end(); };
  const Trajectories inside = trajectories<tail>(flight, wanted);
  ASSERT_EQ(inside.filtered.size(), where.size());
  ASSERT_EQ(inside.smoothed.size(), where.size());
  for (const std::size_t k : where) {
    SmallFlight with = flight;
    Observation nothing;
    nothing.kind = &kZeroVelocity;
    nothing.t_s = flight.data.imu()[k].t_s;
    nothing.R = 1e14 * Matrix3d::Identity();
    with.data.observations.push_back(nothing);
    sort_observations(with.data.imu(), with.data.observations);
    const Trajectories node = trajectories<tail>(with, wanted);
    const std::string what = " at " + std::to_string(nothing.t_s) + " s";
    // An interval that is cut elsewhere has its gravitation and the gradient of it at other times.
    expect_same(inside.filtered.at(k), node.filtered.at(k), 1e-4, "filtered" + what);
    expect_same(inside.smoothed.at(k), node.smoothed.at(k), 1e-4, "smoothed" + what);
  }
}

TEST(TailSmoother, inside_an_interval_of_a_short_tail_stands_what_a_node_there_has) {
  expect_a_node_changes_nothing<kShortTail>();
}
TEST(TailSmoother, inside_an_interval_of_a_long_tail_stands_what_a_node_there_has) {
  expect_a_node_changes_nothing<kLongTail>();
}

// The receiver's error is common to neighbouring fixes: in its datum a position is better than on the Earth.
TEST(TailSmoother, in_the_datum_of_the_receiver_a_position_is_sharper_among_fixes) {
  SmallFlight flight = with_outage<kShortTail>();
  flight.options.tail.sigma_c = 3.0;
  flight.options.tail.tau_c_s = 200.0;
  flight.start.P.block<3, 3>(kRho, kRho) *= 100.0;
  const Trajectories all = trajectories<kShortTail>(flight, [](std::size_t k) { return k == 220 || k == 300; });
  for (const std::size_t k : {220U, 300U}) {
    const AtSample& at = all.smoothed.at(k);
    EXPECT_LT(at.P_relative.trace(), 0.2 * at.P_rho.trace());
  }
}

// ---- A tail of zeros ------------------------------------------------------------------------------------------------

TEST(TailSmoother, a_tail_of_zeros_is_none) {
  SmallFlight flight({}, 27.0);
  for (int i = 0; i < 4; ++i) flight.add_message(0.305 + 0.9 * i, 0.02);
  for (int i = 0; i < 4; ++i) flight.add_message(23.0 + 0.9 * i, 0.0, i == 2);
  joint_of(flight);
  ASSERT_TRUE(flight.options.tail.is_empty());
  flight.options.covariance_reset = false;  // with a tail states retract straight, which is another second order
  const auto wanted = [](std::size_t k) { return k % 13 == 0; };
  const Trajectories none = trajectories<kNoTail>(flight, wanted), zeros = trajectories<kShortTail>(flight, wanted);
  const std::pair<const Samples*, const Samples*> pairs[] = {{&none.filtered, &zeros.filtered},
                                                             {&none.smoothed, &zeros.smoothed}};
  for (const auto& [a, b] : pairs) {
    ASSERT_EQ(a->size(), b->size());
    for (const auto& [k, of_none] : *a) {
      const AtSample& of_zeros = b->at(k);
      const Core::Tangent sigma = of_none.belief.P.diagonal().cwiseSqrt();
      EXPECT_GT(of_zeros.belief.P.diagonal().minCoeff(), 0.0) << k;
      EXPECT_GT(of_zeros.P_relative.diagonal().minCoeff(), 0.0) << k;
      // What the first fix after an outage corrects is bent by the one retraction and not by the other, and reaches back.
      if (k >= 400) continue;
      EXPECT_LT((of_zeros.belief.P - of_none.belief.P).cwiseQuotient(sigma * sigma.transpose()).cwiseAbs().maxCoeff(),
                1e-5)
          << k;
      // ECEF metres carry 1e-9, part of a tenth of these sigmas.
      EXPECT_LT(Core::local(of_none.belief.X, of_zeros.belief.X).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 0.05) << k;
      EXPECT_LT((of_zeros.P_relative - of_none.P_rho).norm(), 1e-5 * of_none.P_rho.norm()) << k;
    }
  }
}

}  // namespace
}  // namespace liealign
