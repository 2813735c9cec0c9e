// Laws of the pipeline on simulated flights: latency, axes, sample kinds, outliers, gaps, velocity, refusals.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>

#include "flights.hpp"
#include "liealign/core/error.hpp"
#include "liealign/io/text_file.hpp"
#include "liealign/pipeline/results.hpp"

namespace liealign {
namespace {

using testing::align;
using testing::table_1_flight;
using testing::true_heading;

constexpr double kHeading_deg = 77.0;

Config guessed() {
  Config config;
  config.align.heading_guess_deg = kHeading_deg + 8.0;
  config.align.heading_guess_std_deg = 20.0;
  return config;
}

// Heading error in units of its sigma, after an alignment on the whole flight.
double normalised_error(const SimulatedFlight& s, const Flight& flight, const std::string& verdict = "aligned") {
  const PreparedFlight prepared = prepare_flight(flight);
  const HeadingResult r = align(prepared);
  EXPECT_EQ(r.verdict, verdict);
  return wrap_pi(r.heading_rad - true_heading(s, prepared.problem.t_start_s)) / r.sigma_rad.value();
}

TEST(Pipeline, a_known_latency_is_taken_out) {
  GnssErrors late;
  late.latency_s = 0.2;
  Config config = guessed();
  config.gnss.latency_s = 0.2;
  const SimulatedFlight s = table_1_flight(kHeading_deg, 1, config, late);
  EXPECT_LT(std::abs(normalised_error(s, s.flight)), 4.0);
  // and the sign of it matters: a flight that does not fit says so
  Flight wrong = s.flight;
  wrong.config.gnss.latency_s = -0.2;
  EXPECT_GT(std::abs(normalised_error(s, wrong, "weak")), 10.0);
}

TEST(Pipeline, declared_axes_and_mounting_give_the_result_of_the_body_axes) {
  const SimulatedFlight s = table_1_flight(kHeading_deg, 2, guessed());
  const HeadingResult body = align(prepare_flight(s.flight));
  const auto turned = [&](const Matrix3d& C_b_s) {
    Flight f = s.flight;
    for (ImuSample& x : f.imu) {
      x.omega_ib_b = C_b_s * x.omega_ib_b;
      x.f_ib_b = C_b_s * x.f_ib_b;
    }
    return f;
  };
  Flight flu = turned(C_s_b_from_axes("FLU").transpose());
  flu.config.imu.axes = "FLU";
  EXPECT_NEAR(align(prepare_flight(flu)).heading_rad, body.heading_rad, 1e-9);
  Flight mounted = turned(C_b_n_from_rpy({0.1, -0.2, 1.3}).transpose());
  mounted.config.imu.mounting_rpy_deg = {0.1 * kRadToDeg, -0.2 * kRadToDeg, 1.3 * kRadToDeg};
  // rest windows and floors act per axis, so that the last digits may differ
  EXPECT_NEAR(align(prepare_flight(mounted)).heading_rad, body.heading_rad, 1e-5);
}

TEST(Pipeline, increments_give_the_result_of_mean_rates) {
  const SimulatedFlight s = table_1_flight(kHeading_deg, 3, guessed());
  Flight f = s.flight;
  f.config.imu.sample = "increment";
  for (std::size_t k = f.imu.size(); k-- > 0;) {
    const double dt = k == 0 ? 0.02 : f.imu[k].t_s - f.imu[k - 1].t_s;
    f.imu[k].omega_ib_b *= dt;
    f.imu[k].f_ib_b *= dt;
  }
  EXPECT_NEAR(align(prepare_flight(f)).heading_rad, align(prepare_flight(s.flight)).heading_rad, 1e-9);
}

TEST(Pipeline, gross_outliers_move_neither_heading_nor_trajectory) {
  GnssErrors errors;
  errors.outlier_probability = 0.05;
  errors.rate_hz = 5;
  const SimulatedFlight s = table_1_flight(kHeading_deg, 4, guessed(), errors);
  for (const char* treatment : {"weight", "reject"}) {
    Flight f = s.flight;
    f.config.gnss.outlier = treatment;
    const PreparedFlight prepared = prepare_flight(f);
    const HeadingResult r = align(prepared);
    EXPECT_LT(std::abs(wrap_pi(r.heading_rad - true_heading(s, prepared.problem.t_start_s))) * kRadToDeg, 0.5)
        << treatment;
    const Solution solution = process(prepared, r);
    double worst = 0;
    for (const Epoch& e : solution.smoothed) worst = std::max(worst, (e.X.first.p - truth_at(s.truth, e.t_s).p).norm());
    EXPECT_LT(worst, 0.25) << treatment;
    int flagged = 0;
    for (const FixRecord& fix : solution.fixes) flagged += fix.position && fix.position->verdict != Verdict::used;
    EXPECT_GT(flagged, 5) << treatment;
  }
}

TEST(Pipeline, a_gap_in_the_imu_log_is_bridged_reported_and_felt) {
  const SimulatedFlight s = table_1_flight(kHeading_deg, 5, guessed());
  Flight f = s.flight;
  std::erase_if(f.imu, [](const ImuSample& x) { return x.t_s > 1050.3 && x.t_s < 1050.9; });
  const PreparedFlight prepared = prepare_flight(f);
  ASSERT_EQ(prepared.gaps.size(), 1u);
  EXPECT_TRUE(std::any_of(prepared.warnings.begin(), prepared.warnings.end(), [](const std::string& w) {
    return w.find("gap from 1050.300 s to 1050.900 s") != std::string::npos;
  }));
  const HeadingResult r = align(prepared);
  const Solution with_gap = process(prepared, r), whole = process(prepare_flight(s.flight), r);
  const auto sigma_v = [](const Solution& x, double t) {
    const auto at = std::find_if(x.smoothed.begin(), x.smoothed.end(), [t](const Epoch& e) { return e.t_s >= t; });
    return std::sqrt(at->P_nu.trace());
  };
  EXPECT_GT(sigma_v(with_gap, 1050.92), 1.5 * sigma_v(whole, 1050.92));
  double worst = 0;
  for (const Epoch& e : with_gap.smoothed) worst = std::max(worst, (e.X.first.p - truth_at(s.truth, e.t_s).p).norm());
  EXPECT_LT(worst, 0.3);
}

TEST(Pipeline, fixes_inside_a_gap_do_not_hide_it) {
  GnssErrors errors;
  errors.rate_hz = 20;
  const SimulatedFlight s = table_1_flight(kHeading_deg, 13, guessed(), errors);
  Flight f = s.flight;
  std::erase_if(f.imu, [](const ImuSample& x) { return x.t_s > 1050.0 && x.t_s < 1053.0; });
  const PreparedFlight prepared = prepare_flight(f);
  const Solution solution = process(prepared, align(prepared));
  double worst_p = 0, worst_v = 0;
  for (const Epoch& e : solution.smoothed) {
    const SE23<double> X = truth_at(s.truth, e.t_s);
    worst_p = std::max(worst_p, (e.X.first.p - X.p).norm());
    if (e.t_s < 1049.0 || e.t_s > 1055.0) worst_v = std::max(worst_v, (e.X.first.v - X.v).norm());
  }
  EXPECT_LT(worst_p, 0.1);
  EXPECT_LT(worst_v, 0.1);
}

TEST(Pipeline, a_nudge_before_the_flight_does_not_move_the_start) {
  DroneFlight drone = testing::short_flight();
  drone.parked_before_s = 40;
  drone.duration_s = 140;
  drone.heading_deg = kHeading_deg;
  SimulatedFlight s = simulate_flight(drone, {}, testing::with_given_parameters(guessed()), 14);
  for (ImuSample& x : s.flight.imu) {
    if (x.t_s > 1015.0 && x.t_s < 1015.6) x.f_ib_b += Vector3d(std::sin(40 * x.t_s), std::cos(31 * x.t_s), 1.0);
  }
  const PreparedFlight prepared = prepare_flight(s.flight);
  EXPECT_GT(prepared.problem.t_start_s, 1037.0);
  EXPECT_GT(prepared.t_begin_s, 1015.0);
}

TEST(Pipeline, a_guess_alone_is_no_alignment) {
  const SimulatedFlight s = table_1_flight(kHeading_deg, 15);
  Flight parked = s.flight;
  std::erase_if(parked.imu, [](const ImuSample& x) { return x.t_s > 1011; });
  parked.config.align.heading_guess_deg = 200.0;
  parked.config.align.heading_guess_std_deg = 0.5;
  EXPECT_EQ(align(prepare_flight(parked)).verdict, "unobservable");
}

TEST(Pipeline, the_std_of_a_guess_wants_the_guess) {
  Flight flight = table_1_flight(kHeading_deg, 15).flight;
  flight.config.align.heading_guess_deg.reset();
  flight.config.align.heading_guess_std_deg = 5.0;
  EXPECT_THROW(prepare_flight(flight), ConfigError);
  flight.config.align.heading_guess_std_deg = AlignConfig{}.heading_guess_std_deg;  // as every config.toml has it
  EXPECT_NO_THROW(prepare_flight(flight));
  flight.config.align.heading_guess_std_deg = 5.0;
  flight.config.align.heading_guess_deg = kHeading_deg;
  EXPECT_NO_THROW(prepare_flight(flight));
}

TEST(Pipeline, gnss_velocity_sharpens_the_velocity) {
  GnssErrors errors;
  errors.velocity = true;
  const SimulatedFlight s = table_1_flight(kHeading_deg, 6, guessed(), errors);
  EXPECT_LT(std::abs(normalised_error(s, s.flight)), 4.0);
  Flight without = s.flight;
  without.config.gnss.use_velocity = false;
  const PreparedFlight p = prepare_flight(s.flight), q = prepare_flight(without);
  const HeadingResult r = align(p);
  const auto variance = [](const Solution& x) {  // in flight
    double sum = 0;
    for (const Epoch& e : x.smoothed) sum += e.t_s > 1015.0 && e.t_s < 1100.0 ? e.P_nu.trace() : 0.0;
    return sum;
  };
  EXPECT_LT(variance(process(p, r)), variance(process(q, r)));
}

TEST(Pipeline, a_parked_log_is_never_aligned) {
  const SimulatedFlight s = table_1_flight(kHeading_deg, 7);
  Flight parked = s.flight;
  std::erase_if(parked.imu, [](const ImuSample& x) { return x.t_s > 1011; });
  const HeadingResult r = align(prepare_flight(parked));
  EXPECT_EQ(r.verdict, "unobservable");
  EXPECT_FALSE(r.sigma_rad);
}

TEST(Pipeline, a_larger_noise_scale_states_larger_sigmas) {
  const SimulatedFlight s = table_1_flight(kHeading_deg, 8, guessed());
  Flight scaled = s.flight;
  scaled.config.imu.noise_scale = 3.0;
  scaled.config.gnss.std_scale = 3.0;
  const HeadingResult one = align(prepare_flight(s.flight)), three = align(prepare_flight(scaled));
  EXPECT_GT(*three.sigma_rad, 2.0 * *one.sigma_rad);
}

// The same log as somebody else's logger would have written it.
Flight mislabelled(const Flight& flight, double gyro, double accel, const char* axes) {
  Flight f = flight;
  f.config.imu.file = "imu.csv";
  for (ImuSample& s : f.imu) {
    s.omega_ib_b = gyro * (C_s_b_from_axes(axes).transpose() * s.omega_ib_b);
    s.f_ib_b = accel * (C_s_b_from_axes(axes).transpose() * s.f_ib_b);
  }
  return f;
}

std::string refusal_of(const Flight& flight) {
  try {
    prepare_flight(flight);
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(Units, wrong_ones_are_refused_with_the_key_that_mends_them_and_mended_give_the_clean_result) {
  const SimulatedFlight s = table_1_flight(kHeading_deg, 11, guessed());
  const double clean = align(prepare_flight(s.flight)).heading_rad;
  Flight degrees = mislabelled(s.flight, kRadToDeg, 1.0, "FRD");
  EXPECT_EQ(
      refusal_of(degrees),
      "imu.csv: in motion the rates tumble the body as only rates 57.3 times too large do: the gyros are in deg/s; "
      "set imu.gyro_unit = \"dps\" (--gyro-unit dps)");
  degrees.config.imu.gyro_unit = "dps";
  EXPECT_NEAR(align(prepare_flight(degrees)).heading_rad, clean, 1e-9);

  Flight in_g = mislabelled(s.flight, 1.0, 1.0 / kStandardGravity, "FRD");
  EXPECT_EQ(refusal_of(in_g),
            "imu.csv: the specific force at rest is 1.00, expected 9.8 m/s^2: the accelerometers are in g; set "
            "imu.accel_unit = \"g\" (--accel-unit g)");
  in_g.config.imu.accel_unit = "g";
  EXPECT_NEAR(align(prepare_flight(in_g)).heading_rad, clean, 1e-9);

  Flight up = mislabelled(s.flight, 1.0, 1.0, "FLU");
  EXPECT_EQ(refusal_of(up).substr(0, 46), "imu.csv: at rest the specific force along z is");
  EXPECT_NE(refusal_of(up).find("--axes FLU"), std::string::npos);
  up.config.imu.axes = "FLU";
  EXPECT_NEAR(align(prepare_flight(up)).heading_rad, clean, 1e-9);

  EXPECT_NE(refusal_of(mislabelled(s.flight, 1.0, 2.0, "FRD")).find("the specific force at rest is 19."),
            std::string::npos);
  EXPECT_EQ(refusal_of(mislabelled(s.flight, 1.0, 1.0, "FRD")), "accepted");
}

TEST(Units, noisy_or_biased_gyros_in_the_right_unit_are_accepted) {
  Config config = guessed();
  config.imu.noise_scale = 20.0;
  const SimulatedFlight s = table_1_flight(kHeading_deg, 12, config);
  Flight biased = s.flight;
  for (ImuSample& x : biased.imu) x.omega_ib_b += Vector3d(0.05, -0.05, 0.05);  // 3 deg/s
  EXPECT_EQ(refusal_of(biased), "accepted");
}

// (Eq. 70), at the IMU and at a camera, whose epochs come another way.
TEST(Pipeline, an_uncertain_latency_is_uncertain_along_the_flight) {
  for (const double arm : {0.0, 0.4}) {
    Config config;
    config.output.reference_point_b_m = {arm, 0.0, 0.0};
    config.gnss.error_model = "white";  // else the latency is a state, and in the covariance already
    const SimulatedFlight s = testing::table_1_flight(80.0, 4, config);
    const PreparedFlight prepared = prepare_flight(s.flight);
    HeadingResult heading = align(prepared);
    const Solution sure = process(prepared, heading);
    heading.parameters_std.latency_s = 0.002;
    const Solution unsure = process(prepared, heading);
    double fastest = 0;
    for (std::size_t i = 0; i < sure.smoothed.size(); i += 50) {
      const NavRow a = nav_row(sure.smoothed[i]), b = nav_row(unsure.smoothed[i]);
      const Vector3d more = b.std_p_n_m.cwiseAbs2() - a.std_p_n_m.cwiseAbs2();
      EXPECT_LT((more - (0.002 * a.v_n_mps).cwiseAbs2()).norm(), 1e-9);
      EXPECT_EQ(a.v_n_mps, b.v_n_mps);
      fastest = std::max(fastest, a.v_n_mps.norm());
    }
    EXPECT_GT(fastest, 4.0);
  }
}

TEST(Pipeline, a_noise_model_that_is_too_small_is_said) {
  const SimulatedFlight s = table_1_flight(kHeading_deg, 10, guessed());
  const auto said = [](const Flight& flight) {
    const PreparedFlight prepared = prepare_flight(flight);
    const std::vector<std::string> warnings = run_warnings(prepared, align(prepared));
    return std::any_of(warnings.begin(), warnings.end(),
                       [](const std::string& w) { return w.find("raise imu.noise_scale") != std::string::npos; });
  };
  EXPECT_FALSE(said(s.flight));
  Flight small = s.flight;
  small.config.gnss.std_floor_m = 0.0;
  small.config.gnss.std_scale = 0.2;
  EXPECT_TRUE(said(small));
}

TEST(Results, leave_no_part_file_and_the_config_reads_back) {
  const SimulatedFlight s = table_1_flight(kHeading_deg, 9, guessed());
  const PreparedFlight prepared = prepare_flight(s.flight);
  const HeadingResult r = align(prepared);
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "liealign_results_test";
  std::filesystem::remove_all(folder);
  write_results(folder.string(), prepared, r, process(prepared, r));
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(folder)) names.push_back(file.path().filename().string());
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"alignment.json", "biases.csv", "config.toml", "innovations.csv",
                                             "summary.json", "trajectory.csv"}));
  const std::string trajectory = read_text_file((folder / "trajectory.csv").string());
  EXPECT_EQ(
      trajectory.substr(0, trajectory.find('\n')),
      "time_s,lat_deg,lon_deg,height_m,vn_mps,ve_mps,vd_mps,roll_deg,pitch_deg,heading_deg,std_n_m,std_e_m,std_d_m,"
      "std_vn_mps,std_ve_mps,std_vd_mps,std_roll_deg,std_pitch_deg,std_heading_deg,"
      "relative_std_n_m,relative_std_e_m,relative_std_d_m");
  std::filesystem::remove_all(folder);
}

