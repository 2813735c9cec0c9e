// The IMU profiles. What the sources print stands in the rows or in the comment above them; docs/imus.md says of each
// number where it was read.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/ins/profiles.hpp"

#include "liealign/core/error.hpp"

namespace liealign {
namespace {

using data_sheet::deg_s;
using data_sheet::mdps_sqrt_hz;
using data_sheet::mg;
using data_sheet::ug_sqrt_hz;
using data_sheet::um_s2;

// Consumer parts print no in-run bias stability. The estimate is 0.4 of the rate noise density [deg/h/sqrt(Hz)] for the
// gyro and one third of the noise density [ug/sqrt(Hz)] for the accelerometer, rounded: at the upper end of the parts
// that print both (docs/imus.md). Typical tolerances of zero-rate and zero-g level are taken as one sigma.
const char* const kInstability = "gyro_bias_instability_deg_h, accel_bias_instability_ug";
const char* const kAccelInstability = "accel_bias_instability_ug";
const char* const kTurnOn = "gyro_bias_turn_on_deg_h, accel_bias_turn_on_mg";
const char* const kVrwAndTurnOn = "accel_vrw_mps_sqrt_h, gyro_bias_turn_on_deg_h, accel_bias_turn_on_mg";
const char* const kAll =
    "gyro_arw_deg_sqrt_h, accel_vrw_mps_sqrt_h, gyro_bias_instability_deg_h, accel_bias_instability_ug, "
    "gyro_bias_turn_on_deg_h, accel_bias_turn_on_mg";

// Rows: name, description; ARW [deg/sqrt(h)], VRW [m/s/sqrt(h)]; bias instability of gyro [deg/h] and accelerometer
// [ug]; turn-on bias of gyro [deg/h] and accelerometer [mg]; source; estimated members.
std::vector<ImuProfile> make_profiles() {
  return {
      // TAES table I (chosen there after the ADIS16495 data sheet); turn-on from TAES P_0: three sigma are 15 deg/h and 1 mg.
      {"adis16495", "Analog Devices ADIS16495, as in TAES table I", 0.09, 0.008, 0.8, 3.2, 10.0, 0.5,
       "TAES table I, chosen there after the ADIS16495 data sheet", ""},

      // -2: 0.15 deg/sqrt(h), 0.012 m/s/sqrt(h), 2.5 deg/h, 3.6 ug. Turn-on: over-temperature 1 sigma of the ADIS16470,
      // 0.2 deg/s and 4 mg.
      {"adis16465", "Analog Devices ADIS16465-2 (500 deg/s)", 0.15, 0.012, 2.5, 3.6, deg_s(0.2), 4.0,
       "ADIS16465 data sheet, features and table 1", kTurnOn},

      // 0.66 deg/sqrt(h), 0.11 m/s/sqrt(h), 14.5 deg/h, 0.25 mg, bias repeatability 0.5 deg/s and 20 mg.
      {"adis16448", "Analog Devices ADIS16448", 0.66, 0.11, 14.5, mg(0.25), deg_s(0.5), 20.0,
       "ADIS16448 data sheet rev. H, table 1", ""},

      // -2: 0.15 deg/sqrt(h), 2.7 deg/h (-1: 0.13, 2.3); 26.5 um/s^2. VRW as the ADIS16465, turn-on as the ADIS16470.
      {"adis16505", "Analog Devices ADIS16505-2 (500 deg/s)", 0.15, 0.012, 2.7, um_s2(26.5), deg_s(0.2), 4.0,
       "ADIS16505 data sheet, features and table 1", kVrwAndTurnOn},

      // 0.014 deg/s/sqrt(Hz), 160 (x, y) and 190 (z) ug/sqrt(Hz): their mean; flyer: below 2 deg/h; +-1 deg/s, 20 mg.
      {"bmi088", "Bosch BMI088", mdps_sqrt_hz(14.0), ug_sqrt_hz(175.0), 2.0, 60.0, deg_s(1.0), 20.0,
       "BMI088 data sheet BST-BMI088-DS001 rev. 1.9; flyer BST-BMI088-FL000", kAccelInstability},

      // The phone class: 0.007 deg/s/sqrt(Hz), 180 ug/sqrt(Hz), +-3 deg/s, board level +-40 mg.
      {"bmi160", "Bosch BMI160, of phones and small boards", mdps_sqrt_hz(7.0), ug_sqrt_hz(180.0), 10.0, 60.0,
       deg_s(3.0), 40.0, "BMI160 data sheet BST-BMI160-DS000-07 rev. 0.8", kInstability},

      // 0.0028 deg/s/sqrt(Hz), 65 (x, y) and 70 (z) ug/sqrt(Hz), +-0.5 deg/s, +-20 mg.
      {"icm42688p", "TDK InvenSense ICM-42688-P", mdps_sqrt_hz(2.8), ug_sqrt_hz(70.0), 4.0, 25.0, deg_s(0.5), 20.0,
       "ICM-42688-P data sheet DS-000347 rev. 1.8, tables 1 and 2", kInstability},

      // 0.015 deg/s/sqrt(Hz), 230 ug/sqrt(Hz), +-5 deg/s, board level +-50 mg.
      {"icm20948", "TDK InvenSense ICM-20948", mdps_sqrt_hz(15.0), ug_sqrt_hz(230.0), 20.0, 75.0, deg_s(5.0), 50.0,
       "ICM-20948 data sheet DS-000189 rev. 1.3, tables 1 and 2", kInstability},

      // 0.005 deg/s/sqrt(Hz), 400 ug/sqrt(Hz), +-20 deg/s, +-50 mg (x, y; z +-80); AirSim: 4.6 deg/h, 36 ug.
      {"mpu6000", "InvenSense MPU-6000, MPU-6050", mdps_sqrt_hz(5.0), ug_sqrt_hz(400.0), 4.6, 36.0, deg_s(20.0), 50.0,
       "MPU-6000/6050 specification rev. 3.4, sections 6.1 and 6.2; instabilities as in AirSim", ""},

      // 0.01 deg/s/sqrt(Hz), 300 ug/sqrt(Hz), +-5 deg/s, +-60 mg (x, y; z +-80).
      {"mpu9250", "InvenSense MPU-9250", mdps_sqrt_hz(10.0), ug_sqrt_hz(300.0), 15.0, 100.0, deg_s(5.0), 60.0,
       "MPU-9250 specification PS-MPU-9250A-01 rev. 1.1, tables 1 and 2", kInstability},

      // 3.8 mdps/sqrt(Hz), 80 ug/sqrt(Hz) at 8 g (70 at 2 g, 110 at 16 g), +-1 deg/s, +-20 mg.
      {"lsm6dso", "ST LSM6DSO, LSM6DSOX", mdps_sqrt_hz(3.8), ug_sqrt_hz(80.0), 5.0, 30.0, deg_s(1.0), 20.0,
       "LSM6DSO data sheet DS12140 rev. 3, table 2; LSM6DSOX DS12814 rev. 3", kInstability},

      // 0.007 deg/s/sqrt(Hz), 120 ug/sqrt(Hz), 10 deg/h, 0.03 mg.
      {"xsens_dot", "Movella (Xsens) DOT", mdps_sqrt_hz(7.0), ug_sqrt_hz(120.0), 10.0, mg(0.03), deg_s(0.5), 5.0,
       "Xsens DOT user manual, sensor specification: as the MTi 1-series", kTurnOn},

      // 0.007 deg/s/sqrt(Hz), 120 ug/sqrt(Hz), 10 deg/h, 0.03 mg.
      {"xsens_mti3", "Movella (Xsens) MTi-3, MTi 1-series", mdps_sqrt_hz(7.0), ug_sqrt_hz(120.0), 10.0, mg(0.03),
       deg_s(0.5), 5.0, "MTi 1-series data sheet, sensor specification", kTurnOn},

      // Round figures near the consumer parts above.
      {"low_cost_mems", "any consumer MEMS without a profile", mdps_sqrt_hz(10.0), ug_sqrt_hz(300.0), 15.0, 100.0,
       deg_s(5.0), 50.0, "no data sheet: typical of the consumer parts", kAll},
  };
}

}  // namespace

const std::vector<ImuProfile>& imu_profiles() {
  static const std::vector<ImuProfile> profiles = make_profiles();
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
