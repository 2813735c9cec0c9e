// What a simulated multirotor is told to fly: legs of constant velocity, before they are smoothed.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "liealign/simulate/trajectory.hpp"

namespace liealign {

// Commanded velocity (NED of the pad) turning at course_rate, and the rate of the heading.
struct Leg {
  std::size_t samples = 0;
  Vector3d v_n = Vector3d::Zero();
  double course_rate = 0.0;
  double yaw_rate = 0.0;
};

struct Plan {
  double dt = 0.0;
  std::vector<Leg> legs;
  Vector3d position = Vector3d::Zero();  // at the end of the last leg
  double heading = 0.0;
  std::size_t spare_leg = 0;  // the hover that takes the time left over

  std::size_t samples() const {
    std::size_t sum = 0;
    for (const Leg& leg : legs) sum += leg.samples;
    return sum;
  }
};

// Horizontal unit vector of a course, NED.
Vector3d direction(double course_rad);

// The fullest flight of its kind that takes no more than `available` samples of dt, its spare time spent hovering.
// Throws Error when there is none.
Plan fit_plan(const DroneFlight& flight, double dt, double available);

}  // namespace liealign
