// What a Monte Carlo study repeats: one flight with other sensor errors in each run, and the filters that are compared on it.
// Source: TAES V-B and V-D.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "liealign/pipeline/simulated_flight.hpp"
#include "liealign/simulate/track_reference.hpp"

namespace liealign {

struct StudyCase {
  DroneFlight flight;             // the same in all runs
  std::vector<TrackPoint> track;  // flown instead, at the rate and oversample of `flight`, when there are any
  GnssErrors gnss;
  ImuErrorSizes imu;
  TypedInErrors typed_in;  // drawn anew in each run
  Config config;           // noise profile, P_0, filter; the lever arm is that of gnss, as it is typed in
  std::vector<std::string> models = {"lie", "mekf", "euler"};  // filter.model of each filter
  // aligned: levelled at rest, the heading from the alignment, zero-velocity and zero-rate updates while parked;
  // drawn: X_true = X_hat exp(eps) at the first sample, eps ~ N(0, P_0), fixes alone.
  std::string start = "aligned";
  std::optional<double> heading_error_deg;  // of a drawn start, sign by the seed; nullopt = drawn from P_0
  double position_std_m =
      0.1 / 3.0;  // of P_0 of a drawn start; the others are those of [initial] and the turn-on biases
  // ornstein_uhlenbeck: about the turn-on biases, (Eq. 46); random_walk: as the filters have it, from a bias drawn from P_0.
  std::string biases = "ornstein_uhlenbeck";
  std::string mechanization = "exact";  // whose inverse makes the IMU: exact, or paper with oversample = 1
  double rate_hz = 10.0;                // of the epochs whose errors are counted
  double nees_interval_s = 10.0;        // between the epochs that NEES is taken at
  std::uint64_t seed = 1;               // of run 0; run i has seed + i
};

// Throws Error for a field of the case itself that is out of range or does not go with another; those of the flight and of the
// sensors are checked when they are used.
void check_study(const StudyCase& study);

// The truth that all runs of the case share. Throws Error for a field out of range.
Truth study_truth(const StudyCase& study);

// What one run has measured, and what is known of its truth.
struct StudySensors {
  ImuSeries imu;  // as logged
  std::vector<GnssRecord> gnss;
  std::vector<Vector3d> b_a, b_g;  // true biases at the stamps of the IMU
};

// Where the filters of one run begin.
struct StudyStart {
  FlightData data;
  FilterOptions filter;
  Belief<LieModel<double>> belief;
  ImuCursor cursor;
};

// One run of a case. `perfect` leaves out every error: what the covariances then say is the bound.
struct StudyRun {
  StudySensors sensors;
  StudyStart start;
  double simulate_s = 0.0, align_s = 0.0;  // time taken
};
StudyRun study_run(const StudyCase& study, const Truth& truth, std::uint64_t seed, bool perfect);

}  // namespace liealign
