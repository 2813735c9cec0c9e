// IMU noise profiles by name, in data-sheet units, each number with its source.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace liealign {

struct ImuProfile {
  std::string name;
  std::string description;
  double gyro_arw_deg_sqrt_h = 0.0;
  double accel_vrw_mps_sqrt_h = 0.0;
  double gyro_bias_instability_deg_h = 0.0;
  double accel_bias_instability_ug = 0.0;
  double gyro_bias_turn_on_deg_h = 0.0;  // one sigma
  double accel_bias_turn_on_mg = 0.0;    // one sigma
};

const std::vector<ImuProfile>& imu_profiles();

// Throws ConfigError naming the profiles there are.
const ImuProfile& imu_profile(const std::string& name);

}  // namespace liealign
