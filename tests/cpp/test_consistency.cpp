// Consistency of filter and smoother over many simulated flights: NEES with the truth drawn from the filter's own model,
// the smoother against the filter, the alignment from any heading, and the same bits for any number of threads.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "flights.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/filter_steps.hpp"
#include "liealign/estimate/smoother.hpp"
#include "liealign/lie/gaussian.hpp"
#include "liealign/pipeline/process.hpp"
#include "liealign/pipeline/settings.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;
constexpr int kSeeds = 50;

using testing::align;
using testing::short_flight;
using testing::table_1_flight;
using testing::true_heading;

// TAES P_0 about NED for the attitude.
Model::Covariance initial_covariance(const SE23<double>& X) {
  const Matrix3d C_b_n = C_n_e(X.p).transpose() * X.C;
  const double tilt = kDegToRad / 3, heading = 5 * kDegToRad / 3;
  Vector<double, 15> s;
  s << Vector3d::Zero(), Vector3d::Constant(0.001 / 3), Vector3d::Constant(0.1 / 3),
      Vector3d::Constant(kMilliGToMps2 / 3), Vector3d::Constant(15 * kDegPerHourToRadPerSecond / 3);
  Model::Covariance P = s.cwiseAbs2().asDiagonal();
  P.block<3, 3>(kPhi, kPhi) =
      C_b_n.transpose() * Vector3d(tilt * tilt, tilt * tilt, heading * heading).asDiagonal() * C_b_n;
  return P;
}

struct Keeper : SilentVisitor<Model> {
  static constexpr bool keeps_changes = true;
  std::vector<Checkpoint<Model>> checkpoints;
  double nis = 0;
  int fixes = 0;
  void updated(const Observation&, const Innovation<double>& i) {
    nis += i.nis;
    ++fixes;
  }
  void node(std::size_t, const Belief<Model>& b, const ImuCursor& c, const NodeChanges<Model>& changes) {
    checkpoints.push_back({b, c, changes});
  }
};

struct MatchedRun {
  std::vector<double> nees_filter, nees_smoother;  // one per 10 s
  Vector<double, 15> squares_filter = Vector<double, 15>::Zero(), squares_smoother = Vector<double, 15>::Zero();
  double nis = 0;
  int fixes = 0;
};

MatchedRun matched_run(const Truth& truth, std::uint64_t seed) {
  const Config config;
  FilterOptions options = filter_options(config);
  options.gate.outliers = Outliers::off;
  Random random(seed, 99);
  // Truth of the biases and of the initial error from the filter's own model.
  const Model::Covariance P_0 = initial_covariance(truth.epochs[0].X);
  Vector<double, 15> unit;
  for (int i = 0; i < 15; ++i) unit[i] = random.normal();
  NavState<double> X_true{truth.epochs[0].X, {}};
  const NavState<double> drawn = sample_concentrated_gaussian(NavState<double>{}, P_0, unit);
  // X_true = X_hat exp(eps)  =>  X_hat = X_true exp(eps)^-1, and the biases of the truth are eps's.
  NavState<double> X_hat = X_true * drawn.inverse();
  X_true.second = drawn.second;
  X_hat.second.x.setZero();

  ImuErrors errors;
  errors.noise = imu_noise(config);
  errors.b_a_turn_on = b_a(X_true);
  errors.b_g_turn_on = b_g(X_true);
  const SimulatedImu imu = add_imu_errors(truth.imu, errors, seed);
  GnssErrors gnss;
  gnss.l_ba_b = Vector3d(0.1, -0.05, -0.3);
  FlightData data;
  data.samples = std::make_shared<const ImuSeries>(imu.log);
  data.l_ba_b = gnss.l_ba_b;
  for (const GnssRecord& r : simulate_gnss(truth, gnss, seed)) {
    const Matrix3d C = C_n_e(r.lat_rad, r.lon_rad);
    GnssFix fix;
    fix.t_s = r.t_s;
    fix.p_ea_e = ecef_from_geodetic({r.lat_rad, r.lon_rad, r.height_m});
    fix.R_p_e = C * r.P_n_m2 * C.transpose();
    data.fixes.push_back(fix);
  }
  list_observations(data);

  Belief<Model> belief{X_hat, P_0};
  const ImuCursor start = cursor_at(data.imu(), data.imu().front().t_s);
  Keeper keeper;
  keeper.checkpoints.push_back({belief, start, {}});
  forward_pass(data, options, belief, start, data.imu().back().t_s, keeper);

  MatchedRun run;
  run.nis = keeper.nis;
  run.fixes = keeper.fixes;
  const auto nees = [&](std::size_t k, const Belief<Model>& b, Vector<double, 15>& squares) {
    NavState<double> X{truth.epochs[k].X, {}};
    X.second.x << imu.b_a[k], imu.b_g[k];
    const Vector<double, 15> e = Model::local(b.X, X);
    squares += e.cwiseAbs2();
    return e.dot(b.P.ldlt().solve(e));
  };
  const auto wanted = [&](const ImuCursor& at) {
    const double t = at.t_s - truth.epochs[0].t_s;
    return std::abs(std::remainder(t, 10.0)) < 1e-6 && t > 1.0 && data.imu()[at.k - 1].t_s == at.t_s;
  };
  smooth(
      Ekf<Model>{options.dynamics, true}, data, keeper.checkpoints, kEverySample,
      [](std::size_t, const Belief<Model>&) {},
      [&](std::size_t i, const Belief<Model>& smoothed) {
        const ImuCursor& at = keeper.checkpoints[i].cursor;
        if (!wanted(at)) return;
        run.nees_filter.push_back(nees(at.k - 1, keeper.checkpoints[i].updated, run.squares_filter));
        run.nees_smoother.push_back(nees(at.k - 1, smoothed, run.squares_smoother));
      });
  return run;
}

