// GNSS data: rows as a file gives them, and fixes as the filter uses them (ECEF, metres, true time).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "liealign/core/types.hpp"

namespace liealign {

// One row of gnss.csv (or of another GNSS file), in SI and radians, before latency, scale and floors.
struct GnssRecord {
  double t_s = 0.0;
  double lat_rad = 0.0;
  double lon_rad = 0.0;
  double height_m = 0.0;               // above the ellipsoid
  Matrix3d P_n_m2 = Matrix3d::Zero();  // position covariance, NED
  bool has_velocity = false;
  Vector3d v_n_mps = Vector3d::Zero();  // NED
  bool has_velocity_std = false;
  Vector3d std_v_n_mps = Vector3d::Zero();  // NED
  bool has_heading = false;
  double heading_rad = 0.0;
  double std_heading_rad = 0.0;
  int fix = -1;          // RTKLIB's Q (0 none, 1 fixed, 2 float, ...); -1 when the file has no such column
  std::size_t line = 0;  // line in the file, for messages
};

// One fix in the frame of the filter. t_s is the true time: stamp minus latency.
struct GnssFix {
  double t_s = 0.0;
  Vector3d p_ea_e = Vector3d::Zero();  // antenna position, m
  Matrix3d R_p_e = Matrix3d::Zero();   // its covariance, ECEF, m^2
  bool has_velocity = false;
  Vector3d v_ea_e = Vector3d::Zero();  // antenna velocity, m/s
  Matrix3d R_v_e = Matrix3d::Zero();   // its covariance, ECEF, (m/s)^2
  std::size_t record = 0;              // index of the GnssRecord it came from
};

}  // namespace liealign
