// Reading and preparing a flight.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/flight.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "liealign/align/heading_grids.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/io/csv.hpp"
#include "liealign/io/rtklib_pos.hpp"
#include "liealign/pipeline/checks.hpp"
#include "liealign/pipeline/field_table.hpp"
#include "liealign/pipeline/settings.hpp"
#include "liealign/pipeline/start.hpp"

namespace liealign {
namespace {

std::string seconds(double t) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", t);
  return text;
}

std::string span(double begin, double end) { return seconds(begin) + " s to " + seconds(end) + " s"; }

// Raises the diagonal of a covariance to floor^2 where it is below.
void raise_to_floor(Matrix3d& P, double floor) {
  for (int i = 0; i < 3; ++i) P(i, i) = std::max(P(i, i), floor * floor);
}

// A receiver that has no fix yet states kilometres.
bool accepted(const GnssRecord& r, const Config& config) {
  constexpr double kNoFix_m = 1e4;
  if (r.P_n_m2(0, 0) + r.P_n_m2(1, 1) > kNoFix_m * kNoFix_m) return false;
  const std::vector<int>& accept = config.gnss.accept_fix;
  return r.fix < 0 || std::find(accept.begin(), accept.end(), r.fix) != accept.end();
}

void make_fixes(const Flight& flight, PreparedFlight& out) {
  FlightData& data = out.data;
  data.fixes.clear();
  out.record_time_s.clear();
  out.record_p_ea_e.clear();
  out.record_use.clear();
  const double begin = data.imu().front().t_s, end = data.imu().back().t_s;
  std::size_t refused = 0;
  for (std::size_t i = 0; i < flight.gnss.size(); ++i) {
    const GnssFix fix = fix_from_record(flight.gnss[i], i, flight.config, out.latency_s, out.gnss_std_scale);
    out.record_time_s.push_back(fix.t_s);
    out.record_p_ea_e.push_back(fix.p_ea_e);
    out.record_use.push_back(RecordUse::update);
    if (!accepted(flight.gnss[i], flight.config)) {
      out.record_use.back() = RecordUse::quality_not_accepted;
      ++refused;
    } else if (fix.t_s < begin || fix.t_s > end) {
      out.record_use.back() = RecordUse::outside_imu;
    } else {
      data.fixes.push_back(fix);
    }
  }
  if (refused == flight.gnss.size()) {
    throw InputError(flight.config.gnss.file +
                     ": no row has an accepted fix; gnss.accept_fix lists the values of the column \"fix\" to use");
  }
  if (data.fixes.empty()) {
    const auto named = [](const char* what, const std::string& file) {
      return file.empty() ? std::string(what) : file;
    };
    throw InputError("the IMU and the GNSS log do not overlap: " + named("the IMU log", flight.config.imu.file) +
                     " covers " + span(begin, end) + ", " + named("the GNSS log", flight.config.gnss.file) + " " +
                     span(out.record_time_s.front(), out.record_time_s.back()) +
                     (refused > 0 ? " (with " + std::to_string(refused) + " rows that gnss.accept_fix refuses)" : "") +
                     " (after gnss.latency_s); bring both to one time scale");
  }
}

void make_si(ImuSeries& log, const ImuConfig& config) {
  const double gyro = config.gyro_unit == "dps" ? kDegToRad : 1.0;
  const double accel = config.accel_unit == "g" ? kStandardGravity : 1.0;
  if (gyro == 1.0 && accel == 1.0) return;
  for (ImuSample& s : log) {
    s.omega_ib_b *= gyro;
    s.f_ib_b *= accel;
  }
}

// Rates in deg/s taken for rad/s hide the rest as well: then it is looked for with limits as much larger.
void check_rates(const FlightData& data, std::vector<RestPeriod> rests, const Config& config) {
  if (rests.empty()) {
    RestLimits limits = rest_limits(config);
    limits.gyro_std_rps *= kRadToDeg;
    limits.gyro_mean_rps *= kRadToDeg;
    rests = find_rests(data.imu(), data.fixes, limits);
  }
  if (rests.empty()) return;
  const RestStatistics rest = rest_statistics(data.imu(), data.fixes, rests.front());
  if (!rates_look_like_degrees(data.imu(), rest)) return;
  throw InputError(
      config.imu.file +
      ": in motion the rates tumble the body as only rates 57.3 times too large do: the gyros are in deg/s; "
      "set imu.gyro_unit = \"dps\" (--gyro-unit dps)");
}

// Fixes of the initial rest are its averaged position and not updates as well; fixes before the start are not used.
void drop_fixes_up_to(const Start& start, PreparedFlight& out) {
  auto& fixes = out.data.fixes;
  const double begin_s = start.moving ? start.t_s : start.rest.begin_s;
  const auto early = [&](const GnssFix& f) { return start.moving ? f.t_s < start.t_s : f.t_s <= start.t_s; };
  for (const GnssFix& f : fixes) {
    if (!early(f)) continue;
    out.record_use[f.record] = f.t_s >= begin_s ? RecordUse::averaged_at_rest : RecordUse::outside_imu;
  }
  std::erase_if(fixes, early);
}

// Updates by the rest that the run starts from and by the last one.
void add_rest_updates(const Start& start, PreparedFlight& out) {
  FlightData& data = out.data;
  const double interval = out.config.rest.interval_s;
  if (!start.moving) data.rests = rest_updates(data.imu(), start.rest, interval);
  if (!out.rests.empty() && out.rests.back().begin_s > start.t_s) {
    const std::vector<RestUpdate> last = rest_updates(data.imu(), out.rests.back(), interval);
    data.rests.insert(data.rests.end(), last.begin(), last.end());
  }
  list_observations(data);
}

// What the IMU and the fixes say of heading and latency before any filter runs. An unknown latency is set to what they say.
void run_coarse_stage(const Flight& flight, const Start& start, PreparedFlight& out) {
  const AlignmentProblem& problem = out.problem;
  CoarseOptions options;
  if (out.config.gnss.latency_s) options.max_lag_s = 0.0;
  std::optional<Vector3d> b_g;
  if (!start.moving) b_g = problem.rest.mean_omega_ib_b;
  out.coarse = coarse_alignment(out.data.imu(), out.data.fixes, out.data.l_ba_b, problem.t_start_s, problem.t_end_s,
                                options, b_g);
  if (out.config.gnss.latency_s || out.coarse.modes.empty()) return;
  out.latency_s = out.coarse.modes.front().latency_s;
  for (CoarseMode& mode : out.coarse.modes) mode.latency_s -= out.latency_s;
  make_fixes(flight, out);
}

// One fix a second. Noise scales come from innovations, and those of a fast receiver are not the independent ones that the
// likelihood takes them for: it filters, and what vibrates between two of its fixes says nothing about a heading.
void thin(std::vector<GnssFix>& fixes) {
  constexpr double kApart_s = 1.0, kSlack_s = 0.01;
  double next_s = -std::numeric_limits<double>::infinity();
  std::erase_if(fixes, [&](const GnssFix& f) {
    const bool early = f.t_s < next_s;
    if (!early) next_s = f.t_s + kApart_s - kSlack_s;
    return early;
  });
}

// The trajectory goes from the rest to the last fix or rest update; a wanted span outside of it is a slip.
void check_output_span(const PreparedFlight& out) {
  const OutputConfig& c = out.config.output;
  const FlightData& data = out.data;
  const double begin = out.t_begin_s, end = data.observations.empty() ? out.t_begin_s : data.observations.back().t_s;
  const double from = c.start_time_s.value_or(begin), to = c.stop_time_s.value_or(end);
  if (from <= std::min(to, end) && to >= begin) return;
  throw InputError("output.start_time_s and output.stop_time_s ask for " + span(from, to) +
                   ", the trajectory goes from " + span(begin, end) +
                   "; choose a span inside it (--start-time, --stop-time)");
}

void warn(const Flight& flight, PreparedFlight& out) {
  const FlightData& data = out.data;
  if (flight.config.gnss.lever_arm_b_m == std::array<double, 3>{0, 0, 0}) {
    out.warnings.push_back("gnss.lever_arm_b_m is zero: the antenna is taken to be at the IMU");
  }
  constexpr std::size_t kListed = 3;
  double gap_s = 0.0;
  for (std::size_t i = 0; i < out.gaps.size(); ++i) {
    const ImuGap& gap = out.gaps[i];
    gap_s += gap.end_s - gap.begin_s;
    if (i >= kListed) continue;
    out.warnings.push_back("the IMU log has a gap from " + span(gap.begin_s, gap.end_s) +
                           "; it is bridged and the noise grows there");
  }
  if (out.gaps.size() > kListed) {
    out.warnings.push_back("the IMU log has " + std::to_string(out.gaps.size()) + " gaps, " + seconds(gap_s) +
                           " s in all; the first " + std::to_string(kListed) + " are listed");
  }
  if (out.t_begin_s > data.imu().front().t_s + 1.0) {
    out.warnings.push_back("the run starts with the rest at " + seconds(out.t_begin_s) + " s; " +
                           seconds(out.t_begin_s - data.imu().front().t_s) + " s of IMU data before it are not used");
  }
  if (!data.fixes.empty() && data.imu().back().t_s > data.fixes.back().t_s + 2.0) {
    out.warnings.push_back("the IMU log goes on for " + seconds(data.imu().back().t_s - data.fixes.back().t_s) +
                           " s after the last fix; the trajectory ends with the last fix or rest");
  }
}

// The classical models and the papers' mechanization have no room for a receiver's own errors.
void check_error_model(const Config& config, bool has_baro) {
  if (config.gnss.error_model != "correlated" && !has_baro) return;
  const FilterConfig& f = config.filter;
  const std::string why = f.model != "lie"             ? "filter.model is \"" + f.model + "\""
                          : f.mechanization != "exact" ? "filter.mechanization is \"" + f.mechanization + "\""
                          : !f.covariance_reset        ? std::string("filter.covariance_reset is false")
                                                       : "";
  if (why.empty()) return;
  throw ConfigError(
      has_baro ? "a barometer is given (baro.file) and " + why +
                     ", which carries no drifting bias; drop the one or the other"
               : "gnss.error_model is \"correlated\" and " + why +
                     ", which carries no errors of the receiver; set gnss.error_model to \"white\", or drop it");
}

// A std that differs from the default was given by someone; the default itself stands in every config.toml.
void check_guess(const AlignConfig& align) {
  if (align.heading_guess_deg || align.heading_guess_std_deg == AlignConfig{}.heading_guess_std_deg) return;
  throw ConfigError("align.heading_guess_std_deg is " + toml_text(align.heading_guess_std_deg) +
                    " without align.heading_guess_deg; give the guess as well (--heading-guess DEG), or drop "
                    "align.heading_guess_std_deg (--heading-guess-std)");
}

}  // namespace

