// Solution files of RTKLIB (.pos): latitude, longitude and height or ECEF, with covariance, quality and velocity.
//
// Axes a of the file: north, east, up, or x, y, z of ECEF. Its off-diagonal columns, in the order ne, eu, un or
// xy, yz, zx, are signed roots s of covariances: c = s |s|. With C_a_n the axes in NED,
// P_n = C_a_n P_a C_a_n^T; C_a_n = diag(1, 1, -1) for north, east, up and C_e_n for ECEF.
// Source: RTKLIB 2.4.3, src/solution.c (outpos, outecef, outsolheads).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "liealign/ins/gnss.hpp"

namespace liealign {

enum class RtklibPosForm { llh_deg, llh_dms, ecef };

struct RtklibPos {
  // t_s is GPS seconds of the week of the first record and goes on past the end of that week (604800, 604801, ...),
  // so that a flight across Saturday midnight keeps one scale. fix is Q.
  std::vector<GnssRecord> records;
  int week = 0;            // GPS week of t_s = 0, without rollover
  std::string time_label;  // as the file says: GPST, UTC or JST; t_s is GPST in each case
  bool week_tow = false;   // times were written as week and seconds, not as date and time of day
  RtklibPosForm form = RtklibPosForm::llh_deg;
  bool has_velocity = false;   // the file has the columns; records without a solution for it have no velocity
  bool height_stated = false;  // ECEF, or the header says that the height is ellipsoidal; else it is assumed
};

// Reads the text that RTKLIB (RTKPOST, rnx2rtkp, RTKNAVI) or Emlid Studio writes, in any order of columns, with any
// separator, LF or CRLF. Needs the header line with the names of the columns.
// Throws InputError `path:line:column: text` (column: the cell, counted from 1; date and time of day are two) for the
// first thing it cannot use: heights above the geoid, a datum other than WGS 84, e/n/u-baseline, NMEA, times that go
// back or repeat with other values, a date before 1980-01-06, a standard deviation that is not above 0, a covariance
// that is not positive definite, a file without records.
// Drops records without solution (Q = 0) and exact repetitions. Takes a velocity of zeros with zero sigmas, which
// RTKLIB writes when it has none, for none. The warnings count these; the first one states what was assumed.
RtklibPos read_rtklib_pos(const std::string& path, std::vector<std::string>& warnings);

// Whether the name ends in .pos, or the first line that is not blank starts with '%'. False for a file that cannot be
// read, and for a pipe, which is told by its name alone.
bool looks_like_rtklib_pos(const std::string& path);

}  // namespace liealign
