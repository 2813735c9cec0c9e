// Monte Carlo studies: the errors are those of the estimates, whoever makes the runs; bound and NEES are what they say.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "flights.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/smoother.hpp"
#include "liealign/study/monte_carlo.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;

// In the order of kStudyChannels.
enum Channel : std::size_t { kRoll, kPitch, kHeading, kLongitude, kLatitude, kAltitude, kPosition, kVelocity };

StudyCase short_case(const std::string& start) {
  StudyCase study;
  study.flight = testing::short_flight();
  study.flight.duration_s = 90;
  if (start == "aligned") study.flight.oversample = 4;
  study.gnss.l_ba_b = Vector3d(0.1, -0.05, -0.3);
  study.config = testing::with_given_parameters({});
  study.config.gnss.outlier = "off";
  study.start = start;
  if (start == "drawn") study.biases = "random_walk";
  return study;
}

void expect_same(const StageErrors& a, const StageErrors& b) {
  EXPECT_EQ(a.whole.squares, b.whole.squares);
  EXPECT_EQ(a.flight.variances, b.flight.variances);
  ASSERT_EQ(a.nees.size(), b.nees.size());
  for (std::size_t i = 0; i < a.nees.size(); ++i) EXPECT_TRUE(a.nees[i] == b.nees[i] || std::isnan(b.nees[i]));
}

TEST(Study, gives_the_same_bits_for_any_threads_and_any_split) {
  for (const char* start : {"aligned", "drawn"}) {
    const StudyCase study = short_case(start);
    const Truth truth = study_truth(study);
#ifdef _OPENMP
    const int threads = omp_get_max_threads();
    omp_set_num_threads(3);
#endif
    const std::vector<RunErrors> all = run_study(study, truth, 0, 4);
#ifdef _OPENMP
    omp_set_num_threads(1);
#endif
    const std::vector<RunErrors> last = run_study(study, truth, 2, 2);
#ifdef _OPENMP
    omp_set_num_threads(threads);
#endif
    ASSERT_EQ(all.size(), 4u);
    for (std::size_t i = 0; i < 2; ++i) {
      ASSERT_EQ(all[i + 2].models.size(), 3u);
      EXPECT_EQ(all[i + 2].seed, last[i].seed);
      for (std::size_t m = 0; m < 3; ++m) {
        EXPECT_EQ(last[i].models[m].failure, "");
        expect_same(all[i + 2].models[m].filter, last[i].models[m].filter);
        expect_same(all[i + 2].models[m].smoother, last[i].models[m].smoother);
      }
    }
    EXPECT_NE(all[0].models[0].filter.whole.squares, all[1].models[0].filter.whole.squares);
  }
}

// The state of the filter at the last fix against the truth, by another way: geodetic coordinates and radii of curvature.
TEST(Study, errors_are_those_of_the_estimate_against_the_truth) {
  StudyCase study = short_case("drawn");
  study.models = {"lie"};
  study.nees_interval_s = 85.0;  // one epoch, at a fix
  const Truth truth = study_truth(study);
  const StudyRun run = study_run(study, truth, study.seed, false);
  Belief<Model> belief = run.start.belief;
  SilentVisitor<Model> silent;
  const std::size_t k = 85 * 50;
  forward_pass(run.start.data, run.start.filter, belief, run.start.cursor, truth.epochs[k].t_s, silent);

  const auto row = [](const SE23<double>& X) {
    Epoch epoch;
    epoch.X.first = X;
    return nav_row(epoch);
  };
  const NavRow found = row(belief.X.first), expected = row(truth.epochs[k].X);
  constexpr double kEarth_m = 6.38e6;  // within 0.4 % of both radii
  const RunErrors errors = run_study(study, truth, 0, 1).front();
  ASSERT_EQ(errors.models[0].filter.squares.size(), 1u);
  const ChannelValues& squares = errors.models[0].filter.squares[0];
  const auto root = [&](Channel c) { return std::sqrt(squares[c]); };
  for (const Channel c : {kRoll, kPitch, kHeading}) {
    const auto axis = static_cast<Eigen::Index>(c);
    EXPECT_NEAR(root(c), std::abs(found.rpy_rad[axis] - expected.rpy_rad[axis]) * kRadToDeg, 1e-9);
  }
  const double east = (found.lon_rad - expected.lon_rad) * std::cos(expected.lat_rad) * kEarth_m;
  const double north = (found.lat_rad - expected.lat_rad) * kEarth_m, up = found.height_m - expected.height_m;
  EXPECT_NEAR(root(kLongitude), std::abs(east), 0.01 * std::abs(east));
  EXPECT_NEAR(root(kLatitude), std::abs(north), 0.01 * std::abs(north));
  EXPECT_NEAR(root(kAltitude), std::abs(up), 1e-6);
  EXPECT_NEAR(squares[kPosition], squares[kLongitude] + squares[kLatitude] + squares[kAltitude], 1e-12);
  EXPECT_NEAR(root(kVelocity), (found.v_n_mps - expected.v_n_mps).norm(), 1e-7);
  EXPECT_GT(std::abs(up), 1e-4);  // there is something to compare
}