GnssFix fix_from_record(const GnssRecord& r, std::size_t index, const Config& config, double latency_s, double scale) {
  const GnssConfig& c = config.gnss;
  const Matrix3d C = C_n_e(r.lat_rad, r.lon_rad);
  GnssFix fix;
  fix.t_s = r.t_s - latency_s;
  fix.record = index;
  fix.p_ea_e = ecef_from_geodetic({r.lat_rad, r.lon_rad, r.height_m});
  Matrix3d P_n = scale * scale * r.P_n_m2;
  raise_to_floor(P_n, c.std_floor_m);
  fix.R_p_e = C * P_n * C.transpose();
  fix.has_velocity = r.has_velocity && c.use_velocity;
  if (!fix.has_velocity) return fix;
  fix.v_ea_e = C * r.v_n_mps;
  const Vector3d std_v =
      r.has_velocity_std ? Vector3d(scale * r.std_v_n_mps) : Vector3d::Constant(scale * c.velocity_std_mps);
  Matrix3d R_v = std_v.cwiseAbs2().asDiagonal();
  raise_to_floor(R_v, c.velocity_std_floor_mps);
  fix.R_v_e = C * R_v * C.transpose();
  return fix;
}

Flight read_flight(const Config& config) {
  if (config.imu.file.empty()) throw ConfigError("imu.file is not given; name the IMU log (--imu FILE)");
  if (config.gnss.file.empty()) throw ConfigError("gnss.file is not given; name the GNSS log (--gnss FILE)");
  check_guess(config.align);
  Flight flight;
  flight.config = config;
  flight.imu = read_imu_csv(config.imu.file, flight.warnings);
  if (!config.baro.file.empty()) flight.baro = read_baro_csv(config.baro.file, flight.warnings);
  if (!looks_like_rtklib_pos(config.gnss.file)) {
    flight.gnss = read_gnss_csv(config.gnss.file, flight.warnings);
    return flight;
  }
  RtklibPos pos = read_rtklib_pos(config.gnss.file, flight.warnings);
  if (config.gnss.week.value_or(pos.week) != pos.week) {
    throw InputError(config.gnss.file + ": the first record is of GPS week " + std::to_string(pos.week) +
                     ", gnss.week is " + std::to_string(*config.gnss.week) + "; drop gnss.week");
  }
  flight.config.gnss.week = pos.week;
  flight.gnss = std::move(pos.records);
  return flight;
}

