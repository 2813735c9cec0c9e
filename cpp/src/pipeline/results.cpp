// The result files.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/results.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/estimate/parts.hpp"
#include "liealign/io/json.hpp"
#include "liealign/io/text_file.hpp"
#include "liealign/observe/kinds.hpp"
#include "liealign/pipeline/config_files.hpp"
#include "liealign/pipeline/trajectory_files.hpp"

namespace liealign {
namespace {

Json degrees(const std::optional<double>& rad) { return rad ? Json(*rad * kRadToDeg) : Json(); }

std::size_t count(const std::vector<FixRecord>& fixes, const std::string& word) {
  return static_cast<std::size_t>(
      std::count_if(fixes.begin(), fixes.end(), [&](const FixRecord& f) { return verdict_word(f) == word; }));
}

std::vector<UpdateRecord> updates_of(const ObservationKind& kind, const std::vector<UpdateRecord>& all) {
  std::vector<UpdateRecord> out;
  std::copy_if(all.begin(), all.end(), std::back_inserter(out), [&](const UpdateRecord& u) { return u.kind == &kind; });
  return out;
}

// Median over the trajectory of one output sigma.
double median(const std::vector<NavRow>& rows, double (*value)(const NavRow&)) {
  std::vector<double> all(rows.size());
  std::transform(rows.begin(), rows.end(), all.begin(), value);
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return *middle;
}

Json number_or_null(const std::optional<double>& value, double unit = 1.0) {
  return value ? Json(*value * unit) : Json();
}

// What the final run found of the receiver, and of the noise of the IMU with it; null where its errors were taken for white.
void put_receiver(Json& json, const PreparedFlight& flight, const ReceiverFit* fit) {
  for (const char* key :
       {"gnss_velocity_latency_s", "gnss_velocity_latency_std_s", "gnss_latency_model_spread_s", "gnss_stamp_jitter_s",
        "gnss_white_std_scale", "gnss_correlation_time_s", "gnss_smoothing_time_s", "gnss_velocity_correlated_std_mps"})
    json[key] = nullptr;
  if (fit == nullptr) return;
  const ReceiverParameters& p = fit->parameters;
  const auto std_or_null = [](double std) { return std > 0.0 ? Json(std) : Json(); };
  json["gnss_latency_s"] = fit->latency.position_s;
  json["gnss_latency_time_s"] = fit->latency.time_s;
  json["gnss_latency_std_s"] = std_or_null(fit->latency.position_std_s);
  json["gnss_velocity_latency_s"] = fit->latency.velocity_s;
  json["gnss_velocity_latency_std_s"] = std_or_null(fit->latency.velocity_std_s);
  json["gnss_latency_model_spread_s"] = fit->latency_spread_s;
  json["gnss_stamp_jitter_s"] = p.jitter_s;
  json["gnss_std_scale"] = flight.gnss_std_scale * p.sigma_c;
  json["gnss_std_scale_std"] = nullptr;  // it is the file's word, not a finding
  json["gnss_white_std_scale"] = flight.gnss_std_scale * p.white_scale;
  json["gnss_velocity_std_scale"] = flight.gnss_std_scale * p.velocity_scale;
  json["gnss_velocity_std_scale_std"] = nullptr;
  json["gnss_correlation_time_s"] = p.tau_c_s;
  json["gnss_smoothing_time_s"] = p.tau_u_s;
  json["gnss_velocity_correlated_std_mps"] = p.sigma_s_mps;
  json["imu_noise_scale"] = flight.imu_noise_scale * p.gyro_scale;
  json["imu_noise_scale_std"] = nullptr;
  json["accel_noise_scale"] = p.accel_scale / p.gyro_scale;
  json["accel_noise_scale_std"] = nullptr;
}

// What the logs left open, as the run took it; a sigma is null where the value was given.
void put_parameters(Json& json, const PreparedFlight& flight, const HeadingResult& heading,
                    const ReceiverFit* receiver) {
  const FlightParameters& p = heading.parameters;
  const FlightParametersStd& std = heading.parameters_std;
  json["gnss_latency_s"] = flight.latency_s + p.latency_s;
  json["gnss_latency_std_s"] = number_or_null(std.latency_s);
  json["gnss_latency_time_s"] = flight.problem.t_start_s;
  json["clock_drift_ppm"] = 1e6 * p.clock_drift;
  json["clock_drift_std_ppm"] = number_or_null(std.clock_drift, 1e6);
  json["imu_noise_scale"] = flight.imu_noise_scale * p.imu_noise_scale;
  json["imu_noise_scale_std"] = number_or_null(std.imu_noise_scale, flight.imu_noise_scale);
  json["accel_noise_scale"] = p.accel_noise_scale;
  json["accel_noise_scale_std"] = number_or_null(std.accel_noise_scale);
  json["imu_turn_on_scale"] = p.turn_on_scale;
  json["gnss_std_scale"] = flight.gnss_std_scale * p.gnss_std_scale;
  json["gnss_std_scale_std"] = number_or_null(std.gnss_std_scale, flight.gnss_std_scale);
  json["gnss_velocity_std_scale"] = p.velocity_std_scale;
  json["gnss_velocity_std_scale_std"] = number_or_null(std.velocity_std_scale);
  put_receiver(json, flight, receiver);
}

}  // namespace

std::vector<std::string> run_warnings(const PreparedFlight& flight, const HeadingResult& heading,
                                      const ReceiverFit* receiver) {
  std::vector<std::string> warnings = flight.warnings;
  if (heading.verdict != "aligned") {
    warnings.push_back("the heading is " + heading.verdict + ": " + heading.advice +
                       (states_heading_std(heading) ? "" : "; the trajectory states no heading sigma"));
  }
  const auto mismatch = [&](const char* what, double scale) {
    if (scale <= 2.0) return;  // what the chance of some tens of fixes makes
    char text[64];
    std::snprintf(text, sizeof text, "%.1f", std::sqrt(scale));
    warnings.push_back(std::string("the ") + what + " of the fixes disagree with the filter by " + text +
                       " times what its noise model says, and the stated sigmas are too small by about as much; raise "
                       "imu.noise_scale, or check gnss.latency_s and the lever arm");
  };
  if (receiver == nullptr) {
    mismatch("positions", heading.gate_scales.position);
    mismatch("velocities", heading.gate_scales.velocity);
    return warnings;
  }
  constexpr double kJitter_s = 0.005;
  if (receiver->parameters.jitter_s > kJitter_s) {
    char text[160];
    std::snprintf(
        text, sizeof text,
        "the stamps of the fixes jitter by %.0f ms: at 10 m/s that is %.0f cm along the track; it is modelled, and "
        "better mended in the logger",
        1e3 * receiver->parameters.jitter_s, 1e3 * receiver->parameters.jitter_s);
    warnings.emplace_back(text);
  }
  return warnings;
}

std::string verdict_word(const FixRecord& fix) {
  switch (fix.use) {
    case RecordUse::averaged_at_rest:
      return "averaged_at_rest";
    case RecordUse::quality_not_accepted:
      return "quality_not_accepted";
    case RecordUse::outside_imu:
      return "outside_imu";
    case RecordUse::update:
      break;
  }
  if (!fix.position) return "outside_imu";
  switch (fix.position->verdict) {
    case Verdict::used:
      return "used";
    case Verdict::weighted:
      return "weighted";
    case Verdict::rejected:
      return "rejected";
    case Verdict::reacquired:
      return "reacquired";
  }
  return "";
}

std::string alignment_json(const PreparedFlight& flight, const HeadingResult& heading, const ReceiverFit* receiver) {
  Json json;
  json["heading_deg"] = heading.heading_rad * kRadToDeg;
  json["heading_std_deg"] = degrees(heading.sigma_rad);
  json["heading_95_deg"] = nullptr;
  if (heading.sigma_rad) {
    json["heading_95_deg"] =
        JsonArray{wrap_2pi(heading.posterior.low_rad) * kRadToDeg, wrap_2pi(heading.posterior.high_rad) * kRadToDeg};
  }
  json["heading_mean_deg"] = heading.posterior.mean_rad * kRadToDeg;
  json["verdict"] = heading.verdict;
  json["advice"] = heading.advice;
  json["start_time_s"] = flight.problem.t_start_s;
  json["end_time_s"] = flight.problem.t_end_s;
  json["start"] = flight.start;
  json["start_reason"] = flight.start_reason;
  json["settled"] = heading.settled;
  json["evaluations"] = heading.evaluations;
  put_parameters(json, flight, heading, receiver);
  json["nis_90"] = heading.nis_90;
  json["gate_scale_position"] = heading.gate_scales.position;
  json["gate_scale_velocity"] = heading.gate_scales.velocity;
  JsonArray modes;
  for (const HeadingMode& m : heading.modes())
    modes.push_back(JsonObject{{"heading_deg", m.heading_rad * kRadToDeg}, {"mass", m.mass}});
  json["modes"] = modes;
  JsonArray curve;
  for (const CurvePoint& p : heading.curve) {
    curve.push_back(JsonObject{{"heading_deg", p.heading_rad * kRadToDeg},
                               {"heading_std_deg", p.heading_std_rad * kRadToDeg},
                               {"gated", p.gated},
                               {"cost", p.cost},
                               {"gnss_latency_s", flight.latency_s + p.parameters.latency_s},
                               {"imu_noise_scale", flight.imu_noise_scale * p.parameters.imu_noise_scale},
                               {"gnss_std_scale", flight.gnss_std_scale * p.parameters.gnss_std_scale}});
  }
  json["curve"] = curve;
  JsonArray triple;
  for (const FitPoint& p : heading.triple)
    triple.push_back(JsonObject{{"heading_deg", wrap_2pi(p.x) * kRadToDeg}, {"cost", p.y}});
  json["parabola_points"] = triple;
  JsonArray density;
  for (const PosteriorSample& s : heading.posterior.samples) {
    density.push_back(
        JsonObject{{"heading_deg", s.heading_rad * kRadToDeg}, {"density_per_deg", std::exp(-s.cost) * kDegToRad}});
  }
  json["density"] = density;
  json["warnings"] = run_warnings(flight, heading, receiver);
  return dump_json(json) + "\n";
}

Json summary(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution) {
  Json json;
  json["version"] = LIEALIGN_VERSION;
  json["verdict"] = heading.verdict;
  json["heading_deg"] = heading.heading_rad * kRadToDeg;
  json["heading_std_deg"] = degrees(heading.sigma_rad);
  json["alignment_time_s"] = flight.problem.t_start_s;
  const TrajectoryDigest& trajectory = solution.digest;
  json["begin_time_s"] = trajectory.begin_s;
  json["end_time_s"] = trajectory.end_s;
  json["duration_s"] = trajectory.end_s - trajectory.begin_s;
  json["epochs"] = trajectory.epochs;
  json["gps_week"] = flight.config.gnss.week;
  json["imu_rate_hz"] = flight.imu_rate_hz;
  json["imu_gaps"] = flight.gaps.size();
  double gap_s = 0.0;
  for (const ImuGap& gap : flight.gaps) gap_s += gap.end_s - gap.begin_s;
  json["imu_gaps_s"] = gap_s;
  json["rests"] = flight.rests.size();
  json["fixes"] = solution.fixes.size();
  for (const char* word :
       {"used", "weighted", "rejected", "reacquired", "averaged_at_rest", "quality_not_accepted", "outside_imu"}) {
    json[std::string("fixes_") + word] = count(solution.fixes, word);
  }
  json["p_rms_m"] = solution.score.p_rms();
  json["nis_90"] = solution.score.nis_90();
  json["log_likelihood"] = -solution.score.negative_log_likelihood;
  json["heading_std_initial_deg"] = solution.heading_std_initial_rad * kRadToDeg;
  const ReceiverFit* receiver = solution.receiver ? &*solution.receiver : nullptr;
  put_parameters(json, flight, heading, receiver);
  json["gnss_error_model"] = receiver == nullptr ? "white" : "correlated";
  const std::vector<NavRow>& rows = trajectory.sample;
  json["median_std_horizontal_m"] =
      median(rows, [](const NavRow& r) { return std::hypot(r.std_p_n_m[0], r.std_p_n_m[1]); });
  json["median_std_down_m"] = median(rows, [](const NavRow& r) { return r.std_p_n_m[2]; });
  json["median_relative_std_horizontal_m"] =
      median(rows, [](const NavRow& r) { return std::hypot(r.relative_std_p_n_m[0], r.relative_std_p_n_m[1]); });
  json["median_relative_std_down_m"] = median(rows, [](const NavRow& r) { return r.relative_std_p_n_m[2]; });
  json["median_std_roll_deg"] = median(rows, [](const NavRow& r) { return r.std_rpy_rad[0] * kRadToDeg; });
  json["median_std_pitch_deg"] = median(rows, [](const NavRow& r) { return r.std_rpy_rad[1] * kRadToDeg; });
  json["median_std_heading_deg"] = median(rows, [](const NavRow& r) { return r.std_rpy_rad[2] * kRadToDeg; });
  json["warnings"] = run_warnings(flight, heading, receiver);
  return json;
}

std::string summary_json(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution) {
  return dump_json(summary(flight, heading, solution)) + "\n";
}

ResultFiles::ResultFiles(const std::string& folder, const PreparedFlight& flight, const HeadingResult& heading)
    : folder_(folder),
      flight_(flight),
      heading_(heading),
      smoothed_parts_(part_slots()),
      filtered_parts_(part_slots()) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw InputError(folder + ": the folder cannot be made: " + failure.message());
  const std::vector<std::string>& formats = flight.config.output.formats;
  const auto wants = [&](const char* format) {
    return std::find(formats.begin(), formats.end(), format) != formats.end();
  };
  text_ = {wants("csv"), true, wants("sbet")};
  if (text_.csv) begin_table("trajectory.csv", trajectory_columns());
  if (text_.sbet) {
    part("trajectory.sbet");
    part("trajectory.smrmsg");
  }
  if (flight.config.output.filtered) begin_table("filtered.csv", trajectory_columns());
  begin_table("biases.csv", bias_columns());
}

