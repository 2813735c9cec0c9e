// SBET and SMRMSG, the binary trajectory files of Applanix: records of little-endian doubles without a header.
// Layout: PDAL, io/SbetCommon.hpp and io/SbetSmrmsgReader.cpp; NOAA, HSTB/drivers/sbet.py.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace liealign {

// In the order of the file: 17 doubles, 136 bytes.
struct SbetRecord {
  double time_s;
  double lat_rad, lon_rad, height_m;
  double v_mps[3];             // along the axes of the wander frame; north, east, down where the angle is 0
  double roll_rad, pitch_rad;  // body to level
  double platform_heading_rad;
  double wander_angle_rad;  // true heading = platform heading - wander angle
  double a_b_mps2[3];
  double omega_b_rps[3];
};
static_assert(sizeof(SbetRecord) == 17 * sizeof(double));

// One sigma: 10 doubles, 80 bytes.
struct SmrmsgRecord {
  double time_s;
  double std_p_n_m[3], std_v_n_mps[3];
  double std_rpy_arcmin[3];
};
static_assert(sizeof(SmrmsgRecord) == 10 * sizeof(double));

// Append a record to `out`: for callers that make parts of a file apart and give them to PartFile::write in order.
void append_sbet(std::string& out, const SbetRecord& record);
void append_smrmsg(std::string& out, const SmrmsgRecord& record);

}  // namespace liealign