PreparedFlight prepare_flight(Flight flight) {
  const Config& config = flight.config;
  check_guess(config.align);
  check_error_model(config, !flight.baro.empty() || !config.baro.file.empty());
  PreparedFlight out;
  out.config = config;
  out.warnings = flight.warnings;
  out.latency_s = config.gnss.latency_s.value_or(kUnestimatedLatency_s);
  out.imu_noise_scale = config.imu.noise_scale.value_or(kUnestimatedScale);
  out.gnss_std_scale = config.gnss.std_scale.value_or(kUnestimatedScale);
  out.filter = filter_options(config);

  AlignmentProblem& problem = out.problem;
  FlightData& data = out.data;
  make_si(flight.imu, config.imu);
  PreparedImu imu =
      prepare_imu(std::move(flight.imu), sample_kind(config), sensor_to_body(config), config.imu.max_gap_s);
  out.gaps = imu.gaps;
  out.imu_rate_hz = std::round(1e3 / imu.median_dt_s) / 1e3;  // stamps carry rounding; nobody needs more digits
  data.samples = std::make_shared<const ImuSeries>(std::move(imu.samples));
  data.l_ba_b = Vector3d(config.gnss.lever_arm_b_m[0], config.gnss.lever_arm_b_m[1], config.gnss.lever_arm_b_m[2]);
  data.rest_noise = rest_noise(config);
  make_fixes(flight, out);

  out.rests = find_rests(data.imu(), data.fixes, rest_limits(config));
  check_rates(data, out.rests, config);
  const Start start = choose_start(config, data, out.rests);
  out.start = start.moving ? "moving" : "static";
  out.start_reason = start.reason;
  problem.t_start_s = start.t_s;
  const double longest = config.align.max_time_s > 0.0 ? config.align.max_time_s : data.imu().back().t_s;
  problem.t_end_s = std::min(problem.t_start_s + longest, data.imu().back().t_s);
  if (!start.moving) problem.rest = rest_statistics(data.imu(), data.fixes, start.rest);
  run_coarse_stage(flight, start, out);
  if (start.moving) {
    out.t_begin_s = problem.t_begin_s = start.t_s;
    problem.motion = motion_statistics(data.fixes, start.t_s, out.coarse);
  } else {
    out.t_begin_s = start.rest.begin_s;
    problem.t_begin_s = std::max(start.rest.begin_s, start.rest.end_s - config.align.max_rest_s);
    problem.rest = rest_statistics(data.imu(), data.fixes, start.rest);
    const double bias_std_mps2 = initial_std(config).accel_bias_mps2;
    for (const std::string& warning : check_force_at_rest(problem.rest, bias_std_mps2, config.imu.file))
      out.warnings.push_back(warning);
  }
  problem.initial = initial_std(config);
  // Given noise is the constant one of the data sheet.
  if (!config.imu.noise_scale) {
    ImuNoise& noise = out.filter.dynamics.noise;
    noise.shape =
        std::make_shared<const NoiseShape>(noise_shape(data.imu(), noise, problem.t_start_s, problem.t_end_s));
  }
  problem.filter = out.filter;
  drop_fixes_up_to(start, out);
  add_rest_updates(start, out);
  check_output_span(out);
  problem.data = scored_data(out, problem.t_end_s);
  preintegrate(problem);
  warn(flight, out);
  out.gnss = std::move(flight.gnss);
  out.baro = std::move(flight.baro);
  return out;
}

