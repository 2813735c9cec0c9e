// liealign-kernels: what one call of each part of the engine costs.
//
// Inputs come from a simulated drone flight, so that rates, forces and covariances are those of real work; each call starts
// from the same state, so that nothing runs away.
// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include "liealign/core/units.hpp"
#include "liealign/estimate/inside_interval.hpp"
#include "liealign/estimate/smoother.hpp"
#include "liealign/estimate/solution.hpp"
#include "liealign/observe/kinds.hpp"
#include "liealign/pipeline/settings.hpp"
#include "liealign/pipeline/simulated_flight.hpp"
#include "liealign/pipeline/trajectory_files.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;

// A flight under way: its data, and a belief after two minutes with everything that comes next.
struct Scene {
  PreparedFlight flight;
  FilterOptions filter;
  Ekf<Model> ekf;
  Belief<Model> belief;       // after a fix
  Belief<Model> at_fix;       // before one
  ImuCursor cursor;           // where `belief` stands
  ImuSample sample;           // the next one
  double dt = 0.0;            // of it, s
  Observation fix;            // of `at_fix`, its position
  ImuReading reading;         // at its time
  Preintegrated<double> pre;  // the second that follows `belief`
  Vector<double, 6> b_0;
};

Belief<Model> start_of(const AlignmentProblem& problem, const FilterOptions& filter) {
  return belief_at_rest(problem.rest, 137.0 * kDegToRad, 0.0, problem.initial, problem.data.l_ba_b,
                        filter.dynamics.gravity);
}

Scene make_scene(double gnss_rate_hz) {
  DroneFlight drone;
  GnssErrors gnss;
  gnss.rate_hz = gnss_rate_hz;
  gnss.l_ba_b = Vector3d(0.1, -0.05, -0.3);
  Scene s;
  ImuErrorSizes imu;
  imu.turn_on = "fixed";
  s.flight = prepare_flight(simulate_flight(drone, gnss, Config{}, 1, imu).flight);
  const AlignmentProblem& problem = s.flight.problem;
  const FlightData& data = problem.data;
  s.filter = s.flight.filter;
  s.ekf = {s.filter.dynamics, s.filter.covariance_reset, s.filter.tail};
  s.belief = start_of(problem, s.filter);
  SilentVisitor<Model> silent;
  const double middle = data.imu().front().t_s + 120.0;
  s.cursor = forward_pass(data, s.filter, s.belief, cursor_at(data.imu(), s.flight.t_begin_s), middle, silent);
  s.sample = data.imu()[s.cursor.k];
  s.dt = s.sample.t_s - s.cursor.t_s;
  s.at_fix = s.belief;
  for (const Observation& o : data.observations) {
    if (o.t_s <= s.cursor.t_s || o.kind != &kGnssPosition) continue;
    s.fix = o;
    break;
  }
  ImuCursor cursor = s.cursor;
  propagate_to(s.ekf, data.imu(), s.fix.t_s, cursor, s.at_fix, silent);
  s.reading = reading_at(data.imu(), cursor);
  s.b_0 = s.belief.X.second.x;
  const auto nothing_inside = [](std::size_t, const Preintegrated<double>&) {};
  cursor = s.cursor;
  s.pre = preintegrate_to(s.fix.t_s, data.imu(), s.b_0, s.filter.dynamics.noise, cursor, nothing_inside);
  return s;
}

const Scene& scene() {
  static const Scene s = make_scene(1.0);
  return s;
}

const Scene& scene_10_hz() {
  static const Scene s = make_scene(10.0);
  return s;
}

// ---- Group ----------------------------------------------------------------------------------------------------------

void so3_exp(benchmark::State& state) {
  Vector3d phi(1e-3, -2e-3, 3e-3);
  for (auto _ : state) {
    benchmark::DoNotOptimize(phi);
    Matrix3d C = gamma<0>(phi);
    benchmark::DoNotOptimize(C);
  }
}
BENCHMARK(so3_exp);

void gamma_0_1_2(benchmark::State& state) {
  Vector3d phi(1e-3, -2e-3, 3e-3);
  for (auto _ : state) {
    benchmark::DoNotOptimize(phi);
    const ExpCoefficients<double> a = exp_coefficients<double>(phi.squaredNorm());
    Matrix3d G0 = gamma<0>(phi, a), G1 = gamma<1>(phi, a), G2 = gamma<2>(phi, a);
    benchmark::DoNotOptimize(G0);
    benchmark::DoNotOptimize(G1);
    benchmark::DoNotOptimize(G2);
  }
}
BENCHMARK(gamma_0_1_2);