PartFile& ResultFiles::part(const char* name) {
  return files_.try_emplace(name, (std::filesystem::path(folder_) / name).string()).first->second;
}

void ResultFiles::begin_table(const char* name, const std::vector<CsvColumn>& columns) {
  std::string header;
  append_csv_header(header, columns);
  part(name).write(header);
}

EpochSink ResultFiles::smoothed() {
  return {[this](std::size_t slot, const std::vector<Epoch>& epochs) {
            append_epochs(smoothed_parts_[slot], text_, flight_, epochs, states_heading_std(heading_));
          },
          [this](std::size_t slot) {
            TrajectoryPart& made = smoothed_parts_[slot];
            for (auto [name, bytes] :
                 {std::pair{"trajectory.csv", &made.csv}, std::pair{"biases.csv", &made.biases},
                  std::pair{"trajectory.sbet", &made.sbet}, std::pair{"trajectory.smrmsg", &made.smrmsg}}) {
              if (!bytes->empty()) part(name).write(*bytes);
              bytes->clear();
            }
          }};
}

EpochSink ResultFiles::filtered() {
  return {[this](std::size_t slot, const std::vector<Epoch>& epochs) {
            append_epochs(filtered_parts_[slot], {.csv = true}, flight_, epochs, states_heading_std(heading_));
          },
          [this](std::size_t slot) {
            part("filtered.csv").write(filtered_parts_[slot].csv);
            filtered_parts_[slot].csv.clear();
          }};
}

