// The tables of a run as CSV, and its trajectory as SBET with SMRMSG and the side file that says what they cannot.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/io/json.hpp"
#include "liealign/io/text_file.hpp"
#include "liealign/pipeline/process.hpp"

namespace liealign {

// Where the data do not determine the heading, the filter's sigma is that of its start, and says nothing.
bool states_heading_std(const HeadingResult& heading);

// trajectory.csv and filtered.csv.
void write_trajectory_csv(PartFile& file, const std::vector<Epoch>& epochs, bool heading_std);

// biases.csv.
void write_biases_csv(PartFile& file, const std::vector<Epoch>& epochs);

// innovations.csv.
void write_innovations_csv(PartFile& file, const std::vector<FixRecord>& fixes);

// trajectory.sbet. Wander angle 0: platform heading is true heading, velocity is north, east, down. Acceleration and
// rate are those of the IMU against the Earth, along the axes of the trajectory:
//   a = C_b_r (f_ib_b - b_a + C_e_b (g_e - 2 omega_ie_e x v_eb_e)),  omega = C_b_r (omega_ib_b - b_g - C_e_b omega_ie_e)  (Eq. 49)
void write_trajectory_sbet(PartFile& file, const PreparedFlight& flight, const std::vector<Epoch>& epochs);

// trajectory.smrmsg. A heading without sigma has 10800 arc-minutes there: half a circle.
void write_trajectory_smrmsg(PartFile& file, const std::vector<Epoch>& epochs, bool heading_std);

// trajectory.sbet.json: week, time scale, datum, frame, reference point.
Json sbet_side_file(const PreparedFlight& flight, const std::vector<Epoch>& epochs, bool heading_std);

}  // namespace liealign