TEST(Consistency, nees_of_filter_and_smoother_and_nis_lie_in_their_bands) {
  const Truth truth = drone_truth(short_flight(), Mechanization::exact, GravityModel::normal);
  std::vector<MatchedRun> runs(kSeeds);
#pragma omp parallel for schedule(dynamic, 1)
  for (int s = 0; s < kSeeds; ++s)
    runs[static_cast<std::size_t>(s)] = matched_run(truth, static_cast<std::uint64_t>(s + 1));
  double filter = 0, smoother = 0, nis = 0;
  Vector<double, 15> squares_filter = Vector<double, 15>::Zero(), squares_smoother = Vector<double, 15>::Zero();
  std::size_t n = 0;
  int fixes = 0;
  for (const MatchedRun& r : runs) {
    ASSERT_GE(r.nees_filter.size(), 10u);
    for (std::size_t i = 0; i < r.nees_filter.size(); ++i) {
      filter += r.nees_filter[i];
      smoother += r.nees_smoother[i];
      ++n;
    }
    squares_filter += r.squares_filter;
    squares_smoother += r.squares_smoother;
    nis += r.nis;
    fixes += r.fixes;
  }
  filter /= static_cast<double>(n);
  smoother /= static_cast<double>(n);
  nis /= fixes;
  // 99 % band of the mean over seeds of one epoch; epochs of one flight are correlated, so that averaging over them as well
  // is not counted as gain. 15 degrees of freedom, variance 30.
  const double band = 2.5758 * std::sqrt(2.0 * 15 / kSeeds);
  RecordProperty("nees_filter", std::to_string(filter));
  RecordProperty("nees_smoother", std::to_string(smoother));
  RecordProperty("nis", std::to_string(nis));
  std::printf("NEES filter %.3f smoother %.3f (15 +- %.2f), NIS %.4f (3 +- %.3f)\n", filter, smoother, band, nis,
              2.5758 * std::sqrt(6.0 / fixes));
  EXPECT_NEAR(filter, 15.0, band);
  EXPECT_NEAR(smoother, 15.0, band);
  for (int i = 0; i < 15; ++i) EXPECT_LT(squares_smoother[i], squares_filter[i]) << "state " << i;
  EXPECT_NEAR(nis, 3.0, 2.5758 * std::sqrt(6.0 / fixes));  // innovations are white: here the number counts
}

// Metre-sized outliers, small enough for an open filter to follow, feign a heading 50 deg away on the first of these flights.
TEST(Alignment, is_not_led_astray_by_outliers) {
  struct Trial {
    FlightKind kind;
    std::uint64_t seed;
    double share;
    const char* outlier;
  };
  for (const Trial& trial :
       {Trial{FlightKind::helical, 3, 0.05, "weight"}, Trial{FlightKind::circles, 2, 0.1, "reject"}}) {
    DroneFlight drone = random_flight(trial.kind, false, trial.seed);
    drone.duration_s = 300;
    drone.oversample = 4;
    GnssErrors gnss;
    gnss.l_ba_b = Vector3d(0.1, -0.05, -0.3);
    gnss.outlier_probability = trial.share;
    gnss.outlier_m = 1.0;
    Config config = testing::with_given_parameters({});
    config.gnss.outlier = trial.outlier;
    const SimulatedFlight s = simulate_flight(drone, gnss, config, trial.seed);
    const PreparedFlight prepared = prepare_flight(s.flight);
    const HeadingResult found = align(prepared);
    const double error = wrap_pi(found.heading_rad - true_heading(s, prepared.problem.t_start_s));
    ASSERT_TRUE(found.sigma_rad);
    EXPECT_LT(std::abs(error), 4.0 * *found.sigma_rad) << trial.seed;
    EXPECT_LT(*found.sigma_rad, 0.1 * kDegToRad);
    EXPECT_EQ(found.verdict, "aligned");
  }
}

