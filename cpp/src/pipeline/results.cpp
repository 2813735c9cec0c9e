// The result files.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/results.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/io/json.hpp"
#include "liealign/io/text_file.hpp"
#include "liealign/pipeline/config_files.hpp"
#include "liealign/pipeline/trajectory_files.hpp"

namespace liealign {
namespace {

constexpr double kInterval95 = 1.959963984540054;  // sigma of the 95 % interval

Json degrees(const std::optional<double>& rad) { return rad ? Json(*rad * kRadToDeg) : Json(); }

std::size_t count(const std::vector<FixRecord>& fixes, const std::string& word) {
  return static_cast<std::size_t>(
      std::count_if(fixes.begin(), fixes.end(), [&](const FixRecord& f) { return verdict_word(f) == word; }));
}

// Median over the epochs of one output sigma.
double median(const std::vector<Epoch>& epochs, double (*value)(const NavRow&)) {
  std::vector<double> all;
  const std::size_t stride = 1 + epochs.size() / 2000;  // a median needs no more
  for (std::size_t i = 0; i < epochs.size(); i += stride) all.push_back(value(nav_row(epochs[i])));
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return *middle;
}

void put_scales(Json& json, const PreparedFlight& flight) {
  json["gnss_latency_s"] = flight.latency_s;
  json["gnss_latency_std_s"] = nullptr;
  json["imu_noise_scale"] = flight.imu_noise_scale;
  json["imu_noise_scale_std"] = nullptr;
  json["gnss_std_scale"] = flight.gnss_std_scale;
  json["gnss_std_scale_std"] = nullptr;
}

}  // namespace

std::vector<std::string> run_warnings(const PreparedFlight& flight, const HeadingResult& heading) {
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
  mismatch("positions", heading.gate_scales.position);
  mismatch("velocities", heading.gate_scales.velocity);
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

std::string alignment_json(const PreparedFlight& flight, const HeadingResult& heading) {
  Json json;
  json["heading_deg"] = heading.heading_rad * kRadToDeg;
  json["heading_std_deg"] = degrees(heading.sigma_rad);
  json["heading_95_deg"] = nullptr;
  if (heading.sigma_rad) {
    const double half = kInterval95 * *heading.sigma_rad;
    json["heading_95_deg"] =
        JsonArray{wrap_2pi(heading.heading_rad - half) * kRadToDeg, wrap_2pi(heading.heading_rad + half) * kRadToDeg};
  }
  json["verdict"] = heading.verdict;
  json["advice"] = heading.advice;
  json["start_time_s"] = flight.problem.t_start_s;
  json["end_time_s"] = flight.problem.t_end_s;
  json["start"] = flight.start;
  json["settled"] = heading.settled;
  json["evaluations"] = heading.evaluations;
  put_scales(json, flight);
  json["nis_90"] = heading.nis_90;
  json["gate_scale_position"] = heading.gate_scales.position;
  json["gate_scale_velocity"] = heading.gate_scales.velocity;
  JsonArray modes;
  for (const HeadingMode& m : heading.modes)
    modes.push_back(JsonObject{{"heading_deg", m.heading_rad * kRadToDeg}, {"mass", m.mass}});
  json["modes"] = modes;
  JsonArray curve;
  for (const CurvePoint& p : heading.curve) {
    curve.push_back(JsonObject{{"heading_deg", p.heading_rad * kRadToDeg},
                               {"heading_std_deg", p.heading_std_rad * kRadToDeg},
                               {"gated", p.gated},
                               {"cost", p.cost}});
  }
  json["curve"] = curve;
  json["warnings"] = run_warnings(flight, heading);
  return dump_json(json) + "\n";
}

Json summary(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution) {
  Json json;
  json["version"] = LIEALIGN_VERSION;
  json["verdict"] = heading.verdict;
  json["heading_deg"] = heading.heading_rad * kRadToDeg;
  json["heading_std_deg"] = degrees(heading.sigma_rad);
  json["alignment_time_s"] = flight.problem.t_start_s;
  json["begin_time_s"] = solution.smoothed.front().t_s;
  json["end_time_s"] = solution.smoothed.back().t_s;
  json["duration_s"] = solution.smoothed.back().t_s - solution.smoothed.front().t_s;
  json["epochs"] = solution.smoothed.size();
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
  put_scales(json, flight);
  const std::vector<Epoch>& smoothed = solution.smoothed;
  json["median_std_horizontal_m"] =
      median(smoothed, [](const NavRow& r) { return std::hypot(r.std_p_n_m[0], r.std_p_n_m[1]); });
  json["median_std_down_m"] = median(smoothed, [](const NavRow& r) { return r.std_p_n_m[2]; });
  json["median_std_roll_deg"] = median(smoothed, [](const NavRow& r) { return r.std_rpy_rad[0] * kRadToDeg; });
  json["median_std_pitch_deg"] = median(smoothed, [](const NavRow& r) { return r.std_rpy_rad[1] * kRadToDeg; });
  json["median_std_heading_deg"] = median(smoothed, [](const NavRow& r) { return r.std_rpy_rad[2] * kRadToDeg; });
  json["warnings"] = run_warnings(flight, heading);
  return json;
}

std::string summary_json(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution) {
  return dump_json(summary(flight, heading, solution)) + "\n";
}

void write_results(const std::string& folder, const PreparedFlight& flight, const HeadingResult& heading,
                   const Solution& solution) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw InputError(folder + ": the folder cannot be made: " + failure.message());
  const std::filesystem::path at(folder);
  const std::vector<Epoch>& smoothed = solution.smoothed;
  const bool heading_std = states_heading_std(heading);
  const std::vector<std::string>& formats = flight.config.output.formats;
  const auto wants = [&](const char* format) {
    return std::find(formats.begin(), formats.end(), format) != formats.end();
  };

  // All of them are written before the first replaces one of an earlier run.
  std::map<std::string, PartFile> files;
  const auto part = [&](const char* name) -> PartFile& {
    return files.try_emplace(name, (at / name).string()).first->second;
  };
  if (wants("csv")) write_trajectory_csv(part("trajectory.csv"), smoothed, heading_std);
  if (wants("sbet")) {
    write_trajectory_sbet(part("trajectory.sbet"), flight, smoothed);
    write_trajectory_smrmsg(part("trajectory.smrmsg"), smoothed, heading_std);
    part("trajectory.sbet.json").write(dump_json(sbet_side_file(flight, smoothed, heading_std)) + "\n");
  }
  if (!solution.filtered.empty()) write_trajectory_csv(part("filtered.csv"), solution.filtered, heading_std);
  write_biases_csv(part("biases.csv"), smoothed);
  write_innovations_csv(part("innovations.csv"), solution.fixes);
  part("alignment.json").write(alignment_json(flight, heading));
  part("summary.json").write(summary_json(flight, heading, solution));
  part("config.toml").write(dump_config(files_relative_to(folder, flight.config)));
  for (auto& [name, file] : files) file.finish();
  for (auto& [name, file] : files) file.commit();

  // What an earlier run left would not belong to these results.
  for (const char* name : {"trajectory.csv", "trajectory.sbet", "trajectory.smrmsg", "trajectory.sbet.json",
                           "filtered.csv", "report.html"}) {
    if (!files.contains(name)) std::filesystem::remove(at / name, failure);
  }
}

}  // namespace liealign
