// What a front end prints of a run.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/run_text.hpp"

#include <cstdint>
#include <cstdio>
#include <utility>

#include "liealign/core/units.hpp"
#include "liealign/pipeline/config_files.hpp"

namespace liealign {
namespace {

std::string fixed(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3f", value);
  return text;
}

std::string fixes_text(Json& numbers) {
  const auto count = [&](const std::string& key) { return std::get<std::int64_t>(numbers[key].value); };
  std::string text = std::to_string(count("fixes")) + ": ";
  const char* comma = "";
  for (const char* word : {"used", "weighted", "rejected", "reacquired"}) {
    text += comma + std::to_string(count(std::string("fixes_") + word)) + " " + word;
    comma = ", ";
  }
  for (const auto& [key, words] : {std::pair{"fixes_averaged_at_rest", " averaged at rest"},
                                   {"fixes_quality_not_accepted", " quality not accepted"},
                                   {"fixes_outside_imu", " outside the IMU log"}}) {
    if (count(key) > 0) text += ", " + std::to_string(count(key)) + words;
  }
  return text;
}

}  // namespace

std::vector<TextLine> alignment_text(const PreparedFlight& flight, const HeadingResult& heading,
                                     const ReceiverFit* receiver) {
  std::string found = "not determined";
  if (heading.sigma_rad) {
    found = fixed(heading.heading_rad * kRadToDeg) + " deg, sigma " + fixed(*heading.sigma_rad * kRadToDeg) + " deg";
  }
  std::vector<TextLine> lines = {
      {"heading", heading.verdict + ": " + found + ", at " + fixed(flight.problem.t_start_s) + " s"}};
  if (heading.verdict != "aligned") lines.push_back({"", heading.advice});
  lines.push_back({"start", flight.start + ": " + flight.start_reason});
  if (receiver != nullptr) {
    const ReceiverLatency& l = receiver->latency;
    if (l.position_std_s > 0.0)
      lines.push_back(
          {"latency", fixed(l.position_s) + " s, sigma " + fixed(l.position_std_s) + " s, of the positions"});
    if (l.velocity_std_s > 0.0)
      lines.push_back({"", fixed(l.velocity_s) + " s, sigma " + fixed(l.velocity_std_s) + " s, of the velocities"});
  } else if (heading.parameters_std.latency_s) {
    lines.push_back({"latency", fixed(flight.latency_s + heading.parameters.latency_s) + " s, sigma " +
                                    fixed(*heading.parameters_std.latency_s) + " s, of the GNSS stamps"});
  }
  if (heading.parameters_std.clock_drift && heading.parameters.clock_drift != 0.0)
    lines.push_back({"clock drift", fixed(1e6 * heading.parameters.clock_drift) + " ppm, sigma " +
                                        fixed(1e6 * *heading.parameters_std.clock_drift) + " ppm"});
  for (const std::string& warning : run_warnings(flight, heading, receiver)) lines.push_back({"warning", warning});
  return lines;
}

std::vector<TextLine> run_text(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution,
                               const std::string& folder) {
  Json numbers = summary(flight, heading, solution);
  const auto number = [&](const char* key) { return fixed(std::get<double>(numbers[key].value)); };
  std::vector<TextLine> lines = alignment_text(flight, heading, solution.receiver ? &*solution.receiver : nullptr);
  lines.push_back({"fixes", fixes_text(numbers)});
  if (solution.score.positions > 0) {
    lines.push_back({"P_RMS", number("p_rms_m") + " m, of the position innovations"});
  }
  lines.push_back({"sigma", "median " + number("median_std_horizontal_m") + " m horizontal, " +
                                number("median_std_down_m") + " m vertical, " + number("median_std_roll_deg") +
                                " deg roll, " + number("median_std_pitch_deg") + " deg pitch, " +
                                number("median_std_heading_deg") + " deg heading"});
  if (solution.receiver) {
    lines.push_back({"", "median " + number("median_relative_std_horizontal_m") + " m horizontal, " +
                             number("median_relative_std_down_m") + " m vertical, in the receiver's own datum"});
  }
  lines.push_back({"span", number("begin_time_s") + " s to " + number("end_time_s") + " s, " +
                               std::to_string(solution.digest.epochs) + " epochs"});
  const std::string trajectory = "/trajectory." + flight.config.output.formats.front();
  lines.push_back({"results", plain_path(folder + trajectory) + ", summary.json and the other files beside it"});
  return lines;
}

}  // namespace liealign