void ResultFiles::finish(const Solution& solution) {
  if (text_.sbet) {
    part("trajectory.sbet.json")
        .write(dump_json(sbet_side_file(flight_, solution.digest, states_heading_std(heading_))) + "\n");
  }
  write_innovations_csv(part("innovations.csv"), solution.fixes);
  for (const ObservationKind* kind : observation_kinds()) {
    const std::vector<UpdateRecord> updates = updates_of(*kind, solution.others);
    if (updates.empty()) continue;
    write_updates_csv(part(("innovations_" + std::string(kind->name) + ".csv").c_str()), *kind, updates);
  }
  part("alignment.json").write(alignment_json(flight_, heading_, solution.receiver ? &*solution.receiver : nullptr));
  part("summary.json").write(summary_json(flight_, heading_, solution));
  part("config.toml").write(dump_config(files_relative_to(folder_, flight_.config)));
  for (auto& [name, file] : files_) file.finish();
  for (auto& [name, file] : files_) file.commit();

  // What an earlier run left would not belong to these results.
  std::error_code failure;
  for (const char* name : {"trajectory.csv", "trajectory.sbet", "trajectory.smrmsg", "trajectory.sbet.json",
                           "filtered.csv", "innovations_heading.csv", "innovations_barometer.csv", "report.html"}) {
    if (!files_.contains(name)) std::filesystem::remove(std::filesystem::path(folder_) / name, failure);
  }
}

void write_results(const std::string& folder, const PreparedFlight& flight, const HeadingResult& heading,
                   const Solution& solution) {
  ResultFiles files(folder, flight, heading);
  hand_on(solution.smoothed, files.smoothed());
  hand_on(solution.filtered, files.filtered());
  files.finish(solution);
}

}  // namespace liealign