FlightData scored_data(const PreparedFlight& flight, double t_end_s) {
  constexpr double kGuard_s = kLatencyScan_s + 0.05, kBlindGuard_s = 1.0;
  const Config& config = flight.config;
  double guard = 0.0;
  if (!config.gnss.latency_s) {
    guard = flight.coarse.modes.empty() ? kBlindGuard_s : kGuard_s;
    for (const CoarseMode& mode : flight.coarse.modes) guard = std::max(guard, kGuard_s + std::abs(mode.latency_s));
  }
  FlightData data = flight.data;
  std::erase_if(data.fixes,
                [&](const GnssFix& f) { return f.t_s <= flight.problem.t_start_s + guard || f.t_s > t_end_s - guard; });
  if (!config.imu.noise_scale || !config.gnss.std_scale) thin(data.fixes);
  list_observations(data);
  return data;
}

HeadingSearchOptions heading_search_options(const PreparedFlight& flight) {
  HeadingSearchOptions o = heading_search_options(flight.config);
  for (const CoarseMode& mode : flight.coarse.modes)
    o.seeds.push_back({mode.heading_rad, mode.heading_std_rad, mode.latency_s});
  o.span_s = flight.problem.t_end_s - flight.problem.t_start_s;
  o.estimate_latency = !flight.config.gnss.latency_s;
  o.estimate_imu_noise = !flight.config.imu.noise_scale;
  o.estimate_gnss_std = !flight.config.gnss.std_scale;
  for (const GnssFix& f : flight.problem.data.fixes) o.has_velocity = o.has_velocity || f.has_velocity;
  return o;
}

}  // namespace liealign
