// Geodetic coordinates to ECEF and back, and the local north-east-down axes.
//
// Latitude and longitude in rad, height above the ellipsoid in m, ECEF in m.
// Round trip ECEF -> geodetic -> ECEF: below 5 nm for heights from -10 km to 10 000 km (tested).
// Source: Groves (2013) 2.4.3; inverse by Bowring's iteration on the parametric latitude, without angles on the way.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/types.hpp"

namespace liealign {

struct Geodetic {
  double lat_rad = 0.0;
  double lon_rad = 0.0;   // (-pi, pi]
  double height_m = 0.0;  // above the ellipsoid
};

// p_eb_e of a geodetic position.                                                          (Eq. 9)
Vector3d ecef_from_geodetic(const Geodetic& g);

// Geodetic position of p_eb_e; any point farther than 400 km from the centre of the Earth.
Geodetic geodetic_from_ecef(const Vector3d& p_eb_e);

// C_n_e: north-east-down axes at a latitude and longitude, columns in ECEF.
Matrix3d C_n_e(double lat_rad, double lon_rad);
Matrix3d C_n_e(const Vector3d& p_eb_e);

// Position and axes at p_eb_e, found together.
struct LocalFrame {
  Geodetic position;
  Matrix3d C_n_e;
};
LocalFrame local_frame(const Vector3d& p_eb_e);

// Roll, pitch, yaw (ZYX, rad; yaw in (-pi, pi]) of C_b_n, and back.
Vector3d rpy_from_C_b_n(const Matrix3d& C_b_n);
Matrix3d C_b_n_from_rpy(const Vector3d& rpy_rad);

}  // namespace liealign
