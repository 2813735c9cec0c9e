// The tables of a run as CSV, and its trajectory as SBET with SMRMSG and the side file that says what they cannot.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "liealign/io/csv.hpp"
#include "liealign/io/json.hpp"
#include "liealign/pipeline/process.hpp"

namespace liealign {

// Where the data do not determine the heading, the filter's sigma is that of its start, and says nothing.
bool states_heading_std(const HeadingResult& heading);

// Columns of trajectory.csv and filtered.csv, and of biases.csv.
std::vector<CsvColumn> trajectory_columns();
std::vector<CsvColumn> bias_columns();

// The files with a row for each epoch. Which of them are wanted, and a part of each on its way there.
struct TrajectoryText {
  bool csv = false, biases = false, sbet = false;
};
struct TrajectoryPart {
  std::string csv, biases, sbet, smrmsg;
};

// Appends a run of epochs, which follow each other on stamps of the IMU.
//   SBET: wander angle 0: platform heading is true heading, velocity is north, east, down. Acceleration and rate are those
// of the IMU against the Earth, along the axes of the trajectory:
//   a = C_b_r (f_ib_b - b_a + C_e_b (g_e - 2 omega_ie_e x v_eb_e)),  omega = C_b_r (omega_ib_b - b_g - C_e_b omega_ie_e)  (Eq. 49)
//   SMRMSG: a heading without sigma has 10800 arc-minutes there: half a circle.
void append_epochs(TrajectoryPart& part, const TrajectoryText& wanted, const PreparedFlight& flight,
                   const std::vector<Epoch>& epochs, bool heading_std);

// innovations.csv.
void write_innovations_csv(PartFile& file, const std::vector<FixRecord>& fixes);

// innovations_<kind>.csv, of one other kind: residual and sigma of each of its rows in its own units, NIS and weight.
void write_updates_csv(PartFile& file, const ObservationKind& kind, const std::vector<UpdateRecord>& updates);

// trajectory.sbet.json: week, time scale, datum, frame, reference point.
Json sbet_side_file(const PreparedFlight& flight, const TrajectoryDigest& trajectory, bool heading_std);

}  // namespace liealign
