// Reference of a flight along given points: cubic splines through positions and Euler angles.
//
//   y(t) = y_i + b_i s + M_i s^2 / 2 + (M_{i+1} - M_i) s^3 / (6 h_i),   s = t - t_i,   h_i = t_{i+1} - t_i
//   b_i  = d_i - h_i (2 M_i + M_{i+1}) / 6,   d_i = (y_{i+1} - y_i) / h_i
//   h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (d_i - d_{i-1}),   M_0 = M_1,  M_N = M_{N-1}   (Eq. 67)
//
// y: ECEF position from the first point, roll, pitch and heading, the angles unwrapped. v_eb_e is the derivative of the
// position, which so is the integral of its velocity, as (Eq. 42) wants it; attitude is C_n_e(p) C_b_n(roll, pitch, heading).
// Second derivatives are continuous: force and rate do not jump. With the ends as they are (parabolic run-out) a
// constant acceleration is met to the last interval, and uneven intervals there do no harm. Source: de Boor (1978), ch. 4.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/core/types.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {

// Where the IMU is, and how its body axes stand against the local NED.
struct TrackPoint {
  double t_s = 0.0;
  double lat_rad = 0.0;
  double lon_rad = 0.0;
  double height_m = 0.0;                // above the ellipsoid
  Vector3d rpy_rad = Vector3d::Zero();  // roll, pitch, heading (ZYX); roll and heading modulo 2 pi
};

// (Eq. 67) at rate_hz * oversample from the time of the first point, to be given to truth_from_reference with the same
// oversample; the last epoch is the last IMU sample inside the track (to a thousandth of a sample). What moves faster than
// the points tell is not in it. The rounding of the points is: r rms at an interval h makes an acceleration of 4 r / h^2
// rms, most of it above 1 / 4h.
//
// Throws Error for fewer than four points, a value that is not finite, a latitude beyond 90 deg, a height outside -1 to
// 100 km, times that do not increase, intervals above 2 s, a pitch within 0.5 deg of +-90 deg, where Euler angles are singular,
// a roll or heading that changes by more than 170 deg in an interval and so could have gone either way, an acceleration above
// 200 m/s^2, a rate outside 1 to 10000 Hz, oversample below 1, and a track of less than one IMU sample or more than 2e7 fine
// steps.
std::vector<TruthEpoch> track_reference(const std::vector<TrackPoint>& track, double rate_hz, int oversample);

// truth_from_reference(track_reference(track, rate_hz, oversample), kind, model, oversample).
Truth track_truth(const std::vector<TrackPoint>& track, double rate_hz, int oversample, Mechanization kind,
                  GravityModel model);

}  // namespace liealign
