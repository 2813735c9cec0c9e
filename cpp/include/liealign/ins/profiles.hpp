// IMU noise profiles by name, in data-sheet units, each number with its source (docs/imus.md has the printed values).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "liealign/core/units.hpp"

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
  std::string source;                    // data sheet and revision, or paper, on one line
  std::string estimated;  // the members above that no source prints and that are estimates: "a, b"; "" for none
};

const std::vector<ImuProfile>& imu_profiles();

// Throws ConfigError naming the profiles there are.
const ImuProfile& imu_profile(const std::string& name);

// What data sheets print, in the units of ImuProfile. A white density N [x/s/sqrt(Hz)] grows in its integral as
// N sqrt(t), and sqrt(3600 s) = 60 sqrt(s).
namespace data_sheet {

constexpr double mdps_sqrt_hz(double density) { return density * 60.0 / 1000.0; }                   // deg/sqrt(h)
constexpr double ug_sqrt_hz(double density) { return density * 60.0 * (1e-6 * kStandardGravity); }  // m/s/sqrt(h)
constexpr double deg_s(double rate) { return rate * kSecondsPerHour; }                              // deg/h
constexpr double mg(double acceleration) { return acceleration * 1000.0; }                          // ug
constexpr double um_s2(double acceleration) { return acceleration / kStandardGravity; }             // ug

}  // namespace data_sheet
}  // namespace liealign
