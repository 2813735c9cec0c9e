// Truth of a simulated flight: states on SE_2(3), and the perfect IMU that belongs to them.
//
//   u_k = inverse_mechanize(X_{k-1}, X_k^ref),   X_k = mechanize(X_{k-1}, u_k)                 (Eq. 42)
//   w_k = sum_j w_j dt_j / sum_j dt_j,   f_k = sum_j f_j dt_j / sum_j dt_j                      (Eq. 43)
//
// (Eq. 42) follows the reference in attitude and velocity; its position row is dropped, the position is the mechanized
// one. (Eq. 43) is the mean over the fine steps of one IMU sample: what an integrating IMU reports.
// Source: TAES (32)-(33) for `paper` (with C_e_b omega_ie, missing in print) and their exact counterpart for `exact`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "liealign/core/types.hpp"
#include "liealign/earth/gravity.hpp"
#include "liealign/ins/imu.hpp"
#include "liealign/ins/mechanization.hpp"
#include "liealign/lie/se23.hpp"

namespace liealign {

// X = (C_b_e, v_eb_e [m/s], p_eb_e [m]) at t_s.
struct TruthEpoch {
  double t_s = 0.0;
  SE23<double> X;
};

// imu[k] is the perfect mean rate and specific force over (epochs[k-1].t_s, epochs[k].t_s]; imu[0] only marks the
// start: the values of imu[1] at epochs[0].t_s. epochs and imu have the same length.
//
// With oversample = 1 the samples are the constant rates that take one epoch exactly to the next: mechanizing epochs[0]
// with them gives epochs[k] to rounding. They are what prepare_imu() would return, so give them to a filter as they
// are: a coning correction on top would spoil them.
//
// With oversample > 1 the samples are true means, as in a log of a real IMU: pass them through
// prepare_imu(..., ImuSampleKind::mean, ...) first. Mechanizing the result reproduces the truth up to what the
// two-sample corrections leave: 1e-7 rad, 5e-5 m/s, 5 mm after 300 s of the default drone flight at 200 Hz.
struct Truth {
  std::vector<TruthEpoch> epochs;
  ImuSeries imu;
};

// (Eq. 42)-(Eq. 43). The reference is at `oversample` times the rate of the IMU wanted; every oversample-th epoch of
// the truth is kept. Attitude and velocity are those of the reference. With `exact` so is the position (0.04 mm over
// the default drone flight) if that of the reference is the integral of its velocity; with `paper`, which leaves out
// dt/2 sum (w x v) dt, it drifts (0.17 m at 200 Hz). `paper` is only its own truth with oversample = 1: its steps do
// not compose into a longer one. Stamps: seconds of a week or of a flight; Unix times are too coarse for fine steps.
// Throws Error for fewer than two epochs kept, a reference that does not end on a sample, or stamps that do not
// increase.
Truth truth_from_reference(const std::vector<TruthEpoch>& reference, Mechanization kind, GravityModel model,
                           int oversample = 1);

// What a DroneFlight does between its parked phases.
//   survey       the whole of a mission, as told below
//   lines        climb, nose turned, lines back and forth flown crabwise, hover, return, landing
//   circles      the same with level circles, helical with climbing ones, rectangular with the sides of a rectangle
//   hover        climb, hover, landing
//   parked       nothing
enum class FlightKind { survey, lines, circles, helical, rectangular, hover, parked };

// The kind of that name, and the name of a kind. Throws Error for another name.
FlightKind flight_kind(const std::string& name);
std::string flight_kind_name(FlightKind kind);

// A multirotor flight. The survey: parked, vertical take-off, short hover, transit at the parked heading, parallel lines
// flown crabwise back and forth, hover, two circles (helices) with turning heading, return, landing, parked.
//
// When duration_s is too short for all of it, circles, hover, transit and lines are cut in this order; what is left
// over goes into the hover before the return. The other kinds fly as many lines, circles or sides as there is time for.
// Positive angles are clockwise seen from above.
struct DroneFlight {
  FlightKind kind = FlightKind::survey;
  double lat_deg = 48.2;  // of the pad
  double lon_deg = 16.37;
  double height_m = 200.0;  // of the pad, above the ellipsoid
  double rate_hz = 200.0;   // of the IMU
  int oversample = 8;       // fine steps per IMU sample; the reference is at rate_hz * oversample
  double start_time_s = 1000.0;
  double duration_s = 300.0;  // all of it, parked phases included
  double parked_before_s = 40.0;
  double parked_after_s = 20.0;
  double parked_roll_deg = 0.8;
  double parked_pitch_deg = -1.1;
  double heading_deg = 137.0;  // parked and in transit
  double speed_mps = 6.0;      // horizontal
  double climb_mps = 4.0;
  double descent_mps = 3.0;
  double altitude_m = 40.0;        // above the pad
  double acceleration_mps2 = 4.0;  // peak of the commanded motion on the straight; circles take 5/8 of it
  double line_bearing_deg = 30.0;
  double line_length_m = 60.0;
  double line_spacing_m = 15.0;  // and the other side of a rectangle
  double crab_deg = 40.0;        // nose against the bearing of the lines: + on the first two, - on the next two, ...
  double circle_radius_m = 0.0;  // 0 = what the acceleration allows, but at least 12 m
  double helix_climb_mps = 0.5;
  bool clockwise = true;      // circles, helices and rectangles, seen from above; the survey has one circle of each
  double nose_follows = 1.0;  // of every turn of their course the nose takes this share: 0 = it stays, 1 = it follows
  double drag_per_s = 0.15;   // linear drag: tilt holds against drag_per_s * (v - wind)
  double wind_mps = 0.0;      // steady; the tilt holds against it
  double wind_from_deg = 0.0;
  double gust_mps2 = 0.3;            // rms of the acceleration by gusts, per horizontal axis; half of it vertically
  double attitude_wobble_deg = 1.0;  // rms on roll and pitch, half of it on heading, 0.3 to 3 Hz
  double max_tilt_deg = 35.0;        // refused beyond
  std::uint64_t seed = 1;            // of gusts and wobble
};

// A flight of that kind as the seed has it: place, headings, speeds, accelerations and sizes are drawn. The nose has nothing
// to do with the course. 5 m/s are reached within 20 s of the take-off; a gentle flight accelerates by 0.1 to 0.3 m/s^2 at
// most and is as slow as that asks for. Neither hover nor parked shows the heading: no wind, no tilt, accelerations
// below 0.005 m/s^2 across the vertical. 30 s parked before the take-off; durations as in DroneFlight.
DroneFlight random_flight(FlightKind kind, bool gentle, std::uint64_t seed);

// Reference of the flight at rate_hz * oversample, to be given to truth_from_reference with the same oversample:
// commanded velocity -> three moving averages -> acceleration a and, with drag c, wind w and gravity g, the attitude
// of a multirotor,
//   z_b = (g - a - c (v - w)) / |g - a - c (v - w)|,  heading as commanded                                  (Eq. 44)
// plus wobble. While parked, velocity is exactly zero and attitude exactly constant. The working frame is the NED frame
// of the pad, fixed to the Earth. Throws Error when duration_s is too short for a flight, a field is out of range, or
// the flight would tilt more than max_tilt_deg.
std::vector<TruthEpoch> drone_reference(const DroneFlight& flight);

// truth_from_reference(drone_reference(flight), kind, model, flight.oversample).
Truth drone_truth(const DroneFlight& flight, Mechanization kind, GravityModel model);

// Random numbers that are the same on every platform: the 64-bit Mersenne Twister (its output is laid down by the C++
// standard) and own transforms (those of <random> are not). `stream` separates the users of one seed.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t stream);
  double uniform();    // [0, 1), 53 bits
  double normal();     // N(0, 1), Box-Muller
  Vector3d normal3();  // three of them
  Vector3d unit3();    // a direction, uniform on the sphere

 private:
  std::mt19937_64 engine_;
  double spare_ = 0.0;  // Box-Muller makes two at a time
  bool has_spare_ = false;
};

}  // namespace liealign
