// What a filter runs over: prepared IMU samples, and observations in the order of time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "liealign/ins/gnss.hpp"
#include "liealign/ins/imu.hpp"
#include "liealign/observe/observation.hpp"

namespace liealign {

// A zero-velocity and zero-rate update: the vehicle rested over (t_s - duration_s, t_s].
struct RestUpdate {
  double t_s = 0.0;
  double duration_s = 0.0;
  Vector3d mean_omega_ib_b = Vector3d::Zero();  // measured, with its bias, rad/s
  Vector3d std_omega_ib_b =
      Vector3d::Zero();  // of such means over the whole rest: engines and wind rock a parked vehicle
};

// How still a vehicle at rest is taken to be.
struct RestNoise {
  double zupt_std_mps = 0.005;
  double zaru_std_rps = 0.0;  // added to the gyro noise of the averaged rate
};

struct FlightData {
  std::shared_ptr<const ImuSeries> samples;  // of the IMU, prepared; [0] only marks the start. Copies share the bulk.
  std::vector<GnssFix> fixes;
  std::vector<RestUpdate> rests;
  std::vector<Observation> others;        // of other kinds, by the clock of the IMU; in any order
  std::vector<Observation> observations;  // of all three, ascending in time, inside the IMU's span
  Vector3d l_ba_b = Vector3d::Zero();
  RestNoise rest_noise;

  const ImuSeries& imu() const { return *samples; }
};

// One fix, one rest, as observations: position, and velocity where there is one; zero velocity and zero rate.
void add_observations(const GnssFix& fix, const Vector3d& l_ba_b, std::vector<Observation>& to);
void add_observations(const RestUpdate& rest, const RestNoise& noise, std::vector<Observation>& to);

// Puts observations in the order of time and drops those outside (imu.front, imu.back].
void sort_observations(const ImuSeries& imu, std::vector<Observation>& observations);

// Makes the observations of a flight from its fixes, its rests and the others.
void list_observations(FlightData& data);

}  // namespace liealign
