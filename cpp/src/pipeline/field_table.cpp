// The rows of the field table: every key of FLIGHT.toml, in the order of the Config struct.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/field_table.hpp"

#include <limits>
#include <type_traits>
#include <utility>

#include "liealign/ins/profiles.hpp"

namespace liealign {
namespace {

template <auto Section, auto Leaf>
constexpr auto member() {
  using T = std::remove_cvref_t<decltype((std::declval<Config&>().*Section).*Leaf)>;
  return Member<T>{[](const Config& config) -> const T& { return (config.*Section).*Leaf; },
                   [](Config& config) -> T& { return (config.*Section).*Leaf; }};
}

template <auto Leaf>
constexpr auto imu = member<&Config::imu, Leaf>();
template <auto Leaf>
constexpr auto gnss = member<&Config::gnss, Leaf>();
template <auto Leaf>
constexpr auto baro = member<&Config::baro, Leaf>();
template <auto Leaf>
constexpr auto align = member<&Config::align, Leaf>();
template <auto Leaf>
constexpr auto rest = member<&Config::rest, Leaf>();
template <auto Leaf>
constexpr auto initial = member<&Config::initial, Leaf>();
template <auto Leaf>
constexpr auto filter = member<&Config::filter, Leaf>();
template <auto Leaf>
constexpr auto output = member<&Config::output, Leaf>();

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

constexpr Range kPositive = {0.0, kUnlimited, true, false};
constexpr Range kNotNegative = {0.0, kUnlimited, false, false};
constexpr Range kProbability = {0.0, 1.0, true, true};
constexpr Range kQuarterTurn = {0.0, 90.0, true, false};

constexpr Range at_least(double low) { return {low, kUnlimited, false, false}; }
constexpr Range within(double low, double high) { return {low, high, false, false}; }

Words profile_names() {
  Words names;
  for (const ImuProfile& profile : imu_profiles()) names.allowed.emplace_back(profile.name);
  return names;
}

using enum Unset;

std::vector<Field> make_table() {
  return {
      // [imu]
      {"imu.file", "", "IMU log in the native CSV layout", imu<&ImuConfig::file>},
      {"imu.model", "", "Noise profile that fills every noise key that is not given", imu<&ImuConfig::model>,
       profile_names()},
      {"imu.sample", "",
       "What a sample holds: the mean rate since the one before, the rate at its instant, or the increment",
       imu<&ImuConfig::sample>, Words{{"mean", "instant", "increment"}}},
      {"imu.gyro_unit", "", "Unit of the gyro columns: rad/s or deg/s (increments: rad or deg)",
       imu<&ImuConfig::gyro_unit>, Words{{"rps", "dps"}}},
      {"imu.accel_unit", "", "Unit of the accelerometer columns: m/s^2 or g (increments: m/s or g s)",
       imu<&ImuConfig::accel_unit>, Words{{"mps2", "g"}}},
      {"imu.axes", "", "Where the sensor's x, y, z point on the drone (Forward Backward, Right Left, Down Up)",
       imu<&ImuConfig::axes>, AxisLetters{}},
      {"imu.mounting_rpy_deg", "deg", "Roll, pitch, yaw (ZYX) of the sensor in the body, after the axes are renamed",
       imu<&ImuConfig::mounting_rpy_deg>, within(-360.0, 360.0)},
      {"imu.noise_scale", "", "Factor on every IMU noise (auto: estimated from the flight)",
       imu<&ImuConfig::noise_scale>, kPositive, automatic},
      {"imu.gyro_arw_deg_sqrt_h", "deg/sqrt(h)", "Gyro white noise as angle random walk",
       imu<&ImuConfig::gyro_arw_deg_sqrt_h>, kNotNegative, from_profile},
      {"imu.accel_vrw_mps_sqrt_h", "m/s/sqrt(h)", "Accelerometer white noise as velocity random walk",
       imu<&ImuConfig::accel_vrw_mps_sqrt_h>, kNotNegative, from_profile},
      {"imu.gyro_bias_instability_deg_h", "deg/h", "Standard deviation of the drifting gyro bias",
       imu<&ImuConfig::gyro_bias_instability_deg_h>, kNotNegative, from_profile},
      {"imu.accel_bias_instability_ug", "ug", "Standard deviation of the drifting accelerometer bias",
       imu<&ImuConfig::accel_bias_instability_ug>, kNotNegative, from_profile},
      {"imu.gyro_bias_turn_on_deg_h", "deg/h", "Standard deviation of the gyro bias at power-up",
       imu<&ImuConfig::gyro_bias_turn_on_deg_h>, kNotNegative, from_profile},
      {"imu.accel_bias_turn_on_mg", "mg", "Standard deviation of the accelerometer bias at power-up",
       imu<&ImuConfig::accel_bias_turn_on_mg>, kNotNegative, from_profile},
      {"imu.bias_correlation_time_s", "s", "Correlation time of the drifting biases",
       imu<&ImuConfig::bias_correlation_time_s>, kPositive},
      {"imu.max_gap_s", "s",
       "A longer pause between two samples counts as a gap and is bridged with the two gap noises",
       imu<&ImuConfig::max_gap_s>, kPositive},
      {"imu.gap_gyro_std_dps", "deg/s", "Standard deviation of the unknown rate during a gap",
       imu<&ImuConfig::gap_gyro_std_dps>, kPositive},
      {"imu.gap_accel_std_mps2", "m/s^2", "Standard deviation of the unknown specific force during a gap",
       imu<&ImuConfig::gap_accel_std_mps2>, kPositive},

      // [gnss]
      {"gnss.file", "", "GNSS positions: native CSV layout, or a .pos file of RTKLIB", gnss<&GnssConfig::file>},
      {"gnss.week", "", "GPS week in which time_s began to count, for files that need it; a .pos file names it itself",
       gnss<&GnssConfig::week>, within(0.0, 9999.0), none},
      {"gnss.lever_arm_b_m", "m", "From the IMU to the antenna: forward, right, down", gnss<&GnssConfig::lever_arm_b_m>,
       within(-100.0, 100.0)},
      {"gnss.latency_s", "s", "Delay of the time stamps, t_true = time_s - latency_s (auto: estimated from the flight)",
       gnss<&GnssConfig::latency_s>, within(-10.0, 10.0), automatic},
      {"gnss.velocity_latency_s", "s",
       "Delay of the velocity columns, t_true = time_s - velocity_latency_s (auto: estimated from the flight)",
       gnss<&GnssConfig::velocity_latency_s>, within(-10.0, 10.0), automatic},
      {"gnss.error_model", "",
       "Position errors independent from fix to fix, or with a part that lasts over many (auto: correlated)",
       gnss<&GnssConfig::error_model>, Words{{"auto", "white", "correlated"}}},
      {"gnss.std_scale", "", "Factor on the standard deviations of the file (auto: estimated from the flight)",
       gnss<&GnssConfig::std_scale>, kPositive, automatic},
      {"gnss.std_floor_m", "m", "Smallest position standard deviation that is believed", gnss<&GnssConfig::std_floor_m>,
       kNotNegative},
      {"gnss.use_velocity", "", "Use the velocity columns when the file has them", gnss<&GnssConfig::use_velocity>},
      {"gnss.velocity_std_mps", "m/s", "Velocity standard deviation when the file has no columns for it",
       gnss<&GnssConfig::velocity_std_mps>, kPositive},
      {"gnss.velocity_std_floor_mps", "m/s", "Smallest velocity standard deviation that is believed",
       gnss<&GnssConfig::velocity_std_floor_mps>, kNotNegative},
      {"gnss.heading_offset_deg", "deg",
       "Direction of the dual antenna's baseline in the body, clockwise from forward: heading_deg minus the heading",
       gnss<&GnssConfig::heading_offset_deg>, within(-360.0, 360.0)},
      {"gnss.accept_fix", "",
       "Qualities to use when the file has a fix column (RTKLIB's Q: 1 fixed, 2 float, 5 single ...)",
       gnss<&GnssConfig::accept_fix>, within(0.0, 9.0)},
      {"gnss.outlier", "", "What to do with a fix that fails the chi-square test: weigh it down, reject it, or no test",
       gnss<&GnssConfig::outlier>, Words{{"weight", "reject", "off"}}},
      {"gnss.outlier_probability", "", "Probability with which a good fix passes the chi-square test",
       gnss<&GnssConfig::outlier_probability>, kProbability},
      {"gnss.reacquire_after", "", "Fixes beyond the threshold in a row before the filter yields to them",
       gnss<&GnssConfig::reacquire_after>, at_least(1.0)},

      // [baro]
      {"baro.file", "", "Heights of a barometer in the native CSV layout", baro<&BaroConfig::file>},
      {"baro.std_m", "m", "Standard deviation of a height when the file has no column for it", baro<&BaroConfig::std_m>,
       kPositive},
      {"baro.bias_std_m", "m", "Standard deviation of the drifting bias of the barometer",
       baro<&BaroConfig::bias_std_m>, kPositive},
      {"baro.bias_correlation_time_s", "s", "Correlation time of the drifting bias of the barometer",
       baro<&BaroConfig::bias_correlation_time_s>, kPositive},

      // [align]
      {"align.start", "", "Whether the log starts at rest, in motion, or is to be looked at",
       align<&AlignConfig::start>, Words{{"auto", "static", "moving"}}},
      {"align.heading_guess_deg", "deg", "Heading at the start, clockwise from true north, when you know it roughly",
       align<&AlignConfig::heading_guess_deg>, Anything{}, none},
      {"align.heading_guess_std_deg", "deg", "Standard deviation of the guess",
       align<&AlignConfig::heading_guess_std_deg>, kPositive},
      {"align.grid_step_deg", "deg", "Step of the search over the full circle, without a guess",
       align<&AlignConfig::grid_step_deg>, kQuarterTurn},
      {"align.grid_heading_std_deg", "deg", "Heading standard deviation of a candidate of the circle search",
       align<&AlignConfig::grid_heading_std_deg>, kPositive},
      {"align.triple_step_deg", "deg", "Distance of the first three candidates of the quadratic fit",
       align<&AlignConfig::triple_step_deg>, kQuarterTurn},
      {"align.tolerance_deg", "deg", "The quadratic fit has settled when its minimum moves less",
       align<&AlignConfig::tolerance_deg>, kPositive},
      {"align.max_evaluations", "", "Candidate filters of each of the two quadratic fits at most",
       align<&AlignConfig::max_evaluations>, at_least(4.0)},
      {"align.max_time_s", "s", "Time in motion that the alignment uses; 0 for all of it",
       align<&AlignConfig::max_time_s>, kNotNegative},
      {"align.max_rest_s", "s", "Rest before the motion that its candidates use to settle tilt and biases",
       align<&AlignConfig::max_rest_s>, kPositive},
      {"align.max_sigma_deg", "deg", "Largest heading standard deviation with the verdict aligned",
       align<&AlignConfig::max_sigma_deg>, kPositive},

      // [rest]
      {"rest.min_duration_s", "s", "Shortest time without motion that counts as rest",
       rest<&RestConfig::min_duration_s>, kPositive},
      {"rest.gyro_std_dps", "deg/s", "Largest standard deviation of a rate inside half a second of rest",
       rest<&RestConfig::gyro_std_dps>, kPositive},
      {"rest.gyro_mean_dps", "deg/s", "Largest change of the mean rate against the rest so far",
       rest<&RestConfig::gyro_mean_dps>, kPositive},
      {"rest.accel_std_mps2", "m/s^2", "Largest standard deviation of the specific force inside half a second of rest",
       rest<&RestConfig::accel_std_mps2>, kPositive},
      {"rest.accel_mean_mps2", "m/s^2", "Largest change of the mean specific force against the rest so far",
       rest<&RestConfig::accel_mean_mps2>, kPositive},
      {"rest.gnss_drift_sigma", "", "Largest change of the GNSS position at rest, in its standard deviations",
       rest<&RestConfig::gnss_drift_sigma>, kPositive},
      {"rest.zupt_std_mps", "m/s", "Standard deviation of a zero-velocity update", rest<&RestConfig::zupt_std_mps>,
       kPositive},
      {"rest.zaru_std_dps", "deg/s",
       "Standard deviation of a zero-rate update, added to the gyro noise of the mean rate",
       rest<&RestConfig::zaru_std_dps>, kNotNegative},
      {"rest.interval_s", "s", "Time between two zero-velocity and zero-rate updates", rest<&RestConfig::interval_s>,
       kPositive},

      // [initial]
      {"initial.roll_pitch_std_deg", "deg",
       "Standard deviation of the first roll and pitch; at least what the accelerometers' turn-on bias makes of it",
       initial<&InitialConfig::roll_pitch_std_deg>, kPositive},
      {"initial.heading_std_deg", "deg", "Standard deviation of the first heading",
       initial<&InitialConfig::heading_std_deg>, kPositive},
      {"initial.velocity_std_mps", "m/s", "Standard deviation of the first velocity",
       initial<&InitialConfig::velocity_std_mps>, kPositive},

      // [filter]
      {"filter.model", "",
       "Error of filter and smoother: on SE_2(3) x T(6), multiplicative quaternion, or Euler angles",
       filter<&FilterConfig::model>, Words{{"lie", "mekf", "euler"}}},
      {"filter.mechanization", "", "Strapdown step: closed form over the sample, or as the TAES paper prints it",
       filter<&FilterConfig::mechanization>, Words{{"exact", "paper"}}},
      {"filter.gravity", "", "Gravity model: WGS 84 normal gravity, or J2 gravitation", filter<&FilterConfig::gravity>,
       Words{{"normal", "j2"}}},
      {"filter.covariance_reset", "",
       "Carry the covariance to the corrected state after each update (J_r of the left error)",
       filter<&FilterConfig::covariance_reset>},

      // [output]
      {"output.formats", "", "Trajectory files to write: trajectory.csv, trajectory.sbet with trajectory.smrmsg",
       output<&OutputConfig::formats>, Words{{"csv", "sbet"}}},
      {"output.filtered", "", "Write filtered.csv as well, the forward filter only", output<&OutputConfig::filtered>},
      {"output.reference_point_b_m", "m", "From the IMU to the point whose trajectory is wanted: forward, right, down",
       output<&OutputConfig::reference_point_b_m>, within(-100.0, 100.0)},
      {"output.boresight_deg", "deg", "Roll, pitch, yaw (ZYX) in the body of the axes whose attitude is wanted",
       output<&OutputConfig::boresight_deg>, within(-360.0, 360.0)},
      {"output.rate_hz", "Hz", "Epochs per second at most: the first IMU epoch at or after each step of the rate",
       output<&OutputConfig::rate_hz>, kPositive, none},
      {"output.start_time_s", "s", "First time of the trajectory files; the run itself takes the whole flight",
       output<&OutputConfig::start_time_s>, Anything{}, none},
      {"output.stop_time_s", "s", "Last time of the trajectory files", output<&OutputConfig::stop_time_s>, Anything{},
       none},
  };
}

}  // namespace

const std::vector<Field>& field_table() {
  static const std::vector<Field> table = make_table();
  return table;
}

std::string_view section_of(std::string_view key) {
  const std::size_t dot = key.find('.');
  return dot == std::string_view::npos ? std::string_view{} : key.substr(0, dot);
}

std::string_view member_of(std::string_view key) {
  const std::size_t dot = key.find('.');
  return dot == std::string_view::npos ? key : key.substr(dot + 1);
}

std::vector<std::string> config_sections() {
  std::vector<std::string> sections;
  for (const Field& field : field_table()) {
    if (sections.empty() || sections.back() != section_of(field.key)) {
      sections.emplace_back(section_of(field.key));
    }
  }
  return sections;
}

}  // namespace liealign