void se23_exp(benchmark::State& state) {
  SE23<double>::Tangent eps;
  eps << 1e-3, -2e-3, 3e-3, 0.1, 0.2, -0.1, 0.01, 0.02, 0.03;
  for (auto _ : state) {
    benchmark::DoNotOptimize(eps);
    SE23<double> X = SE23<double>::exp(eps);
    benchmark::DoNotOptimize(X);
  }
}
BENCHMARK(se23_exp);

void right_jacobian_15(benchmark::State& state) {
  Model::Tangent eps = Model::Tangent::Constant(1e-3);
  for (auto _ : state) {
    benchmark::DoNotOptimize(eps);
    Model::Covariance J = Model::right_jacobian(eps);
    benchmark::DoNotOptimize(J);
  }
}
BENCHMARK(right_jacobian_15);

// ---- Filter and smoother --------------------------------------------------------------------------------------------

void mechanize(benchmark::State& state) {
  const Scene& s = scene();
  for (auto _ : state) {
    SE23<double> X = s.belief.X.first;
    const ImuInput<double> u{s.sample.omega_ib_b, s.sample.f_ib_b, s.dt};
    X = mechanize_exact(X, u, detail::exact_step(X, u, s.filter.dynamics.gravity));
    benchmark::DoNotOptimize(X);
  }
}
BENCHMARK(mechanize);

void predict_full_rate(benchmark::State& state) {
  const Scene& s = scene();
  for (auto _ : state) {
    Belief<Model> belief = s.belief;
    NavTransition<double> t = s.ekf.predict(belief, s.sample, s.dt);
    benchmark::DoNotOptimize(t);
    benchmark::DoNotOptimize(belief);
  }
}
BENCHMARK(predict_full_rate);

void preintegrate_one_sample(benchmark::State& state) {
  const Scene& s = scene();
  const ImuInput<double> u{s.sample.omega_ib_b - s.b_0.tail<3>(), s.sample.f_ib_b - s.b_0.head<3>(), s.dt};
  const WhiteDensity white = white_density(s.filter.dynamics.noise, 0.0);
  const Preintegrated<double> begin = s.pre;
  for (auto _ : state) {
    Preintegrated<double> pre = begin;
    pre.append(u, white.accel * s.dt, white.gyro * s.dt);
    benchmark::DoNotOptimize(pre);
  }
}
BENCHMARK(preintegrate_one_sample);

// The same belief, alone or in every lane.
void set_all(Belief<Model>& to, const Belief<Model>& belief) { to = belief; }
void set_all(Belief<LieModel<Lanes>>& to, const Belief<Model>& belief) {
  for (int i = 0; i < Lanes::kCount; ++i) set_lane(to, i, belief);
}

template <typename Scalar>
void predict_interval(benchmark::State& state) {
  const Scene& s = scene();
  const Ekf<LieModel<Scalar>> ekf{s.filter.dynamics, s.filter.covariance_reset};
  Belief<LieModel<Scalar>> begin;
  set_all(begin, s.belief);
  for (auto _ : state) {
    Belief<LieModel<Scalar>> belief = begin;
    ekf.predict(belief, s.pre.cast<Scalar>(), s.b_0.cast<Scalar>());
    benchmark::DoNotOptimize(belief);
  }
}
BENCHMARK(predict_interval<double>)->Name("predict_interval");
BENCHMARK(predict_interval<Lanes>)->Name("predict_interval/lanes");

template <typename Scalar>
void update_position(benchmark::State& state) {
  const Scene& s = scene();
  const Ekf<LieModel<Scalar>> ekf{s.filter.dynamics, s.filter.covariance_reset, s.filter.tail};
  Belief<LieModel<Scalar>> begin;
  set_all(begin, s.at_fix);
  for (auto _ : state) {
    Belief<LieModel<Scalar>> belief = begin;
    ObservationMemory memory;
    NodeChanges<LieModel<Scalar>>* nothing_kept = nullptr;
    Innovation<Scalar> innovation = update(s.fix, ekf, s.filter, s.reading, memory, belief, nothing_kept);
    benchmark::DoNotOptimize(innovation);
    benchmark::DoNotOptimize(belief);
  }
}
BENCHMARK(update_position<double>)->Name("update_position");
BENCHMARK(update_position<Lanes>)->Name("update_position/lanes");

// What a smoothed second starts from: its samples, and what the next fix says at its end.
struct Second {
  IntervalStep<kNoTail> step;
  Adjoint<Model> at_end, adjoint;
  NodeChanges<Model> changes;  // by the fix
};

void back_over_interval(const Second& s, Adjoint<Model>& adjoint) {
  adjoint.back_through(s.changes, true);
  adjoint.back_over(interval_transition(StartAxes<double>(s.step.before.X.first, s.step.pre.T),
                                        SE23<double>{s.step.pre.dC, s.step.pre.dv, s.step.pre.dp}, s.step.pre),
                    tail_step({}, s.step.pre.T));
}

