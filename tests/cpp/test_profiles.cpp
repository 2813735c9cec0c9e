// Laws of the IMU profiles: names, provenance, and ranges that a slip of a unit would leave.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <sstream>

#include "liealign/core/error.hpp"
#include "liealign/ins/profiles.hpp"

namespace liealign {
namespace {

struct Number {
  const char* name;
  double ImuProfile::*member;
  double low, high;
};

// From the best part of the list (with room below) to the worst consumer part (with room above).
constexpr std::array<Number, 6> kNumbers = {{
    {"gyro_arw_deg_sqrt_h", &ImuProfile::gyro_arw_deg_sqrt_h, 0.02, 1.5},
    {"accel_vrw_mps_sqrt_h", &ImuProfile::accel_vrw_mps_sqrt_h, 0.004, 0.3},
    {"gyro_bias_instability_deg_h", &ImuProfile::gyro_bias_instability_deg_h, 0.5, 100.0},
    {"accel_bias_instability_ug", &ImuProfile::accel_bias_instability_ug, 1.0, 2000.0},
    {"gyro_bias_turn_on_deg_h", &ImuProfile::gyro_bias_turn_on_deg_h, 1.0, 20.0 * 3600.0},
    {"accel_bias_turn_on_mg", &ImuProfile::accel_bias_turn_on_mg, 0.1, 100.0},
}};

TEST(ImuProfiles, names_are_unique_and_lower_case) {
  std::set<std::string> names;
  for (const ImuProfile& p : imu_profiles()) {
    EXPECT_FALSE(p.name.empty());
    EXPECT_TRUE(names.insert(p.name).second) << p.name;
    for (const char c : p.name) EXPECT_TRUE((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_') << p.name;
    EXPECT_EQ(&imu_profile(p.name), &p);
  }
  for (const char* wanted : {"adis16495", "adis16465", "adis16448", "adis16505", "bmi088", "bmi160", "icm42688p",
                             "icm20948", "mpu6000", "mpu9250", "lsm6dso", "xsens_dot", "xsens_mti3", "low_cost_mems"})
    EXPECT_TRUE(names.count(wanted)) << wanted;
}

TEST(ImuProfiles, every_number_lies_where_its_unit_puts_it) {
  for (const ImuProfile& p : imu_profiles()) {
    for (const Number& n : kNumbers) {
      EXPECT_TRUE(std::isfinite(p.*n.member)) << p.name << " " << n.name;
      EXPECT_GE(p.*n.member, n.low) << p.name << " " << n.name;
      EXPECT_LE(p.*n.member, n.high) << p.name << " " << n.name;
    }
  }
}

TEST(ImuProfiles, the_bias_at_power_up_is_wider_than_its_drift) {
  for (const ImuProfile& p : imu_profiles()) {
    EXPECT_GE(p.gyro_bias_turn_on_deg_h, p.gyro_bias_instability_deg_h) << p.name;
    EXPECT_GE(data_sheet::mg(p.accel_bias_turn_on_mg), p.accel_bias_instability_ug) << p.name;
  }
}

// The Allan curve of a MEMS sensor reaches its floor between about a second and an hour. A density or an instability in a
// wrong unit moves that time by the square of 60 or 1000.
TEST(ImuProfiles, white_noise_falls_to_the_instability_between_a_second_and_an_hour) {
  for (const ImuProfile& p : imu_profiles()) {
    const double gyro = std::pow(60.0 * p.gyro_arw_deg_sqrt_h / p.gyro_bias_instability_deg_h, 2);
    const double accel = std::pow(p.accel_vrw_mps_sqrt_h / 60.0 / (p.accel_bias_instability_ug * kMicroGToMps2), 2);
    EXPECT_GT(gyro, 0.5) << p.name;
    EXPECT_LT(gyro, 3600.0) << p.name;
    EXPECT_GT(accel, 0.5) << p.name;
    EXPECT_LT(accel, 3600.0) << p.name;
  }
}

TEST(ImuProfiles, each_has_a_source_and_its_estimates_are_members) {
  for (const ImuProfile& p : imu_profiles()) {
    EXPECT_FALSE(p.description.empty()) << p.name;
    EXPECT_FALSE(p.source.empty()) << p.name;
    EXPECT_EQ(p.source.find('\n'), std::string::npos) << p.name;
    std::istringstream list(p.estimated);
    std::set<std::string> seen;
    for (std::string item; std::getline(list, item, ',');) {
      item.erase(0, item.find_first_not_of(' '));
      EXPECT_TRUE(std::any_of(kNumbers.begin(), kNumbers.end(), [&](const Number& n) { return item == n.name; }))
          << p.name << " " << item;
      EXPECT_TRUE(seen.insert(item).second) << p.name << " " << item;
    }
  }
}

TEST(ImuProfiles, the_default_is_table_1_of_the_paper_to_the_bit) {
  const ImuProfile& p = imu_profile("adis16495");
  EXPECT_EQ(&p, &imu_profiles().front());
  EXPECT_EQ(p.gyro_arw_deg_sqrt_h, 0.09);
  EXPECT_EQ(p.accel_vrw_mps_sqrt_h, 0.008);
  EXPECT_EQ(p.gyro_bias_instability_deg_h, 0.8);
  EXPECT_EQ(p.accel_bias_instability_ug, 3.2);
  EXPECT_EQ(p.gyro_bias_turn_on_deg_h, 10.0);
  EXPECT_EQ(p.accel_bias_turn_on_mg, 0.5);
}

TEST(ImuProfiles, an_unknown_name_lists_them_all) {
  try {
    imu_profile("icm42688");
    FAIL();
  } catch (const ConfigError& e) {
    const std::string what = e.what();
    EXPECT_EQ(what.rfind("imu.model is \"icm42688\"; expected one of: adis16495, ", 0), 0u) << what;
    for (const ImuProfile& p : imu_profiles()) EXPECT_NE(what.find(p.name), std::string::npos) << p.name;
  }
}

// The integral of white noise of density N has the standard deviation N sqrt(t): after an hour, in SI, the same number.
TEST(DataSheet, densities_are_random_walks_over_an_hour) {
  using namespace data_sheet;
  const double hour = std::sqrt(3600.0);
  EXPECT_DOUBLE_EQ(mdps_sqrt_hz(2.8), 2.8e-3 * hour);
  EXPECT_DOUBLE_EQ(mdps_sqrt_hz(5.0) * kDegPerSqrtHourToRadPerSqrtSecond, 0.005 * kDegToRad);
  EXPECT_DOUBLE_EQ(ug_sqrt_hz(70.0), 70.0 * kMicroGToMps2 * hour);
  EXPECT_DOUBLE_EQ(ug_sqrt_hz(400.0) * kMpsPerSqrtHourToMpsPerSqrtSecond, 400.0 * kMicroGToMps2);
}

TEST(DataSheet, rates_and_accelerations_keep_their_si_value) {
  using namespace data_sheet;
  EXPECT_DOUBLE_EQ(deg_s(0.5) * kDegPerHourToRadPerSecond, 0.5 * kDegToRad);
  EXPECT_DOUBLE_EQ(mg(0.25) * kMicroGToMps2, 0.25 * kMilliGToMps2);
  EXPECT_DOUBLE_EQ(um_s2(26.5) * kMicroGToMps2, 26.5e-6);
  static_assert(deg_s(1.0) == 3600.0 && mg(1.0) == 1000.0);
}

}  // namespace
}  // namespace liealign