TEST(Study, a_run_without_errors_has_none_and_its_variances_are_those_of_the_runs) {
  StudyCase study = short_case("drawn");
  study.models = {"lie"};
  const Truth truth = study_truth(study);
  const RunErrors bound = study_bound(study, truth), run = run_study(study, truth, 0, 1).front();
  ASSERT_EQ(bound.models.size(), 1u);
  EXPECT_EQ(bound.epochs, run.epochs);
  EXPECT_EQ(bound.epochs, 901u);  // 10 Hz over 90 s
  EXPECT_LT(bound.flight_epochs, bound.epochs);
  const auto n = static_cast<double>(bound.epochs);
  EXPECT_LT(std::sqrt(bound.models[0].smoother.whole.squares[kHeading] / n), 1e-5);
  EXPECT_LT(std::sqrt(bound.models[0].filter.whole.squares[kPosition] / n), 1e-6);
  for (const Channel c : {kRoll, kHeading, kPosition, kVelocity}) {
    const double ratio = run.models[0].smoother.flight.variances[c] / bound.models[0].smoother.flight.variances[c];
    EXPECT_NEAR(std::sqrt(ratio), 1.0, 0.02)
        << kStudyChannels[c];  // first order in errors of some degrees at the start
  }
}

TEST(Study, nees_is_in_its_band_when_the_noise_is_the_filters_and_not_when_it_is_twice_that) {
  StudyCase study = short_case("drawn");
  study.models = {"lie"};
  const Truth truth = study_truth(study);
  const auto mean_nees = [&](const StudyCase& one, bool smoothed) {
    double sum = 0, n = 0;
    for (const RunErrors& run : run_study(one, truth, 0, 30)) {
      const StageErrors& stage = smoothed ? run.models[0].smoother : run.models[0].filter;
      for (const double nees : stage.nees) {
        if (std::isnan(nees)) continue;
        sum += nees;
        ++n;
      }
    }
    return sum / n;
  };
  // 30 runs of some 15 degrees of freedom, which go on within a run: sigma about sqrt(2 * 15 / 30) = 1
  for (const bool smoothed : {false, true}) EXPECT_NEAR(mean_nees(study, smoothed), 15.0, 2.5) << smoothed;
  StudyCase noisy = study;
  noisy.imu.noise_scale = 2.0;
  for (const bool smoothed : {false, true}) EXPECT_GT(mean_nees(noisy, smoothed), 20.0) << smoothed;
}

TEST(Study, a_heading_error_that_is_given_is_the_one_at_the_start) {
  StudyCase study = short_case("drawn");
  study.models = {"lie", "mekf"};
  study.heading_error_deg = 10.0;
  study.config.initial.heading_std_deg = 10.0;
  const Truth truth = study_truth(study);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Belief<Model> belief = study_run(study, truth, seed, false).start.belief;
    const double error = heading_of(belief.X) - heading_of(NavState<double>{truth.epochs.front().X, {}});
    EXPECT_NEAR(std::abs(std::remainder(error, 2.0 * kPi)) * kRadToDeg, 10.0, 0.1);
    // Along down, in body axes: what P_0 has of the heading.
    const Vector3d down = truth.epochs.front().X.C.transpose() * C_n_e(truth.epochs.front().X.p).col(2);
    EXPECT_NEAR(std::sqrt(down.dot(belief.P.block<3, 3>(kPhi, kPhi) * down)) * kRadToDeg, 10.0, 1e-6);
  }
  const std::vector<RunErrors> runs = run_study(study, truth, 0, 1);
  for (const ModelErrors& model : runs.front().models) EXPECT_LT(model.smoother.flight.squares[kHeading], 0.04 * 700);
}

TEST(Study, gimbal_lock_of_one_model_is_a_failure_of_that_model) {
  StudyCase study = short_case("drawn");
  study.config.initial.roll_pitch_std_deg = 60.0;  // some runs begin beyond 90 deg of pitch
  const Truth truth = study_truth(study);
  const std::vector<RunErrors> runs = run_study(study, truth, 0, 6);
  EXPECT_TRUE(
      std::any_of(runs.begin(), runs.end(), [](const RunErrors& run) { return !run.models[2].failure.empty(); }));
  for (const RunErrors& run : runs) {
    if (run.models[2].failure.empty()) continue;
    EXPECT_EQ(run.models[2].filter.whole.squares, ChannelValues{});
  }
}

TEST(Study, refuses_what_does_not_go_together) {
  const auto message = [](const auto& change) -> std::string {
    StudyCase study = short_case("aligned");
    change(study);
    try {
      study_truth(study);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const auto names = [&](const auto& change, const std::string& word) {
    EXPECT_NE(message(change).find(word), std::string::npos) << message(change);
  };
  EXPECT_EQ(message([](StudyCase&) {}), "");
  names([](StudyCase& s) { s.start = "guessed"; }, "start is \"guessed\"");
  names([](StudyCase& s) { s.models = {"ukf"}; }, "\"ukf\"");
  names([](StudyCase& s) { s.models.clear(); }, "models is empty");
  names([](StudyCase& s) { s.heading_error_deg = 5.0; }, "start = \"drawn\"");
  names([](StudyCase& s) { s.biases = "random_walk"; }, "start = \"drawn\"");
  names([](StudyCase& s) { s.mechanization = "paper"; }, "start = \"drawn\"");
  names(
      [](StudyCase& s) {
        s.mechanization = "paper";
        s.start = "drawn";
      },
      "oversample is 4");
  names([](StudyCase& s) { s.flight.oversample = 1; }, "oversample above 1");
  names([](StudyCase& s) { s.rate_hz = 0.0; }, "rate_hz is 0");
  names([](StudyCase& s) { s.rate_hz = 15.0; }, "rate_hz is 15");
  names([](StudyCase& s) { s.rate_hz = 100.0; }, "a whole part of the IMU's rate");
  names([](StudyCase& s) { s.nees_interval_s = 1000.0; }, "no more than the flight");
  names([](StudyCase& s) { s.models = {"lie", "lie"}; }, "twice");
}

}  // namespace
}  // namespace liealign
