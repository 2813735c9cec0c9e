// Laws of the configuration: the field table covers the struct, every value survives the trip out and back, and
// every refusal says where, what and what is allowed.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <ostream>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "liealign/core/error.hpp"
#include "liealign/pipeline/config.hpp"
#include "liealign/pipeline/field_table.hpp"

namespace liealign {

// So that gtest prints an entry instead of its bytes.
void PrintTo(const ConfigEntry& entry, std::ostream* out) { *out << entry.key << " = " << toml_text(entry.value); }

namespace {

using Pairs = std::vector<std::pair<std::string, ConfigValue>>;

const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInf = std::numeric_limits<double>::infinity();

Pairs pairs(const Config& config) {
  Pairs list;
  for (const ConfigEntry& entry : config_entries(config)) list.emplace_back(entry.key, entry.value);
  return list;
}

// A Config with every member different from its default, and what its entries must be.
Config changed_config() {
  Config c;
  c.imu = {.file = "log\\imu.csv",
           .model = "bmi088",
           .sample = "increment",
           .gyro_unit = "dps",
           .accel_unit = "g",
           .axes = "RFU",
           .mounting_rpy_deg = {1.5, -2.0, 179.25},
           .noise_scale = 1.25,
           .gyro_arw_deg_sqrt_h = 0.11,
           .accel_vrw_mps_sqrt_h = 0.012,
           .gyro_bias_instability_deg_h = 2.5,
           .accel_bias_instability_ug = 13.0,
           .gyro_bias_turn_on_deg_h = 140.0,
           .accel_bias_turn_on_mg = 1.4,
           .bias_correlation_time_s = 101.0,
           .max_gap_s = 0.2,
           .gap_gyro_std_dps = 21.0,
           .gap_accel_std_mps2 = 2.1};
  c.gnss = {.file = "gnss \"1\".csv",
            .week = 2238,
            .lever_arm_b_m = {0.1, -0.05, -0.3},
            .latency_s = -0.125,
            .velocity_latency_s = 0.0625,
            .error_model = "white",
            .std_scale = 1.75,
            .std_floor_m = 0.006,
            .use_velocity = false,
            .velocity_std_mps = 0.11,
            .velocity_std_floor_mps = 0.03,
            .heading_offset_deg = 90.5,
            .accept_fix = {1, 2},
            .outlier = "reject",
            .outlier_probability = 0.99,
            .reacquire_after = 6};
  c.baro = {.file = "baro.csv", .std_m = 0.4, .bias_std_m = 8.0, .bias_correlation_time_s = 601.0};
  c.align = {.start = "moving",
             .heading_guess_deg = 271.0,
             .heading_guess_std_deg = 22.0,
             .grid_step_deg = 10.0,
             .grid_heading_std_deg = 14.0,
             .triple_step_deg = 7.0,
             .tolerance_deg = 0.004,
             .max_evaluations = 41,
             .max_time_s = 0.0,
             .max_rest_s = 60.5,
             .max_sigma_deg = 1.1};
  c.rest = {.min_duration_s = 5.5,
            .gyro_std_dps = 6.5,
            .gyro_mean_dps = 0.55,
            .accel_std_mps2 = 0.65,
            .accel_mean_mps2 = 0.17,
            .gnss_drift_sigma = 5.25,
            .zupt_std_mps = 0.0055,
            .zaru_std_dps = 0.05,
            .interval_s = 1.5};
  c.initial = {.roll_pitch_std_deg = 0.4, .heading_std_deg = 1.6, .velocity_std_mps = 0.0004};
  c.filter = {.model = "mekf", .mechanization = "paper", .gravity = "j2", .covariance_reset = false};
  c.output = {.formats = {"sbet", "csv"},
              .filtered = true,
              .reference_point_b_m = {0.2, -0.01, 0.15},
              .boresight_deg = {0.5, -90.0, 1.5},
              .rate_hz = 12.5,
              .start_time_s = -1.5,
              .stop_time_s = 1e6};
  return c;
}

Pairs changed_pairs() {
  using Doubles = std::vector<double>;
  using Wholes = std::vector<long long>;
  using S = std::string;
  return {
      {"imu.file", S("log\\imu.csv")},
      {"imu.model", S("bmi088")},
      {"imu.sample", S("increment")},
      {"imu.gyro_unit", S("dps")},
      {"imu.accel_unit", S("g")},
      {"imu.axes", S("RFU")},
      {"imu.mounting_rpy_deg", Doubles{1.5, -2.0, 179.25}},
      {"imu.noise_scale", 1.25},
      {"imu.gyro_arw_deg_sqrt_h", 0.11},
      {"imu.accel_vrw_mps_sqrt_h", 0.012},
      {"imu.gyro_bias_instability_deg_h", 2.5},
      {"imu.accel_bias_instability_ug", 13.0},
      {"imu.gyro_bias_turn_on_deg_h", 140.0},
      {"imu.accel_bias_turn_on_mg", 1.4},
      {"imu.bias_correlation_time_s", 101.0},
      {"imu.max_gap_s", 0.2},
      {"imu.gap_gyro_std_dps", 21.0},
      {"imu.gap_accel_std_mps2", 2.1},
      {"gnss.file", S("gnss \"1\".csv")},
      {"gnss.week", 2238LL},
      {"gnss.lever_arm_b_m", Doubles{0.1, -0.05, -0.3}},
      {"gnss.latency_s", -0.125},
      {"gnss.velocity_latency_s", 0.0625},
      {"gnss.error_model", S("white")},
      {"gnss.std_scale", 1.75},
      {"gnss.std_floor_m", 0.006},
      {"gnss.use_velocity", false},
      {"gnss.velocity_std_mps", 0.11},
      {"gnss.velocity_std_floor_mps", 0.03},
      {"gnss.heading_offset_deg", 90.5},
      {"gnss.accept_fix", Wholes{1, 2}},
      {"gnss.outlier", S("reject")},
      {"gnss.outlier_probability", 0.99},
      {"gnss.reacquire_after", 6LL},
      {"baro.file", S("baro.csv")},
      {"baro.std_m", 0.4},
      {"baro.bias_std_m", 8.0},
      {"baro.bias_correlation_time_s", 601.0},
      {"align.start", S("moving")},
      {"align.heading_guess_deg", 271.0},
      {"align.heading_guess_std_deg", 22.0},
      {"align.grid_step_deg", 10.0},
      {"align.grid_heading_std_deg", 14.0},
      {"align.triple_step_deg", 7.0},
      {"align.tolerance_deg", 0.004},
      {"align.max_evaluations", 41LL},
      {"align.max_time_s", 0.0},
      {"align.max_rest_s", 60.5},
      {"align.max_sigma_deg", 1.1},
      {"rest.min_duration_s", 5.5},
      {"rest.gyro_std_dps", 6.5},
      {"rest.gyro_mean_dps", 0.55},
      {"rest.accel_std_mps2", 0.65},
      {"rest.accel_mean_mps2", 0.17},
      {"rest.gnss_drift_sigma", 5.25},
      {"rest.zupt_std_mps", 0.0055},
      {"rest.zaru_std_dps", 0.05},
      {"rest.interval_s", 1.5},
      {"initial.roll_pitch_std_deg", 0.4},
      {"initial.heading_std_deg", 1.6},
      {"initial.velocity_std_mps", 0.0004},
      {"filter.model", S("mekf")},
      {"filter.mechanization", S("paper")},
      {"filter.gravity", S("j2")},
      {"filter.covariance_reset", false},
      {"output.formats", std::vector<S>{"sbet", "csv"}},
      {"output.filtered", true},
      {"output.reference_point_b_m", Doubles{0.2, -0.01, 0.15}},
      {"output.boresight_deg", Doubles{0.5, -90.0, 1.5}},
      {"output.rate_hz", 12.5},
      {"output.start_time_s", -1.5},
      {"output.stop_time_s", 1e6},
  };
}

std::string refusal(const std::vector<ConfigEntry>& entries, const std::string& source = "FLIGHT.toml") {
  try {
    (void)apply_config(Config{}, entries, source);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

std::string refusal(const std::string& key, const ConfigValue& value) { return refusal({{key, value, 9, 0}}); }

Config applied(const std::string& key, const ConfigValue& value) { return apply_config(Config{}, {{key, value}}, ""); }

ConfigValue text(const char* word) { return std::string(word); }

// ---- a reader of what dump_config writes: one `key = value` a line, comments on lines of their own ----------------

std::string unescaped(const std::string& quoted) {
  std::string out;
  for (std::size_t i = 1; i + 1 < quoted.size(); ++i) {
    if (quoted[i] != '\\') {
      out += quoted[i];
      continue;
    }
    const char kind = quoted[++i];
    if (kind == 'u') {
      out += static_cast<char>(std::stoi(quoted.substr(i + 1, 4), nullptr, 16));
      i += 4;
    } else {
      out += kind == 'n' ? '\n' : kind == 't' ? '\t' : kind == 'r' ? '\r' : kind;
    }
  }
  return out;
}

template <typename Number>
Number number_from(const std::string& digits) {
  Number value{};
  const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  EXPECT_EQ(result.ptr, digits.data() + digits.size()) << digits;
  return value;
}

bool is_float(const std::string& digits) { return digits.find_first_of(".e") != std::string::npos; }

ConfigValue value_from(const std::string& toml) {
  if (toml == "true" || toml == "false") return toml == "true";
  if (toml[0] == '"') return unescaped(toml);
  if (toml[0] != '[') return is_float(toml) ? ConfigValue{number_from<double>(toml)} : number_from<long long>(toml);
  std::vector<double> reals;
  std::vector<long long> wholes;
  std::vector<std::string> texts;
  for (std::size_t begin = 1; begin < toml.size();) {
    const std::size_t end = toml.find_first_of(",]", begin);
    const std::string item = toml.substr(begin, end - begin);
    begin = end + 2;
    if (item[0] == '"') {
      texts.push_back(unescaped(item));
    } else {
      is_float(toml) ? reals.push_back(number_from<double>(item)) : wholes.push_back(number_from<long long>(item));
    }
  }
  if (!texts.empty()) return texts;
  return is_float(toml) ? ConfigValue{reals} : ConfigValue{wholes};
}

std::vector<ConfigEntry> entries_from_dump(const std::string& dump) {
  std::vector<ConfigEntry> entries;
  std::string section;
  for (std::size_t begin = 0, line = 1; begin < dump.size(); ++line) {
    const std::size_t end = dump.find('\n', begin);
    const std::string row = dump.substr(begin, end - begin);
    begin = end + 1;
    if (row.empty() || row[0] == '#') continue;
    if (row[0] == '[') {
      section = row.substr(1, row.size() - 2);
      continue;
    }
    const std::size_t equals = row.find(" = ");
    entries.push_back({section + '.' + row.substr(0, equals), value_from(row.substr(equals + 3)), line, 1});
  }
  return entries;
}

bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

// ---- the table and the struct -------------------------------------------------------------------------------------

// The structured bindings stop compiling when a section gains or loses a member: then the table needs a row as well.
std::size_t members_of_the_struct() {
  const Config c;
  [[maybe_unused]] const auto& [i1, i2, i3, i4, i5, i6, i7, i8, i9, i10, i11, i12, i13, i14, i15, i16, i17, i18] =
      c.imu;
  [[maybe_unused]] const auto& [g1, g2, g3, g4, g5, g6, g7, g8, g9, g10, g11, g12, g13, g14, g15, g16] = c.gnss;
  [[maybe_unused]] const auto& [b1, b2, b3, b4] = c.baro;
  [[maybe_unused]] const auto& [a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11] = c.align;
  [[maybe_unused]] const auto& [r1, r2, r3, r4, r5, r6, r7, r8, r9] = c.rest;
  [[maybe_unused]] const auto& [n1, n2, n3] = c.initial;
  [[maybe_unused]] const auto& [f1, f2, f3, f4] = c.filter;
  [[maybe_unused]] const auto& [o1, o2, o3, o4, o5, o6, o7] = c.output;
  [[maybe_unused]] const auto& [s1, s2, s3, s4, s5, s6, s7, s8] = c;
  return 18 + 16 + 4 + 11 + 9 + 3 + 4 + 7;
}

TEST(ConfigTable, has_one_key_per_member_of_the_struct) {
  std::set<std::string> keys;
  for (const ConfigField& field : config_fields()) keys.insert(field.key);
  EXPECT_EQ(config_fields().size(), members_of_the_struct());
  EXPECT_EQ(keys.size(), members_of_the_struct());
}

TEST(ConfigTable, binds_every_key_to_the_member_of_its_name_in_the_order_of_the_struct) {
  const Pairs actual = pairs(changed_config());
  const Pairs expected = changed_pairs();
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(actual[i].first, expected[i].first);
    EXPECT_EQ(actual[i].second, expected[i].second) << expected[i].first;
    EXPECT_EQ(config_fields()[i].key, expected[i].first);
  }
}

TEST(ConfigTable, unit_is_the_one_the_key_ends_in) {
  const std::vector<std::pair<std::string, std::string>> endings = {{"_deg_sqrt_h", "deg/sqrt(h)"},
                                                                    {"_mps_sqrt_h", "m/s/sqrt(h)"},
                                                                    {"_deg_h", "deg/h"},
                                                                    {"_mps2", "m/s^2"},
                                                                    {"_dps", "deg/s"},
                                                                    {"_mps", "m/s"},
                                                                    {"_deg", "deg"},
                                                                    {"_ug", "ug"},
                                                                    {"_mg", "mg"},
                                                                    {"_m", "m"},
                                                                    {"_s", "s"},
                                                                    {"_hz", "Hz"}};
  std::set<std::string> met;
  for (const ConfigField& field : config_fields()) {
    std::string unit;
    for (const auto& [ending, name] : endings) {
      if (unit.empty() && field.key.ends_with(ending)) unit = name;
    }
    EXPECT_EQ(field.unit, unit) << field.key;
    met.insert(unit);
  }
  EXPECT_EQ(met.size(), endings.size() + 1) << "every ending is in use, and some keys have no unit";
}

TEST(ConfigTable, every_key_has_a_one_line_meaning_and_a_type) {
  std::set<std::string> meanings;
  for (const ConfigField& field : config_fields()) {
    EXPECT_GT(field.meaning.size(), 10U) << field.key;
    EXPECT_EQ(field.meaning.find_first_of("\n\r\t"), std::string::npos) << field.key;
    EXPECT_FALSE(field.meaning.ends_with('.')) << field.key;
    EXPECT_FALSE(field.type.empty()) << field.key;
    meanings.insert(field.meaning);
  }
  // The two pairs IMU/GNSS differ as well: no meaning was copied and left.
  EXPECT_EQ(meanings.size(), config_fields().size());
}

TEST(ConfigTable, what_is_allowed_fits_the_type_of_the_member) {
  for (const Field& field : field_table()) {
    const bool is_text = std::holds_alternative<Member<std::string>>(field.member) ||
                         std::holds_alternative<Member<std::vector<std::string>>>(field.member);
    const bool is_flag = std::holds_alternative<Member<bool>>(field.member);
    const bool is_optional = std::holds_alternative<Member<std::optional<double>>>(field.member) ||
                             std::holds_alternative<Member<std::optional<int>>>(field.member);
    if (std::holds_alternative<Range>(field.allowed)) {
      EXPECT_FALSE(is_text || is_flag) << field.key;
    }
    if (std::holds_alternative<Words>(field.allowed)) {
      EXPECT_TRUE(is_text) << field.key;
    }
    if (std::holds_alternative<AxisLetters>(field.allowed)) {
      EXPECT_TRUE(is_text) << field.key;
    }
    EXPECT_EQ(is_optional, field.unset != Unset::never) << field.key;
  }
}

TEST(ConfigTable, defaults_are_those_of_the_struct) {
  const auto field = [](const std::string& key) {
    for (const ConfigField& row : config_fields()) {
      if (row.key == key) return row;
    }
    throw std::out_of_range(key);
  };
  EXPECT_EQ(field("imu.model").default_value, "\"adis16495\"");
  EXPECT_EQ(field("imu.noise_scale").default_value, "\"auto\"");
  EXPECT_EQ(field("gnss.latency_s").default_value, "\"auto\"");
  EXPECT_EQ(field("gnss.std_scale").default_value, "\"auto\"");
  EXPECT_EQ(field("gnss.velocity_latency_s").default_value, "\"auto\"");
  EXPECT_EQ(field("gnss.error_model").default_value, "\"auto\"");
  EXPECT_EQ(field("gnss.heading_offset_deg").default_value, "0.0");
  EXPECT_EQ(field("baro.std_m").default_value, "0.5");
  EXPECT_EQ(field("baro.bias_std_m").default_value, "10.0");
  EXPECT_EQ(field("baro.bias_correlation_time_s").default_value, "600.0");
  EXPECT_EQ(field("gnss.lever_arm_b_m").default_value, "[0.0, 0.0, 0.0]");
  EXPECT_EQ(field("gnss.accept_fix").default_value, "[1, 2, 3, 4, 5, 6]");
  EXPECT_EQ(field("gnss.use_velocity").default_value, "true");
  EXPECT_EQ(field("align.max_evaluations").default_value, "40");
  EXPECT_EQ(field("initial.roll_pitch_std_deg").default_value, "0.3333333333333333");
  for (const char* key : {"imu.file", "gnss.file", "baro.file", "imu.gyro_arw_deg_sqrt_h", "align.heading_guess_deg"}) {
    EXPECT_EQ(field(key).default_value, "") << key;
  }
}

TEST(ConfigTable, types_say_range_and_words) {
  std::vector<std::pair<std::string, std::string>> types;
  for (const ConfigField& row : config_fields()) types.emplace_back(row.key, row.type);
  const auto has = [&](const char* key, const char* type) {
    return std::find(types.begin(), types.end(), std::pair<std::string, std::string>(key, type)) != types.end();
  };
  EXPECT_TRUE(has("imu.file", "string"));
  EXPECT_TRUE(has("imu.max_gap_s", "number > 0"));
  EXPECT_TRUE(has("imu.noise_scale", "number > 0 or \"auto\""));
  EXPECT_TRUE(has("imu.gyro_arw_deg_sqrt_h", "number >= 0"));
  EXPECT_TRUE(has("gnss.latency_s", "number in [-10, 10] or \"auto\""));
  EXPECT_TRUE(has("gnss.velocity_latency_s", "number in [-10, 10] or \"auto\""));
  EXPECT_TRUE(has("gnss.error_model", "one of \"auto\", \"white\", \"correlated\""));
  EXPECT_TRUE(has("gnss.heading_offset_deg", "number in [-360, 360]"));
  EXPECT_TRUE(has("baro.bias_correlation_time_s", "number > 0"));
  EXPECT_TRUE(has("gnss.outlier_probability", "number in (0, 1)"));
  EXPECT_TRUE(has("align.grid_step_deg", "number in (0, 90]"));
  EXPECT_TRUE(has("align.heading_guess_deg", "finite number"));
  EXPECT_TRUE(has("gnss.lever_arm_b_m", "3 numbers in [-100, 100]"));
  EXPECT_TRUE(has("gnss.accept_fix", "list of at least one whole number in [0, 9]"));
  EXPECT_TRUE(has("gnss.reacquire_after", "whole number >= 1"));
  EXPECT_TRUE(has("filter.mechanization", "one of \"exact\", \"paper\""));
  EXPECT_TRUE(has("filter.covariance_reset", "true or false"));
}

// ---- out and back -------------------------------------------------------------------------------------------------

TEST(ConfigEntries, applied_to_the_defaults_give_the_config_again) {
  const Config changed = changed_config();
  EXPECT_EQ(pairs(apply_config(Config{}, config_entries(changed), "")), pairs(changed));
  EXPECT_EQ(pairs(apply_config(Config{}, config_entries(Config{}), "")), pairs(Config{}));
}

TEST(ConfigEntries, leave_out_the_optional_keys_that_are_unset) {
  std::set<std::string> unset;
  for (const auto& [key, value] : changed_pairs()) unset.insert(key);
  for (const auto& [key, value] : pairs(Config{})) unset.erase(key);
  EXPECT_EQ(unset, (std::set<std::string>{"imu.noise_scale", "imu.gyro_arw_deg_sqrt_h", "imu.accel_vrw_mps_sqrt_h",
                                          "imu.gyro_bias_instability_deg_h", "imu.accel_bias_instability_ug",
                                          "imu.gyro_bias_turn_on_deg_h", "imu.accel_bias_turn_on_mg", "gnss.latency_s",
                                          "gnss.velocity_latency_s", "gnss.std_scale", "align.heading_guess_deg",
                                          "gnss.week", "output.rate_hz", "output.start_time_s", "output.stop_time_s"}));
}

TEST(ConfigEntries, one_entry_changes_exactly_one_member) {
  const Pairs before = pairs(Config{});
  for (const auto& [key, value] : changed_pairs()) {
    Pairs after = pairs(applied(key, value));
    std::vector<std::string> differing;
    for (const auto& pair : after) {
      if (std::find(before.begin(), before.end(), pair) == before.end()) differing.push_back(pair.first);
    }
    EXPECT_EQ(differing, std::vector<std::string>{key});
    // Nothing went missing either: the rest of the entries are those from before.
    const auto is_changed = [&changed = key](const auto& pair) { return pair.first == changed; };
    std::erase_if(after, is_changed);
    Pairs rest = before;
    std::erase_if(rest, is_changed);
    EXPECT_EQ(after, rest) << key;
  }
}

TEST(ConfigDump, reads_back_as_the_same_config) {
  for (const Config& config : {Config{}, changed_config()}) {
    const std::string dump = dump_config(config);
    const Config back = apply_config(Config{}, entries_from_dump(dump), "config.toml");
    EXPECT_EQ(pairs(back), pairs(config));
    EXPECT_EQ(dump_config(back), dump);
  }
}

TEST(ConfigDump, keeps_every_bit_of_a_number) {
  for (const double value : {0.0, -0.0, 5.0, -7.0, 1.0 / 3.0, 0.1, 1e22, 1e-5, 123456789012345680.0, 5e-324, -1.7e308,
                             std::nextafter(1.0, 2.0), 271.0, 1e5, 1e15, 1e16, 1e17}) {
    Config config;
    config.align.heading_guess_deg = value;
    const std::vector<ConfigEntry> entries = entries_from_dump(dump_config(config));
    const Config back = apply_config(Config{}, entries, "");
    EXPECT_TRUE(same_bits(back.align.heading_guess_deg.value(), value)) << value;
  }
}

TEST(ConfigDump, keeps_every_string) {
  for (const std::string& value :
       {std::string("C:\\Users\\n\\u0041.csv"), std::string("a \"b\" # c"), std::string("Flüge/飛行.csv"),
        std::string("tab\tline\nreturn\r\x01\x1f\x7f end"), std::string(""), std::string("'= [x]")}) {
    Config config;
    config.imu.file = value;
    EXPECT_EQ(apply_config(Config{}, entries_from_dump(dump_config(config)), "").imu.file, value);
  }
}

TEST(ConfigDump, writes_meaning_and_unit_before_every_key_and_unset_keys_as_comments) {
  const std::string dump = dump_config(Config{});
  EXPECT_NE(dump.find("\n[imu]\n"), std::string::npos);
  EXPECT_NE(dump.find("# Correlation time of the drifting biases [s]; number > 0.\nbias_correlation_time_s = 100.0\n"),
            std::string::npos);
  EXPECT_NE(dump.find("\n# gyro_arw_deg_sqrt_h = ...  # from the profile\n"), std::string::npos);
  EXPECT_NE(dump.find("\n# heading_guess_deg = ...  # none\n"), std::string::npos);
  EXPECT_NE(dump.find("\nlatency_s = \"auto\"\n"), std::string::npos);
  for (const ConfigField& field : config_fields()) {
    const std::string unit = field.unit.empty() ? "" : " [" + field.unit + "]";
    EXPECT_NE(dump.find("# " + field.meaning + unit + "; " + field.type + ".\n"), std::string::npos) << field.key;
  }
}

// ---- what is accepted ---------------------------------------------------------------------------------------------

TEST(ConfigApply, whole_number_stands_for_a_number) {
  EXPECT_EQ(applied("imu.max_gap_s", 2LL).imu.max_gap_s, 2.0);
  EXPECT_EQ(applied("gnss.latency_s", 1LL).gnss.latency_s, 1.0);
  EXPECT_EQ(applied("gnss.lever_arm_b_m", std::vector<long long>{1, -2, 3}).gnss.lever_arm_b_m,
            (std::array<double, 3>{1.0, -2.0, 3.0}));
}

TEST(ConfigApply, auto_unsets_the_four_automatic_keys_and_only_those) {
  Config base;
  base.imu.noise_scale = base.gnss.latency_s = base.gnss.velocity_latency_s = base.gnss.std_scale = 2.0;
  for (const Field& field : field_table()) {
    if (field.unset == Unset::never) continue;
    const bool automatic = field.key == "imu.noise_scale" || field.key == "gnss.latency_s" ||
                           field.key == "gnss.velocity_latency_s" || field.key == "gnss.std_scale";
    const std::vector<ConfigEntry> entries = {{std::string(field.key), text("auto")}};
    if (automatic) {
      EXPECT_EQ(field_value(field, apply_config(base, entries, "")), std::nullopt) << field.key;
    } else {
      EXPECT_THROW((void)apply_config(base, entries, ""), ConfigError) << field.key;
    }
  }
}

TEST(ConfigApply, keeps_what_the_base_says_where_no_entry_speaks) {
  const Config base = changed_config();
  EXPECT_EQ(pairs(apply_config(base, {}, "")), pairs(base));
  const Config both = apply_config(base, {{"imu.max_gap_s", 0.7}}, "");
  EXPECT_EQ(both.imu.max_gap_s, 0.7);
  EXPECT_EQ(both.gnss.latency_s, base.gnss.latency_s);
}

TEST(ConfigApply, model_is_the_name_of_a_profile) {
  EXPECT_EQ(applied("imu.model", text("bmi088")).imu.model, "bmi088");
  const std::string said = refusal("imu.model", text("bmi08"));
  EXPECT_EQ(said.rfind("FLIGHT.toml:9: imu.model is \"bmi08\"; expected one of \"adis16495\", ", 0), 0U) << said;
  EXPECT_TRUE(said.ends_with("; did you mean \"bmi088\"?")) << said;
}

TEST(ConfigAxes, exactly_the_24_right_handed_sets_are_accepted) {
  const std::string letters = "FBRLDU";
  int right = 0, left = 0, malformed = 0;
  for (const char x : letters) {
    for (const char y : letters) {
      for (const char z : letters) {
        const std::string axes = {x, y, z};
        const Axes kind = classify_axes(axes);
        right += kind == Axes::right_handed;
        left += kind == Axes::left_handed;
        malformed += kind == Axes::malformed;
        EXPECT_EQ(refusal("imu.axes", axes) == "accepted", kind == Axes::right_handed) << axes;
      }
    }
  }
  EXPECT_EQ(right, 24);
  EXPECT_EQ(left, 24);
  EXPECT_EQ(malformed, 216 - 48);
  for (const char* axes : {"FRD", "FLU", "RFU", "BLD"}) EXPECT_EQ(classify_axes(axes), Axes::right_handed) << axes;
  for (const char* axes : {"FRU", "FLD", "RFD", "LFU"}) EXPECT_EQ(classify_axes(axes), Axes::left_handed) << axes;
}

TEST(ConfigRange, limits_hold_to_the_last_bit) {
  const double tiny = std::numeric_limits<double>::denorm_min();
  const auto check = [](const char* key, double value, bool accepted) {
    EXPECT_EQ(refusal(key, value) == "accepted", accepted) << key << " = " << value;
  };
  check("imu.noise_scale", 0.0, false);
  check("imu.noise_scale", tiny, true);
  check("imu.gyro_arw_deg_sqrt_h", 0.0, true);
  check("imu.gyro_arw_deg_sqrt_h", -tiny, false);
  check("gnss.latency_s", -10.0, true);
  check("gnss.latency_s", std::nextafter(10.0, 11.0), false);
  check("gnss.outlier_probability", 0.0, false);
  check("gnss.outlier_probability", 1.0, false);
  check("gnss.outlier_probability", std::nextafter(1.0, 0.0), true);
  check("align.grid_step_deg", 0.0, false);
  check("align.grid_step_deg", 90.0, true);
  check("align.grid_step_deg", std::nextafter(90.0, 91.0), false);
  check("align.heading_guess_deg", -1e6, true);
  check("align.max_time_s", 0.0, true);
  check("gnss.std_floor_m", 0.0, true);
  check("rest.zaru_std_dps", 0.0, true);
}

TEST(ConfigRange, nan_and_infinity_are_refused_by_every_number) {
  for (const Field& field : field_table()) {
    for (const double value : {kNan, kInf, -kInf}) {
      const std::string key(field.key);
      EXPECT_THROW((void)applied(key, value), ConfigError) << key;
      EXPECT_THROW((void)applied(key, std::vector<double>{0.0, value, 0.0}), ConfigError) << key;
    }
  }
}

TEST(ConfigRange, wrong_type_is_refused_by_every_key) {
  const std::vector<ConfigValue> samples = {true,
                                            5LL,
                                            0.5,
                                            std::string("exact"),
                                            std::vector<long long>{1, 2, 3},
                                            std::vector<double>{0.5, 1.5, 2.5},
                                            std::vector<std::string>{"a"}};
  // Which of the samples each kind of member may take: bool, whole, real, string, wholes, reals, strings.
  const auto takes = [](const Field& field) -> std::vector<bool> {
    const auto is = [&](auto kind) { return std::holds_alternative<Member<decltype(kind)>>(field.member); };
    if (is(bool{})) return {true, false, false, false, false, false, false};
    if (is(int{}) || is(std::optional<int>{})) return {false, true, false, false, false, false, false};
    if (is(double{}) || is(std::optional<double>{})) return {false, true, true, false, false, false, false};
    if (is(std::string{})) return {false, false, false, true, false, false, false};
    if (is(std::array<double, 3>{})) return {false, false, false, false, true, true, false};
    if (is(std::vector<int>{})) return {false, false, false, false, true, false, false};
    return {false, false, false, false, false, false, true};
  };
  for (const Field& field : field_table()) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      // A sample of the right type may still be out of range or the wrong word; one of the wrong type never passes.
      if (takes(field)[i]) continue;
      EXPECT_THROW((void)applied(std::string(field.key), samples[i]), ConfigError) << field.key << " " << i;
    }
  }
}

// ---- what a refusal says ------------------------------------------------------------------------------------------

TEST(ConfigError, unknown_key_names_the_nearest) {
  EXPECT_EQ(refusal({{"imu.gyro_awr_deg_sqrt_h", 0.1, 7, 1}}),
            "FLIGHT.toml:7:1: unknown key \"imu.gyro_awr_deg_sqrt_h\"; did you mean \"imu.gyro_arw_deg_sqrt_h\"?");
  EXPECT_EQ(refusal("imu.noise.scale", 1.0),
            "FLIGHT.toml:9: unknown key \"imu.noise.scale\"; did you mean \"imu.noise_scale\"?");
  EXPECT_EQ(refusal("imu.FILE", text("a")), "FLIGHT.toml:9: unknown key \"imu.FILE\"; did you mean \"imu.file\"?");
}

TEST(ConfigError, unknown_key_that_lacks_its_unit_names_the_full_one) {
  EXPECT_EQ(refusal("gnss.lever_arm", 1.0),
            "FLIGHT.toml:9: unknown key \"gnss.lever_arm\"; did you mean \"gnss.lever_arm_b_m\"?");
  EXPECT_EQ(refusal("align.heading_guess", 1.0),
            "FLIGHT.toml:9: unknown key \"align.heading_guess\"; did you mean \"align.heading_guess_deg\" or "
            "\"align.heading_guess_std_deg\"?");
}

TEST(ConfigError, key_of_another_section_names_that_section) {
  EXPECT_EQ(refusal("imu.lever_arm_b_m", 1.0),
            "FLIGHT.toml:9: unknown key \"imu.lever_arm_b_m\"; did you mean \"gnss.lever_arm_b_m\"?");
}

TEST(ConfigError, unknown_key_with_nothing_near_lists_the_section) {
  EXPECT_EQ(refusal("filter.camera", 1.0),
            "FLIGHT.toml:9: unknown key \"filter.camera\"; the keys of [filter] are model, mechanization, gravity, "
            "covariance_reset");
  EXPECT_EQ(refusal("filter.", 1.0),
            "FLIGHT.toml:9: unknown key \"filter.\"; the keys of [filter] are model, mechanization, gravity, "
            "covariance_reset");
}

TEST(ConfigError, unknown_section_names_the_nearest_or_lists_them) {
  EXPECT_EQ(refusal("gnsss.file", text("a")),
            "FLIGHT.toml:9: unknown section \"gnsss\" in key \"gnsss.file\"; did you mean \"gnss\"?");
  EXPECT_EQ(refusal("camera.pixels", 1LL),
            "FLIGHT.toml:9: unknown section \"camera\" in key \"camera.pixels\"; the sections are "
            "imu, gnss, baro, align, rest, initial, filter, output");
  EXPECT_EQ(refusal("noise.gyro_arw_deg_sqrt_h", 1.0),
            "FLIGHT.toml:9: unknown section \"noise\" in key "
            "\"noise.gyro_arw_deg_sqrt_h\"; did you mean \"imu.gyro_arw_deg_sqrt_h\"?");
}

TEST(ConfigError, key_outside_any_section_says_so) {
  EXPECT_EQ(refusal("lever_arm_b_m", 1.0),
            "FLIGHT.toml:9: unknown key \"lever_arm_b_m\" outside any section; did you mean \"gnss.lever_arm_b_m\"?");
  EXPECT_EQ(refusal("file", text("a")),
            "FLIGHT.toml:9: unknown key \"file\" outside any section; did you mean \"imu.file\" or \"gnss.file\" or "
            "\"baro.file\"?");
  EXPECT_EQ(refusal("", text("a")),
            "FLIGHT.toml:9: unknown key \"\" outside any section; the sections are imu, gnss, baro, align, rest, "
            "initial, filter, output");
}

TEST(ConfigError, value_in_place_of_a_section_says_so) {
  EXPECT_EQ(refusal("filter", 3LL),
            "FLIGHT.toml:9: filter is 3; expected a section: the keys of [filter] are model, mechanization, gravity, "
            "covariance_reset");
}

TEST(ConfigError, wrong_number_says_value_and_range) {
  EXPECT_EQ(refusal("gnss.std_scale", -1LL), "FLIGHT.toml:9: gnss.std_scale is -1; expected a number > 0 or \"auto\"");
  EXPECT_EQ(refusal("gnss.std_scale", -1.0),
            "FLIGHT.toml:9: gnss.std_scale is -1.0; expected a number > 0 or \"auto\"");
  EXPECT_EQ(refusal("gnss.std_scale", true),
            "FLIGHT.toml:9: gnss.std_scale is true; expected a number > 0 or \"auto\"");
  EXPECT_EQ(refusal("gnss.latency_s", 11.0),
            "FLIGHT.toml:9: gnss.latency_s is 11.0; expected a number in [-10, 10] or \"auto\"");
  EXPECT_EQ(refusal("gnss.latency_s", text("0.1")),
            "FLIGHT.toml:9: gnss.latency_s is \"0.1\"; expected a number in [-10, 10] or \"auto\"");
  EXPECT_EQ(
      refusal("gnss.latency_s", text("Auto")),
      "FLIGHT.toml:9: gnss.latency_s is \"Auto\"; expected a number in [-10, 10] or \"auto\"; did you mean \"auto\"?");
  EXPECT_EQ(refusal("imu.gyro_arw_deg_sqrt_h", text("auto")),
            "FLIGHT.toml:9: imu.gyro_arw_deg_sqrt_h is \"auto\"; expected a number >= 0");
  EXPECT_EQ(refusal("gnss.outlier_probability", 1LL),
            "FLIGHT.toml:9: gnss.outlier_probability is 1; expected a number in (0, 1)");
  EXPECT_EQ(refusal("align.heading_guess_deg", kNan),
            "FLIGHT.toml:9: align.heading_guess_deg is nan; expected a finite number");
  EXPECT_EQ(refusal("align.heading_guess_deg", -kInf),
            "FLIGHT.toml:9: align.heading_guess_deg is -inf; expected a finite number");
  EXPECT_EQ(refusal("align.max_evaluations", 3LL),
            "FLIGHT.toml:9: align.max_evaluations is 3; expected a whole number >= 4");
  EXPECT_EQ(refusal("align.max_evaluations", 40.0),
            "FLIGHT.toml:9: align.max_evaluations is 40.0; expected a whole number >= 4");
  EXPECT_EQ(refusal("gnss.reacquire_after", 4294967297LL),
            "FLIGHT.toml:9: gnss.reacquire_after is 4294967297; expected a whole number >= 1, at most 2147483647");
}

TEST(ConfigError, wrong_flag_list_or_string_says_value_and_type) {
  EXPECT_EQ(refusal("filter.covariance_reset", 1LL),
            "FLIGHT.toml:9: filter.covariance_reset is 1; expected true or false");
  EXPECT_EQ(refusal("imu.file", 3LL), "FLIGHT.toml:9: imu.file is 3; expected a string");
  EXPECT_EQ(refusal("gnss.lever_arm_b_m", std::vector<double>{0.1, 0.2}),
            "FLIGHT.toml:9: gnss.lever_arm_b_m is [0.1, 0.2]; expected 3 numbers in [-100, 100]");
  EXPECT_EQ(refusal("gnss.lever_arm_b_m", std::vector<double>{0.1, 0.2, -300.0}),
            "FLIGHT.toml:9: gnss.lever_arm_b_m is [0.1, 0.2, -300.0]; expected 3 numbers in [-100, 100]");
  const std::string fixes = "; expected a list of at least one whole number in [0, 9]";
  EXPECT_EQ(refusal("gnss.accept_fix", std::vector<long long>{1, 12}),
            "FLIGHT.toml:9: gnss.accept_fix is [1, 12]" + fixes);
  EXPECT_EQ(refusal("gnss.accept_fix", std::vector<long long>{}), "FLIGHT.toml:9: gnss.accept_fix is []" + fixes);
  const std::string formats = "; expected a list of \"csv\", \"sbet\"";
  EXPECT_EQ(refusal("output.formats", std::vector<std::string>{"csv", "las"}),
            "FLIGHT.toml:9: output.formats is [\"csv\", \"las\"]" + formats);
  EXPECT_EQ(refusal("output.formats", std::vector<long long>{}), "FLIGHT.toml:9: output.formats is []" + formats);
  EXPECT_EQ(refusal("output.formats", text("csv")),
            "FLIGHT.toml:9: output.formats is \"csv\"" + formats + "; did you mean \"csv\"?");
  EXPECT_EQ(refusal("gnss.accept_fix", 1LL), "FLIGHT.toml:9: gnss.accept_fix is 1" + fixes);
  EXPECT_EQ(refusal("gnss.accept_fix", std::vector<std::string>{"fixed", "a\"b"}),
            "FLIGHT.toml:9: gnss.accept_fix is [\"fixed\", \"a\\\"b\"]" + fixes);
}

TEST(ConfigError, wrong_word_lists_the_words_and_names_the_nearest) {
  EXPECT_EQ(refusal("imu.sample", text("increments")),
            "FLIGHT.toml:9: imu.sample is \"increments\"; expected one of \"mean\", "
            "\"instant\", \"increment\"; did you mean \"increment\"?");
  EXPECT_EQ(refusal("gnss.outlier", text("huber")),
            "FLIGHT.toml:9: gnss.outlier is \"huber\"; expected one of \"weight\", \"reject\", \"off\"");
  EXPECT_EQ(refusal("align.start", text("Static")),
            "FLIGHT.toml:9: align.start is \"Static\"; expected one of \"auto\", \"static\", "
            "\"moving\"; did you mean \"static\"?");
  EXPECT_EQ(
      refusal("filter.mechanization", text("exat")),
      "FLIGHT.toml:9: filter.mechanization is \"exat\"; expected one of \"exact\", \"paper\"; did you mean \"exact\"?");
  EXPECT_EQ(refusal("filter.gravity", 2LL), "FLIGHT.toml:9: filter.gravity is 2; expected one of \"normal\", \"j2\"");
}

TEST(ConfigError, wrong_axes_say_whether_the_letters_or_the_hand_are_wrong) {
  EXPECT_EQ(refusal("imu.axes", text("FRX")),
            "FLIGHT.toml:9: imu.axes is \"FRX\"; expected three letters, one of each pair F/B, R/L, "
            "D/U, that make a right-handed set, such as \"FRD\" or \"FLU\"");
  EXPECT_EQ(refusal("imu.axes", text("FRU")),
            "FLIGHT.toml:9: imu.axes is \"FRU\", a left-handed set of axes; expected a right-handed "
            "one, such as \"BRU\", \"FLU\", \"FRD\" with one axis turned around");
}

TEST(ConfigError, key_given_twice_names_the_first_line) {
  EXPECT_EQ(refusal({{"imu.file", text("a"), 3, 1}, {"gnss.file", text("b"), 4, 1}, {"imu.file", text("a"), 12, 1}}),
            "FLIGHT.toml:12:1: imu.file is given twice (first on line 3); give it once");
  EXPECT_EQ(refusal({{"imu.file", text("a")}, {"imu.file", text("b")}}),
            "FLIGHT.toml: imu.file is given twice; give it once");
}

TEST(ConfigError, place_is_as_exact_as_the_reader_knows) {
  const std::string what = ": imu.file is 3; expected a string";
  EXPECT_EQ(refusal({{"imu.file", 3LL, 7, 8}}), "FLIGHT.toml:7:8" + what);
  EXPECT_EQ(refusal({{"imu.file", 3LL, 7, 0}}), "FLIGHT.toml:7" + what);
  EXPECT_EQ(refusal({{"imu.file", 3LL, 0, 0}}), "FLIGHT.toml" + what);
  EXPECT_EQ(refusal({{"imu.file", 3LL}}, ""), "config" + what);
}

TEST(ConfigError, text_stays_on_one_line_whatever_the_value) {
  EXPECT_EQ(refusal("imu.axes", text("F\nR\tD")).find_first_of("\n\t"), std::string::npos);
  EXPECT_EQ(refusal("imu.a\nb", text("x")).find('\n'), std::string::npos);
  EXPECT_EQ(refusal("a\nb.c", text("x")).find('\n'), std::string::npos);
}

TEST(ConfigError, every_key_with_two_neighbouring_letters_swapped_finds_its_way_back) {
  for (const Field& field : field_table()) {
    const std::string key(field.key);
    const std::size_t start = key.find('.') + 1;
    for (std::size_t i = start; i + 1 < key.size(); ++i) {
      std::string swapped = key;
      std::swap(swapped[i], swapped[i + 1]);
      if (swapped == key) continue;
      EXPECT_EQ(nearest_keys(swapped), std::vector<std::string>{key}) << swapped;
    }
  }
}

}  // namespace
}  // namespace liealign
