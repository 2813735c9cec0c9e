// The configuration of a run: one struct, its defaults, and the field table that maps FLIGHT.toml to it.
// Defaults stand here and nowhere else. Values keep the unit their key ends in; the pipeline converts once.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace liealign {

struct ImuConfig {
  std::string file;                                    // native imu.csv
  std::string model = "adis16495";                     // profile that fills every noise key that is not given
  std::string sample = "mean";                         // mean | instant | increment
  std::string gyro_unit = "rps";                       // rps | dps: of the gyro columns
  std::string accel_unit = "mps2";                     // mps2 | g: of the accelerometer columns
  std::string axes = "FRD";                            // where the sensor's x, y, z point: three of F B R L D U
  std::array<double, 3> mounting_rpy_deg = {0, 0, 0};  // sensor axes after `axes` to body: roll, pitch, yaw (ZYX)
  std::optional<double> noise_scale;                   // nullopt = "auto"
  std::optional<double> gyro_arw_deg_sqrt_h;           // nullopt = from the profile, as all the next ones
  std::optional<double> accel_vrw_mps_sqrt_h;
  std::optional<double> gyro_bias_instability_deg_h;
  std::optional<double> accel_bias_instability_ug;
  std::optional<double> gyro_bias_turn_on_deg_h;  // one sigma at power-up
  std::optional<double> accel_bias_turn_on_mg;    // one sigma at power-up
  double bias_correlation_time_s = 100.0;
  double max_gap_s = 0.1;
  double gap_gyro_std_dps = 20.0;
  double gap_accel_std_mps2 = 2.0;
};

struct GnssConfig {
  std::string file;                                 // native gnss.csv, or a .pos of RTKLIB
  std::optional<int> week;                          // GPS week of time_s = 0; nullopt = not known, or from the .pos
  std::array<double, 3> lever_arm_b_m = {0, 0, 0};  // IMU to antenna, body axes
  std::optional<double> latency_s;                  // nullopt = "auto"; t_true = time_s - latency_s
  std::optional<double> velocity_latency_s;         // of the velocity columns; nullopt = "auto"
  std::string error_model = "auto";                 // auto | white | correlated; auto is correlated
  std::optional<double> std_scale;                  // nullopt = "auto"
  double std_floor_m = 0.005;                       // no position std below this
  bool use_velocity = true;                         // when the file has velocity columns
  double velocity_std_mps = 0.1;                    // when the file has no velocity std columns
  double velocity_std_floor_mps = 0.02;
  double heading_offset_deg = 0.0;  // direction of the dual antenna's baseline in the body, clockwise from forward
  std::vector<int> accept_fix = {1, 2, 3, 4, 5, 6};  // RTKLIB's Q; used when the file has a fix column
  std::string outlier = "weight";                    // weight | reject | off
  double outlier_probability = 0.999;                // a good fix passes the chi-square test with this probability
  int reacquire_after = 5;                           // fixes beyond the threshold in a row before the filter yields
};

struct BaroConfig {
  std::string file;          // native baro.csv; "" = no barometer
  double std_m = 0.5;        // white noise of a height, when the file has no std column
  double bias_std_m = 10.0;  // standard deviation of its drifting bias
  double bias_correlation_time_s = 600.0;
};

struct AlignConfig {
  std::string start = "auto";  // auto | static | moving
  std::optional<double> heading_guess_deg;
  double heading_guess_std_deg = 20.0;
  double grid_step_deg = 15.0;         // circle search without a guess
  double grid_heading_std_deg = 15.0;  // heading std of a candidate of the circle search
  double triple_step_deg = 6.0;        // first three candidates: guess -step, guess, guess +step
  double tolerance_deg = 0.005;        // the quadratic fit has settled when the minimum moves less
  int max_evaluations = 40;            // conditional candidates at most
  double max_time_s = 300.0;           // motion used for the alignment; 0 = all
  double max_rest_s = 120.0;           // rest before it used for the pre-tuning of its candidates
  double max_sigma_deg = 1.0;          // verdict "aligned" up to this
};

struct RestConfig {
  double min_duration_s = 5.0;
  double gyro_std_dps = 4.0;   // largest standard deviation of a rate inside half a second
  double gyro_mean_dps = 0.5;  // largest change of the mean rate against the rest so far
  double accel_std_mps2 = 0.6;
  double accel_mean_mps2 = 0.15;  // largest change of the mean specific force
  double gnss_drift_sigma = 5.0;  // largest position change, in its standard deviations
  double zupt_std_mps = 0.005;
  double zaru_std_dps = 0.0;  // added to the gyro noise of the averaged rate
  double interval_s = 1.0;    // one zero-velocity and zero-rate update per interval
};

struct InitialConfig {
  double roll_pitch_std_deg = 1.0 / 3.0;  // TAES P_0: three sigma are 1 deg, 5 deg, 1 mm/s
  double heading_std_deg = 5.0 / 3.0;
  double velocity_std_mps = 0.001 / 3.0;
};

struct FilterConfig {
  std::string model = "lie";            // lie | mekf | euler
  std::string mechanization = "exact";  // exact | paper
  std::string gravity = "normal";       // normal | j2
  bool covariance_reset = true;
};

struct OutputConfig {
  std::vector<std::string> formats = {"csv"};             // csv | sbet: the trajectory files wanted
  bool filtered = false;                                  // also write filtered.csv
  std::array<double, 3> reference_point_b_m = {0, 0, 0};  // from the IMU to the point whose trajectory is wanted
  std::array<double, 3> boresight_deg = {0, 0, 0};        // of the wanted axes in the body: roll, pitch, yaw (ZYX)
  std::optional<double> rate_hz;                          // nullopt = every IMU epoch
  std::optional<double> start_time_s, stop_time_s;        // of the output; nullopt = as far as the run goes
};

struct Config {
  ImuConfig imu;
  GnssConfig gnss;
  BaroConfig baro;
  AlignConfig align;
  RestConfig rest;
  InitialConfig initial;
  FilterConfig filter;
  OutputConfig output;
};

// A value as a TOML reader gives it.
using ConfigValue = std::variant<bool, long long, double, std::string, std::vector<long long>, std::vector<double>,
                                 std::vector<std::string>>;

// One leaf of the generic tree: full dotted key, value, and where it stands (0 = the reader does not know).
struct ConfigEntry {
  std::string key;
  ConfigValue value;
  std::size_t line = 0;
  std::size_t column = 0;
};

// What the field table says of one key.
struct ConfigField {
  std::string key;
  std::string type;  // "string", "number", "number or \"auto\"", "3 numbers", "one of \"exact\", \"paper\"" ...
  std::string unit;  // "" when it has none
  std::string meaning;
  std::string default_value;  // as TOML text; "" when the key has no default
};

// Every key, in the order of the struct.
std::vector<ConfigField> config_fields();

// Applies the entries to `base`. Throws ConfigError ("FLIGHT.toml:7:1: unknown key ...") for an unknown key
// (with the nearest one), a wrong type, a value out of range. `source` is the file name for messages, "" for flags.
Config apply_config(const Config& base, const std::vector<ConfigEntry>& entries, const std::string& source);

// FLIGHT.toml text with every key and its meaning; reading it back gives the same Config, bit for bit.
std::string dump_config(const Config& config);

// The same as flat entries (optional keys that are unset are left out).
std::vector<ConfigEntry> config_entries(const Config& config);

}  // namespace liealign
