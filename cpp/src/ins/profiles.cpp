// The IMU profiles.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/ins/profiles.hpp"

#include "liealign/core/error.hpp"

namespace liealign {

const std::vector<ImuProfile>& imu_profiles() {
  static const std::vector<ImuProfile> profiles = {
      // TAES table I (chosen there after the ADIS16495 data sheet); turn-on from TAES P_0: three sigma are 15 deg/h and 1 mg.
      {"adis16495", "Analog Devices ADIS16495, as in TAES table I", 0.09, 0.008, 0.8, 3.2, 15.0 / 3.0, 1.0 / 3.0},
  };
  return profiles;
}

const ImuProfile& imu_profile(const std::string& name) {
  std::string names;
  for (const ImuProfile& p : imu_profiles()) {
    if (p.name == name) return p;
    names += (names.empty() ? "" : ", ") + p.name;
  }
  throw ConfigError("imu.model is \"" + name + "\"; expected one of: " + names);
}

}  // namespace liealign
