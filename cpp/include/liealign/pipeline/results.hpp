// The result files of a run: trajectory.csv, filtered.csv, biases.csv, innovations.csv, alignment.json, summary.json and
// config.toml in one folder. Their names and columns are the contract with scripts; see docs/formats.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "liealign/io/json.hpp"
#include "liealign/pipeline/trajectory_files.hpp"

namespace liealign {

// What a user should know: the flight's warnings, and how far the fixes disagree with the noise model.
std::vector<std::string> run_warnings(const PreparedFlight& flight, const HeadingResult& heading,
                                      const ReceiverFit* receiver = nullptr);

// The word of innovations.csv for what became of a GNSS record.
std::string verdict_word(const FixRecord& fix);

// alignment.json: heading at start_time_s, its sigma and interval, verdict, modes, curve, latency and scales. Keys of
// estimates that were not made are null. `receiver`: what the final run found of latencies and noise, where there was one.
std::string alignment_json(const PreparedFlight& flight, const HeadingResult& heading,
                           const ReceiverFit* receiver = nullptr);

// summary.json: one number per key, units in the keys; as a tree and as its text.
Json summary(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution);
std::string summary_json(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution);

// The files of a run, written while it is under way: their bytes go to .part files that replace what stood there when all
// are complete, and are removed if it comes to nothing. The file names in config.toml are relative to the folder, so that
// it runs again from there.
// Throws InputError when the folder cannot be made or a file not written.
class ResultFiles {
 public:
  // Flight and heading must outlive it.
  ResultFiles(const std::string& folder, const PreparedFlight& flight, const HeadingResult& heading);

  // For process().
  EpochSink smoothed();
  EpochSink filtered();

  // Writes the rest, and puts every file in its place.
  void finish(const Solution& solution);

 private:
  PartFile& part(const char* name);
  void begin_table(const char* name, const std::vector<CsvColumn>& columns);

  std::string folder_;
  const PreparedFlight& flight_;
  const HeadingResult& heading_;
  TrajectoryText text_;
  std::map<std::string, PartFile> files_;
  std::vector<TrajectoryPart> smoothed_parts_, filtered_parts_;  // by slot
};

// All at once, of a solution that holds its trajectories.
void write_results(const std::string& folder, const PreparedFlight& flight, const HeadingResult& heading,
                   const Solution& solution);

}  // namespace liealign
