// One run of a case: sensors and start.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/study/study_case.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/pipeline/clock.hpp"
#include "liealign/pipeline/process.hpp"
#include "liealign/pipeline/settings.hpp"
#include "stopwatch.hpp"

namespace liealign {
namespace {

// Streams of the seed; the others are in simulate/ and pipeline/.
enum StudyStream : std::uint64_t { kInitialError = 201 };

void require_word(const char* name, const std::string& word, const char* one, const char* other) {
  if (word == one || word == other) return;
  throw Error(std::string("study: ") + name + " is \"" + word + "\"; expected \"" + one + "\" or \"" + other + "\"");
}

[[noreturn]] void refuse(const char* name, double value, const char* allowed) {
  throw Error(std::string("study: ") + name + " is " + std::to_string(value) + "; expected " + allowed);
}

void require_whole(double ratio, const char* name, double value, const char* allowed) {
  constexpr double kSlack = 1e-6;  // rates are given in decimals
  if (ratio < 1.0 - kSlack || std::abs(ratio - std::round(ratio)) > kSlack * ratio) refuse(name, value, allowed);
}

// X_true = X_hat exp(eps), and the biases of the truth where they are drawn.
struct Drawn {
  Vector<double, 15> eps;
  LieModel<double>::Covariance P_0;
};

Drawn draw(const StudyCase& study, const SE23<double>& X_true, std::uint64_t seed) {
  const InitialStd std = initial_std(study.config);
  const double heading_std = study.config.initial.heading_std_deg * kDegToRad;
  const Matrix3d C_b_n = C_n_e(X_true.p).transpose() * X_true.C;
  const Vector3d attitude_std(std.roll_pitch_rad, std.roll_pitch_rad, heading_std);
  Vector<double, 15> sigma;
  sigma << attitude_std, Vector3d::Constant(std.velocity_mps), Vector3d::Constant(study.position_std_m),
      Vector3d::Constant(std.accel_bias_mps2), Vector3d::Constant(std.gyro_bias_rps);
  Random random(seed, kInitialError);
  Vector<double, 15> unit;
  for (int i = 0; i < 15; ++i) unit[i] = random.normal();
  Drawn drawn{sigma.cwiseProduct(unit), sigma.cwiseAbs2().asDiagonal()};
  if (study.heading_error_deg)
    drawn.eps[kPhi + 2] = std::copysign(*study.heading_error_deg * kDegToRad, unit[kPhi + 2]);
  // The attitude's are about north, east and down; its error is in body axes.
  drawn.eps.head<3>() = (C_b_n.transpose() * drawn.eps.head<3>()).eval();
  drawn.P_0.topLeftCorner<3, 3>() = (C_b_n.transpose() * attitude_std.cwiseAbs2().asDiagonal() * C_b_n).eval();
  return drawn;
}

StudySensors sense(const StudyCase& study, const Truth& truth, const Drawn& drawn, std::uint64_t seed, bool perfect) {
  StudySensors sensors;
  if (perfect) {
    sensors.imu = truth.imu;
    sensors.b_a = sensors.b_g = std::vector<Vector3d>(truth.imu.size(), Vector3d::Zero());
    sensors.gnss = simulate_gnss(truth, without_random_errors(study.gnss), seed);
    return sensors;
  }
  ImuErrors errors = imu_errors(study.config, study.imu, seed);
  vibrate_in_motion(errors, truth);
  if (study.biases == "random_walk") {
    errors.ornstein_uhlenbeck = false;
    errors.b_a_turn_on = drawn.eps.segment<3>(kBa);
    errors.b_g_turn_on = drawn.eps.segment<3>(kBg);
  }
  SimulatedImu imu = add_imu_errors(truth.imu, errors, seed);
  sensors = {std::move(imu.log), simulate_gnss(truth, study.gnss, seed), std::move(imu.b_a), std::move(imu.b_g)};
  return sensors;
}

StudyStart drawn_start(const StudyCase& study, const Config& config, const Truth& truth, const Drawn& drawn,
                       const StudySensors& sensors) {
  StudyStart start;
  // One step of the truth per sample: the samples are what the mechanization takes, and no log of means.
  ImuSeries imu = sensors.imu;
  if (study.flight.oversample > 1)
    imu = prepare_imu(std::move(imu), ImuSampleKind::mean, Matrix3d::Identity(), config.imu.max_gap_s).samples;
  start.data.samples = std::make_shared<const ImuSeries>(std::move(imu));
  start.data.l_ba_b = Vector3d(config.gnss.lever_arm_b_m.data());
  for (std::size_t i = 0; i < sensors.gnss.size(); ++i)
    start.data.fixes.push_back(fix_from_record(sensors.gnss[i], i, config,
                                               config.gnss.latency_s.value_or(kUnestimatedLatency_s),
                                               config.gnss.std_scale.value_or(kUnestimatedScale)));
  list_observations(start.data);
  start.filter = filter_options(config);
  const NavState<double> error = NavState<double>::exp(drawn.eps);
  start.belief = {NavState<double>{truth.epochs.front().X, {}} * error.inverse(), drawn.P_0};
  start.belief.X.second.x.setZero();
  start.cursor = cursor_at(start.data.imu(), start.data.imu().front().t_s);
  return start;
}

// The three filters have no room for a receiver's own errors, so that their start and their noise are of white ones.
StudyStart aligned_start(Config config, const StudySensors& sensors) {
  config.gnss.error_model = "white";
  const PreparedFlight flight = prepare_flight({config, sensors.imu, sensors.gnss, {}});
  HeadingSearch search(heading_search_options(flight));
  while (!search.done()) search.tell(evaluate_candidates(flight.problem, search.ask()));
  RunStart run = run_start(flight, with_clock_of_flight(flight, search.result()));
  return {std::move(run.data), run.filter, run.belief, run.cursor};
}

}  // namespace

void check_study(const StudyCase& s) {
  require_word("start", s.start, "aligned", "drawn");
  require_word("biases", s.biases, "ornstein_uhlenbeck", "random_walk");
  require_word("mechanization", s.mechanization, "exact", "paper");
  require_word("imu.turn_on", s.imu.turn_on, "drawn", "fixed");
  for (const auto& [name, value] : {std::pair{"rate_hz", s.rate_hz}, std::pair{"nees_interval_s", s.nees_interval_s},
                                    std::pair{"position_std_m", s.position_std_m}}) {
    if (!(value > 0.0) || !std::isfinite(value)) refuse(name, value, "a finite number above 0");
  }
  require_whole(s.flight.rate_hz / s.rate_hz, "rate_hz", s.rate_hz, "a whole part of the IMU's rate");
  require_whole(s.flight.rate_hz * s.nees_interval_s, "nees_interval_s", s.nees_interval_s,
                "a whole number of IMU samples");
  if (s.track.empty() && s.nees_interval_s > s.flight.duration_s)
    refuse("nees_interval_s", s.nees_interval_s, "no more than the flight");
  if (s.models.empty()) throw Error("study: models is empty; expected some of \"lie\", \"mekf\", \"euler\"");
  for (const std::string& model : s.models) {
    if (model != "lie" && model != "mekf" && model != "euler")
      throw Error("study: models has \"" + model + "\"; expected some of \"lie\", \"mekf\", \"euler\"");
    if (std::count(s.models.begin(), s.models.end(), model) > 1)
      throw Error("study: models has \"" + model + "\" twice; expected each once");
  }
  if (s.heading_error_deg && s.start != "drawn")
    throw Error("study: heading_error_deg is given and start is \"aligned\"; it belongs to start = \"drawn\"");
  if (!std::isfinite(s.heading_error_deg.value_or(0.0)))
    refuse("heading_error_deg", *s.heading_error_deg, "a finite number");
  if (s.start == "aligned" && s.biases == "random_walk")
    throw Error("study: biases = \"random_walk\" goes with start = \"drawn\", whose P_0 the first bias is drawn from");
  if (s.start == "aligned" && s.mechanization == "paper")
    throw Error("study: mechanization = \"paper\" goes with start = \"drawn\"");
  if (s.mechanization == "paper" && s.flight.oversample != 1)
    throw Error("study: mechanization = \"paper\" is its own truth with oversample = 1 only, and oversample is " +
                std::to_string(s.flight.oversample));
  if (s.start == "aligned" && s.flight.oversample == 1)
    throw Error(
        "study: start = \"aligned\" takes the IMU as a log of means; expected an oversample above 1, such as 4");
}

Truth study_truth(const StudyCase& study) {
  check_study(study);
  const Mechanization kind = study.mechanization == "paper" ? Mechanization::paper : Mechanization::exact;
  if (!study.track.empty())
    return track_truth(study.track, study.flight.rate_hz, study.flight.oversample, kind, GravityModel::normal);
  return drone_truth(study.flight, kind, GravityModel::normal);
}

StudyRun study_run(const StudyCase& study, const Truth& truth, std::uint64_t seed, bool perfect) {
  check_study(study);
  Config config = study.config;
  type_in(config, study.gnss, perfect ? TypedInErrors{} : study.typed_in, seed);
  StudyRun run;
  const Stopwatch begin;
  Drawn drawn = draw(study, truth.epochs.front().X, seed);
  if (perfect) drawn.eps.setZero();
  run.sensors = sense(study, truth, drawn, seed, perfect);
  run.simulate_s = begin.seconds();
  const Stopwatch sensed;
  run.start = study.start == "aligned" ? aligned_start(config, run.sensors)
                                       : drawn_start(study, config, truth, drawn, run.sensors);
  run.align_s = sensed.seconds();
  return run;
}

}  // namespace liealign
