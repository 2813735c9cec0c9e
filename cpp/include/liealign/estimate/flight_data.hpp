// What a filter runs over: prepared IMU samples, fixes, rest updates, merged into events in time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "liealign/ins/gnss.hpp"
#include "liealign/ins/imu.hpp"

namespace liealign {

// A zero-velocity and zero-rate update: the vehicle rested over (t_s - duration_s, t_s].
struct RestUpdate {
  double t_s = 0.0;
  double duration_s = 0.0;
  Vector3d mean_omega_ib_b = Vector3d::Zero();  // measured, with its bias, rad/s
  Vector3d std_omega_ib_b =
      Vector3d::Zero();  // of such means over the whole rest: engines and wind rock a parked vehicle
};

struct Event {
  enum class Kind { fix, rest };
  double t_s = 0.0;
  Kind kind = Kind::fix;
  std::size_t index = 0;  // into fixes or rests
};

struct FlightData {
  std::shared_ptr<const ImuSeries> samples;  // of the IMU, prepared; [0] only marks the start. Copies share the bulk.
  std::vector<GnssFix> fixes;
  std::vector<RestUpdate> rests;
  std::vector<Event> events;  // ascending in time, inside the IMU's span
  Vector3d l_ba_b = Vector3d::Zero();

  const ImuSeries& imu() const { return *samples; }
};

// Merges fixes and rests that lie in (imu.front, imu.back] into `events`.
void merge_events(FlightData& data);

}  // namespace liealign
