// The result files of a run: trajectory.csv, filtered.csv, biases.csv, innovations.csv, alignment.json, summary.json and
// config.toml in one folder. Their names and columns are the contract with scripts; see docs/formats.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "liealign/io/json.hpp"
#include "liealign/pipeline/process.hpp"

namespace liealign {

// What a user should know: the flight's warnings, and how far the fixes disagree with the noise model.
std::vector<std::string> run_warnings(const PreparedFlight& flight, const HeadingResult& heading);

// The word of innovations.csv for what became of a GNSS record.
std::string verdict_word(const FixRecord& fix);

// alignment.json: heading at start_time_s, its sigma and interval, verdict, modes, curve, latency and scales. Keys of
// estimates that were not made are null.
std::string alignment_json(const PreparedFlight& flight, const HeadingResult& heading);

// summary.json: one number per key, units in the keys; as a tree and as its text.
Json summary(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution);
std::string summary_json(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution);

// Writes every file into the folder, which is made if need be. Each file appears whole or not at all. The file names
// in config.toml are relative to the folder, so that it runs again from there.
void write_results(const std::string& folder, const PreparedFlight& flight, const HeadingResult& heading,
                   const Solution& solution);

}  // namespace liealign