const Second& second() {
  static const Second one = [] {
    const Scene& s = scene();
    Second made;
    made.step.before = s.belief;
    made.step.pre = s.pre;
    Belief<Model> end = s.belief;
    made.step.pull = s.ekf.predict(end, s.pre, s.b_0);
    ObservationMemory memory;
    update(s.fix, s.ekf, s.filter, s.reading, memory, end, &made.changes);
    made.at_end.back_through(made.changes, true);
    back_over_interval(made, made.adjoint);
    return made;
  }();
  return one;
}

// One step of the smoother sample by sample, that is without the forward step it belongs to.
void smoother_step_plain(benchmark::State& state) {
  const Scene& s = scene();
  Belief<Model> predicted = s.belief;
  const NavTransition<double> t = s.ekf.predict(predicted, s.sample, s.dt);
  const TailStep no_tail = tail_step({}, s.dt);
  for (auto _ : state) {
    Adjoint<Model> adjoint = second().at_end;
    adjoint.back_over(t, no_tail);
    Belief<Model> smoothed = adjoint.smoothed(s.belief, true);
    benchmark::DoNotOptimize(smoothed);
  }
}
BENCHMARK(smoother_step_plain);

// Back through a fix and over the whole interval before it.
void smoother_step_interval(benchmark::State& state) {
  const Second& s = second();
  for (auto _ : state) {
    Adjoint<Model> adjoint;
    back_over_interval(s, adjoint);
    Belief<Model> smoothed = adjoint.smoothed(s.step.before, true);
    benchmark::DoNotOptimize(smoothed);
  }
}
BENCHMARK(smoother_step_interval);

// State and covariance at samples inside it, four at a time.
void epochs_inside(benchmark::State& state, bool smoothed) {
  const Second& s = second();
  const InsideInterval inside(AtStart<kNoTail>{s.step, smoothed ? &s.adjoint : nullptr}, scene().filter);
  for (auto _ : state) {
    SampleLanes samples;
    for (std::size_t k = 0; k < Lanes::kCount; ++k) samples.add(k, s.step.pre);
    NavBelief<Lanes> belief = inside.nav_at(samples);
    benchmark::DoNotOptimize(belief);
  }
  state.counters["epochs"] = Lanes::kCount;
}
BENCHMARK_CAPTURE(epochs_inside, filter, false);
BENCHMARK_CAPTURE(epochs_inside, smoother, true);

// ---- Output ---------------------------------------------------------------------------------------------------------

void output_row(benchmark::State& state) {
  const Epoch epoch = epoch_of(scene().cursor.t_s, node_belief<kNoTail>(scene().belief, Matrix3d::Zero()));
  for (auto _ : state) {
    NavRow row = nav_row(epoch);
    benchmark::DoNotOptimize(row);
  }
}
BENCHMARK(output_row);

// Rows of trajectory.csv with their output_row, and the same as SBET with SMRMSG.
void trajectory_row(benchmark::State& state, const TrajectoryText& wanted) {
  constexpr std::size_t kRows = 1000;
  const std::vector<Epoch> epochs(kRows,
                                  epoch_of(scene().sample.t_s, node_belief<kNoTail>(scene().belief, Matrix3d::Zero())));
  for (auto _ : state) {
    TrajectoryPart part;
    append_epochs(part, wanted, scene().flight, epochs, true);
    benchmark::DoNotOptimize(part);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kRows));
}
BENCHMARK_CAPTURE(trajectory_row, csv, TrajectoryText{.csv = true});
BENCHMARK_CAPTURE(trajectory_row, sbet, TrajectoryText{.sbet = true});

// ---- One candidate over the whole flight ----------------------------------------------------------------------------

void candidate(benchmark::State& state, const Scene& (*of)(), bool intervals) {
  AlignmentProblem problem = of().flight.problem;
  if (!intervals) problem.intervals = {};
  const std::vector<HeadingCandidate> one(1, {137.0 * kDegToRad, 0.0, false, {}});
  for (auto _ : state) benchmark::DoNotOptimize(evaluate_candidates(problem, one));
  state.counters["epochs"] = static_cast<double>(problem.data.imu().size());
}
BENCHMARK_CAPTURE(candidate, 1_hz_by_samples, &scene, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(candidate, 1_hz_by_intervals, &scene, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(candidate, 10_hz_by_samples, &scene_10_hz, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(candidate, 10_hz_by_intervals, &scene_10_hz, true)->Unit(benchmark::kMillisecond);

// Their shared intervals.
void preintegrate_flight(benchmark::State& state) {
  AlignmentProblem problem = scene().flight.problem;
  for (auto _ : state) preintegrate(problem);
  state.counters["epochs"] = static_cast<double>(problem.data.imu().size());
}
BENCHMARK(preintegrate_flight)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace liealign

BENCHMARK_MAIN();
