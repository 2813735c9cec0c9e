// A flight as read, and as the filters take it: prepared IMU, fixes on true time, rests, the alignment problem.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "liealign/align/candidates.hpp"
#include "liealign/align/coarse.hpp"
#include "liealign/align/heading_search.hpp"
#include "liealign/ins/baro.hpp"
#include "liealign/ins/prepare_imu.hpp"
#include "liealign/pipeline/config.hpp"

namespace liealign {

struct Flight {
  Config config;
  ImuSeries imu;                 // as logged
  std::vector<GnssRecord> gnss;  // as logged
  std::vector<std::string> warnings;
  std::vector<BaroRecord> baro = {};  // as logged; empty without baro.file
};

// Reads imu.file, gnss.file and, where given, baro.file. Throws InputError (file:line:column) or ConfigError when a file
// is not named or the std of a heading guess is given without the guess.
Flight read_flight(const Config& config);

// A record, number `index` of its log, as a fix: ECEF, on true time, with its std scaled and not below the floors of [gnss].
GnssFix fix_from_record(const GnssRecord& r, std::size_t index, const Config& config, double latency_s, double scale);

// Why a GNSS record is or is not an update of the filter.
enum class RecordUse { update, averaged_at_rest, quality_not_accepted, outside_imu };

struct PreparedFlight {
  Config config;
  FlightData data;                // of the final run
  AlignmentProblem problem;       // with the fixes and the filter options of the candidates
  FilterOptions filter;           // of the final run
  std::vector<RestPeriod> rests;  // all that were found; the first and the last give updates
  std::vector<ImuGap> gaps;
  std::vector<RecordUse> record_use;    // per GNSS record
  std::vector<double> record_time_s;    // per GNSS record: true time
  std::vector<Vector3d> record_p_ea_e;  // per GNSS record: the antenna as measured, m
  double t_begin_s = 0.0;               // the run begins: start of the initial rest
  double imu_rate_hz = 0.0;
  double latency_s = 0.0;  // that the fixes have been shifted by: as given, or of the coarse stage
  double imu_noise_scale = 1.0;
  double gnss_std_scale = 1.0;
  std::string start = "static";  // how the run starts: static or moving
  std::string start_reason;      // why, one sentence
  CoarseAlignment coarse;
  std::vector<std::string> warnings;
  std::vector<GnssRecord> gnss;  // as logged
  std::vector<BaroRecord> baro;  // likewise
};

// Throws InputError when IMU and GNSS do not overlap or a start at rest is wanted where there is none, ConfigError as above.
// A flight that is moved in gives its IMU series, which is the bulk of it: prepare_flight(read_flight(config)) copies none.
PreparedFlight prepare_flight(Flight flight);

// The fixes of the candidates of a problem that ends at t_end_s: those that stay inside whatever latency is tried.
FlightData scored_data(const PreparedFlight& flight, double t_end_s);

// The options that the keys of [align], "auto" and the coarse stage stand for.
HeadingSearchOptions heading_search_options(const PreparedFlight& flight);

}  // namespace liealign