TEST(Alignment, finds_any_heading_within_a_tenth_of_a_degree_after_60_s_of_flight) {
  const int n = 24;
  std::vector<double> errors(n), sigmas(n);
  std::vector<std::string> verdicts(n);
#pragma omp parallel for schedule(dynamic, 1)
  for (int i = 0; i < n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    Config config;
    config.align.max_time_s = 60;
    if (i % 3 == 1) config.align.heading_guess_deg = 15.0 * i + 20.0;  // 20 deg off, and its std
    const SimulatedFlight s = table_1_flight(15.0 * i, static_cast<std::uint64_t>(i + 1), config);
    const PreparedFlight prepared = prepare_flight(s.flight);
    const HeadingResult r = align(prepared);
    errors[k] = wrap_pi(r.heading_rad - true_heading(s, prepared.problem.t_start_s)) * kRadToDeg;
    sigmas[k] = r.sigma_rad.value_or(1.0) * kRadToDeg;
    verdicts[k] = r.verdict;
  }
  double squares = 0, normalised = 0;
  for (int i = 0; i < n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    EXPECT_LT(std::abs(errors[k]), 0.1) << "heading " << 15 * i;
    EXPECT_EQ(verdicts[k], "aligned");
    squares += errors[k] * errors[k] / n;
    normalised += errors[k] * errors[k] / (sigmas[k] * sigmas[k]);
  }
  std::printf("heading error %.4f deg rms, chi-square %.1f of %d\n", std::sqrt(squares), normalised, n);
  // Stated sigmas are true: 99.8 % interval of chi-square with 24 degrees of freedom.
  EXPECT_LT(normalised, 51.2);
  EXPECT_GT(normalised, 8.1);
}

// Errors of a trajectory against truth, one number per channel: roll, pitch, heading, vn, ve, vd, n, e, d.
std::array<double, 9> squares_of(const std::vector<Epoch>& epochs, const Truth& truth, double from) {
  std::array<double, 9> sum{};
  double n = 0;
  for (std::size_t i = 0; i < epochs.size(); i += 5) {
    if (epochs[i].t_s < from) continue;
    const SE23<double> X = truth_at(truth, epochs[i].t_s);
    const Matrix3d C_e_n = C_n_e(X.p).transpose();
    const Vector3d rpy = rpy_from_C_b_n(C_e_n * epochs[i].X.first.C) - rpy_from_C_b_n(C_e_n * X.C);
    const Vector3d v = C_e_n * (epochs[i].X.first.v - X.v), p = C_e_n * (epochs[i].X.first.p - X.p);
    for (std::size_t c = 0; c < 3; ++c) {
      const Eigen::Index j = static_cast<Eigen::Index>(c);
      sum[c] += std::pow(wrap_pi(rpy[j]), 2);
      sum[3 + c] += v[j] * v[j];
      sum[6 + c] += p[j] * p[j];
    }
    n += 1;
  }
  for (double& s : sum) s /= n;
  return sum;
}

TEST(Smoother, is_better_than_the_filter_on_every_channel_over_the_seeds) {
  std::vector<std::array<double, 9>> filter(kSeeds), smoother(kSeeds);
#pragma omp parallel for schedule(dynamic, 1)
  for (int s = 0; s < kSeeds; ++s) {
    const std::size_t k = static_cast<std::size_t>(s);
    Config config;
    config.output.filtered = true;
    config.align.heading_guess_deg = 137.0 + 0.3 * (s - 25);
    config.align.heading_guess_std_deg = 10.0;
    const SimulatedFlight simulated = table_1_flight(137.0, static_cast<std::uint64_t>(s + 101), config);
    const PreparedFlight prepared = prepare_flight(simulated.flight);
    const Solution solution = process(prepared, align(prepared));
    filter[k] = squares_of(solution.filtered, simulated.truth, prepared.problem.t_start_s);
    smoother[k] = squares_of(solution.smoothed, simulated.truth, prepared.problem.t_start_s);
  }
  const char* names[] = {"roll", "pitch", "heading", "vn", "ve", "vd", "north", "east", "down"};
  for (std::size_t c = 0; c < 9; ++c) {
    double f = 0, s = 0;
    for (std::size_t k = 0; k < kSeeds; ++k) {
      f += filter[k][c] / kSeeds;
      s += smoother[k][c] / kSeeds;
    }
    const double unit = c < 3 ? kRadToDeg : 1.0;
    std::printf("%-8s filter %.5f smoother %.5f %s\n", names[c], std::sqrt(f) * unit, std::sqrt(s) * unit,
                c < 3   ? "deg"
                : c < 6 ? "m/s"
                        : "m");
    EXPECT_LT(s, f) << names[c];
  }
}

TEST(Determinism, the_same_bits_come_out_for_any_number_of_threads) {
#ifndef _OPENMP
  GTEST_SKIP() << "built without OpenMP";
#else
  Config config;
  config.align.max_time_s = 20;
  const SimulatedFlight s = table_1_flight(40.0, 5, config);
  const PreparedFlight prepared = prepare_flight(s.flight);
  std::vector<HeadingCandidate> candidates;
  for (int i = 0; i < 12; ++i) candidates.push_back({0.5 * i, i % 2 ? 0.2 : 0.0, false, {}});
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const std::vector<CandidateScore> one = evaluate_candidates(prepared.problem, candidates);
  omp_set_num_threads(5);
  const std::vector<CandidateScore> five = evaluate_candidates(prepared.problem, candidates);
  omp_set_num_threads(before);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    EXPECT_EQ(one[i].cost, five[i].cost);
    EXPECT_EQ(one[i].p_rms_m, five[i].p_rms_m);
  }
#endif
}

}  // namespace
}  // namespace liealign