TEST(Pipeline, refuses_flights_it_cannot_start_and_says_why) {
  const SimulatedFlight s = table_1_flight(40.0, 6);
  const auto refusal = [](Flight flight) -> std::string {
    flight.config.imu.file = "imu.csv";
    flight.config.gnss.file = "gnss.csv";
    try {
      prepare_flight(flight);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  Flight late = s.flight;
  for (GnssRecord& r : late.gnss) r.t_s += 1000;
  EXPECT_NE(refusal(late).find("do not overlap: imu.csv covers 1000.000 s to 1110.000 s, gnss.csv 20"),
            std::string::npos)
      << refusal(late);
  Flight air = s.flight;
  std::erase_if(air.imu, [](const ImuSample& x) { return x.t_s < 1030 || x.t_s > 1095; });
  EXPECT_EQ(refusal(air), "");
  air.config.align.start = "static";
  EXPECT_NE(refusal(air).find("the log holds no rest"), std::string::npos) << refusal(air);
  Flight bad = s.flight;
  for (GnssRecord& r : bad.gnss) r.fix = 7;
  EXPECT_NE(refusal(bad).find("no row has an accepted fix"), std::string::npos) << refusal(bad);
  EXPECT_EQ(refusal(s.flight), "");
}

}  // namespace
}  // namespace liealign
