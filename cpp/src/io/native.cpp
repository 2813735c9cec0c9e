// The native input files imu.csv, gnss.csv and baro.csv: SI and radians out, every doubtful row refused by line and column.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "liealign/core/units.hpp"
#include "liealign/io/csv.hpp"

namespace liealign {
namespace {

// ---- Order in time, common to the three files

enum TimeField : std::size_t { kTime = 0 };  // the first field of all

// Lets rows through whose time is later than the row before; drops exact repetitions and counts them.
struct TimeOrder {
  std::vector<double> values;  // of the last row let through
  std::string time_text;
  std::size_t line = 0;  // its line; 0 before the first
  std::size_t repeats = 0;
  std::size_t first_repeat_line = 0;
};

// Index of the first field in which the rows differ, or their size. Absent values (NaN) are equal.
std::size_t first_difference(const std::vector<double>& a, const std::vector<double>& b) {
  const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  return static_cast<std::size_t>(std::mismatch(a.begin(), a.end(), b.begin(), same).first - a.begin());
}

[[noreturn]] void fail_back_in_time(const CsvTable& table, const CsvRow& row, const TimeOrder& order) {
  fail_at(table, row.line, kTime,
          "time_s is " + std::string(row.cells[table.cell_of_field[kTime]]) + ", before " + order.time_text +
              " on line " + std::to_string(order.line) +
              "; times must not go back: sort the file by time_s or remove the line");
}

// True where the row is to be kept.
bool advance(TimeOrder& order, const CsvTable& table, const CsvRow& row) {
  if (order.line > 0 && row.values[kTime] < order.values[kTime]) fail_back_in_time(table, row, order);
  if (order.line > 0 && row.values[kTime] == order.values[kTime]) {
    const std::size_t field = first_difference(order.values, row.values);
    if (field < row.values.size()) {
      fail_at(table, row.line, kTime,
              "time_s is " + std::string(row.cells[table.cell_of_field[kTime]]) + " as on line " +
                  std::to_string(order.line) + ", but " + std::string(table.fields[field].name) +
                  " differs; expected one row for each time: remove one of the two lines");
    }
    if (order.repeats++ == 0) order.first_repeat_line = row.line;
    return false;
  }
  order.values = row.values;
  order.time_text = row.cells[table.cell_of_field[kTime]];
  order.line = row.line;
  return true;
}

void warn_of_repeats(const TimeOrder& order, const std::string& path, std::vector<std::string>& warnings) {
  if (order.repeats == 0) return;
  const std::string where = path + ":" + std::to_string(order.first_repeat_line) + ":1: ";
  warnings.push_back(where + (order.repeats == 1 ? "1 row repeats the row before it exactly and was dropped"
                                                 : std::to_string(order.repeats) +
                                                       " rows repeat the row before them exactly and were dropped; "
                                                       "this is the first"));
}

// ---- imu.csv

enum ImuField : std::size_t { kGyro = 1, kAccel = 4 };

const std::vector<CsvField>& imu_fields() {
  static const std::vector<CsvField> fields = {
      {"time_s", "s"},           {"gyro_x_rps", "rad/s"},   {"gyro_y_rps", "rad/s"},  {"gyro_z_rps", "rad/s"},
      {"accel_x_mps2", "m/s^2"}, {"accel_y_mps2", "m/s^2"}, {"accel_z_mps2", "m/s^2"}};
  return fields;
}

Vector3d three(const CsvRow& row, std::size_t first) {
  return {row.values[first], row.values[first + 1], row.values[first + 2]};
}

// ---- gnss.csv

enum GnssField : std::size_t {
  kLat = 1,
  kLon,
  kHeight,
  kStd,
  kCov = 7,
  kVelocity = 10,
  kVelocityStd = 13,
  kFix = 16,
  kHeading = 17
};

const std::vector<CsvField>& gnss_fields() {
  constexpr std::string_view kAboveZero = "a number above 0";
  // The bounds keep the square of a standard deviation a normal number.
  constexpr double kLeastStd = 1e-150;
  constexpr double kMostStd = 1e150;
  constexpr double kMostFix = std::numeric_limits<int>::max();
  static const std::vector<CsvField> fields = {
      {"time_s", "s"},
      {"lat_deg", "deg", true, "a number from -90 to 90", -90.0, 90.0},
      {"lon_deg", "deg", true, "a number from -180 to 360", -180.0, 360.0},
      {"height_m", "m above the ellipsoid", true, "a number from -1000 to 100000", -1e3, 1e5},
      {"std_n_m", "m", true, kAboveZero, kLeastStd, kMostStd},
      {"std_e_m", "m", true, kAboveZero, kLeastStd, kMostStd},
      {"std_d_m", "m", true, kAboveZero, kLeastStd, kMostStd},
      {"cov_ne_m2", "m^2", false},
      {"cov_nd_m2", "m^2", false},
      {"cov_ed_m2", "m^2", false},
      {"vn_mps", "m/s", false},
      {"ve_mps", "m/s", false},
      {"vd_mps", "m/s", false},
      {"std_vn_mps", "m/s", false, kAboveZero, kLeastStd, kMostStd},
      {"std_ve_mps", "m/s", false, kAboveZero, kLeastStd, kMostStd},
      {"std_vd_mps", "m/s", false, kAboveZero, kLeastStd, kMostStd},
      {"fix", "", false, "an integer of 0 or more (RTKLIB's Q)", 0.0, kMostFix},
      {"heading_deg", "deg", false, "a number from -180 to 360", -180.0, 360.0},
      {"std_heading_deg", "deg", false, kAboveZero, kLeastStd, kMostStd}};
  return fields;
}

// Past the last field of the group that begins with this one: a vector of three, or a heading with its sigma.
std::size_t group_end(std::size_t first) { return first + (first == kHeading ? 2 : 3); }

std::string group_names(const CsvTable& table, std::size_t first) {
  std::string names(table.fields[first].name);
  for (std::size_t i = first + 1; i < group_end(first); ++i) names += "," + std::string(table.fields[i].name);
  return names;
}

// Whether the optional fields of the group from `first` on are there. Throws where `is_there` holds for some of them only.
template <typename IsThere>
bool has_group(const CsvTable& table, std::size_t line, std::size_t first, const std::string& missing,
               const IsThere& is_there) {
  const std::size_t end = group_end(first);
  std::size_t there = end;
  std::size_t absent = end;
  for (std::size_t i = end; i-- > first;) (is_there(i) ? there : absent) = i;
  if (there == end || absent == end) return there != end;
  const std::size_t at = table.cell_of_field[absent] == kNoCell ? there : absent;
  fail_at(table, line, at,
          std::string(table.fields[absent].name) + " is " + missing + " but " + std::string(table.fields[there].name) +
              " is not; expected all of " + group_names(table, first) + " or none");
}

bool row_has_group(const CsvTable& table, const CsvRow& row, std::size_t first) {
  return has_group(table, row.line, first, "empty", [&](std::size_t i) { return !std::isnan(row.values[i]); });
}

void check_gnss_header(const CsvTable& table) {
  const auto header_has_group = [&](std::size_t first) {
    return has_group(table, table.header_line, first, "missing",
                     [&](std::size_t i) { return table.cell_of_field[i] != kNoCell; });
  };
  header_has_group(kCov);
  header_has_group(kHeading);
  const bool has_velocity = header_has_group(kVelocity);
  if (header_has_group(kVelocityStd) && !has_velocity) {
    fail_at(table, table.header_line, kVelocityStd,
            "std_vn_mps is given without a velocity; add the columns " + group_names(table, kVelocity) + " or remove " +
                group_names(table, kVelocityStd));
  }
}

std::string three_decimals(double x) {
  std::array<char, 400> digits;
  char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), x, std::chars_format::fixed, 3).ptr;
  return {digits.data(), end};
}

// P_n from the standard deviations and, where given, the covariances. It is positive definite when the correlation
// matrix R is, by Sylvester: 1 - r_ne^2 > 0 and det R = 1 + 2 r_ne r_nd r_ed - r_ne^2 - r_nd^2 - r_ed^2 > 0.
Matrix3d position_covariance(const CsvTable& table, const CsvRow& row) {
  const Vector3d std_n = three(row, kStd);
  Matrix3d P_n_m2 = std_n.cwiseAbs2().asDiagonal();
  if (!row_has_group(table, row, kCov)) return P_n_m2;

  constexpr double kLeastDeterminant = 1e-12;  // rounding leaves about 1e-15 on a singular one
  const Vector3d cov = three(row, kCov);
  const double r_ne = cov(0) / std_n(0) / std_n(1);
  const double r_nd = cov(1) / std_n(0) / std_n(2);
  const double r_ed = cov(2) / std_n(1) / std_n(2);
  const double det = 1.0 + 2.0 * r_ne * r_nd * r_ed - r_ne * r_ne - r_nd * r_nd - r_ed * r_ed;
  if (!(std::abs(r_ne) < 1.0 && det > kLeastDeterminant)) {
    fail_at(table, row.line, kCov,
            "the position covariance is not positive definite (correlations NE " + three_decimals(r_ne) + ", ND " +
                three_decimals(r_nd) + ", ED " + three_decimals(r_ed) +
                "); expected covariances in m^2 that fit the standard deviations (RTKLIB's sdne, sdeu, sdun are signed "
                "roots: square them, keep the sign)");
  }
  P_n_m2(0, 1) = P_n_m2(1, 0) = cov(0);
  P_n_m2(0, 2) = P_n_m2(2, 0) = cov(1);
  P_n_m2(1, 2) = P_n_m2(2, 1) = cov(2);
  return P_n_m2;
}

void set_velocity(const CsvTable& table, const CsvRow& row, GnssRecord& record) {
  record.has_velocity = row_has_group(table, row, kVelocity);
  record.has_velocity_std = row_has_group(table, row, kVelocityStd);
  if (record.has_velocity) record.v_n_mps = three(row, kVelocity);
  if (record.has_velocity_std) record.std_v_n_mps = three(row, kVelocityStd);
  if (record.has_velocity_std && !record.has_velocity) {
    fail_at(table, row.line, kVelocityStd,
            "std_vn_mps is given but " + group_names(table, kVelocity) + " are empty; expected both or neither");
  }
}

void set_heading(const CsvTable& table, const CsvRow& row, GnssRecord& record) {
  record.has_heading = row_has_group(table, row, kHeading);
  if (!record.has_heading) return;
  const double heading_deg = row.values[kHeading];
  const double turns_deg = heading_deg < 0.0 ? 360.0 : heading_deg < 360.0 ? 0.0 : -360.0;
  record.heading_rad = (heading_deg + turns_deg) * kDegToRad;
  record.std_heading_rad = row.values[kHeading + 1] * kDegToRad;
}

int fix_of(const CsvTable& table, const CsvRow& row) {
  if (table.cell_of_field[kFix] == kNoCell) return -1;
  const double fix = row.values[kFix];
  if (fix != std::floor(fix)) fail_at(table, row, kFix);  // an empty cell (NaN) too: 0 would be a made-up quality
  return static_cast<int>(fix);
}

GnssRecord gnss_record(const CsvTable& table, const CsvRow& row) {
  GnssRecord record;
  record.t_s = row.values[kTime];
  const double lon_deg = row.values[kLon];
  record.lat_rad = row.values[kLat] * kDegToRad;
  record.lon_rad = (lon_deg < 180.0 ? lon_deg : lon_deg - 360.0) * kDegToRad;
  record.height_m = row.values[kHeight];
  record.P_n_m2 = position_covariance(table, row);
  set_velocity(table, row, record);
  set_heading(table, row, record);
  record.fix = fix_of(table, row);
  record.line = row.line;
  return record;
}

// ---- baro.csv

enum BaroField : std::size_t { kBaroHeight = 1, kBaroStd = 2 };

const std::vector<CsvField>& baro_fields() {
  static const std::vector<CsvField> fields = {
      {"time_s", "s"},
      {"height_m", "m", true, "a number from -1000 to 100000", -1e3, 1e5},
      {"std_m", "m", false, "a number above 0", 1e-150, 1e150}};  // its square stays a normal number
  return fields;
}

BaroRecord baro_record(const CsvRow& row) {
  BaroRecord record;
  record.t_s = row.values[kTime];
  record.height_m = row.values[kBaroHeight];
  record.has_std = !std::isnan(row.values[kBaroStd]);
  if (record.has_std) record.std_m = row.values[kBaroStd];
  record.line = row.line;
  return record;
}

}  // namespace

ImuSeries read_imu_csv(const std::string& path, std::vector<std::string>& warnings) {
  CsvTable table = open_csv(path, imu_fields(), warnings);
  ImuSeries samples;
  TimeOrder order;
  CsvRow row;
  while (next_row(table, row)) {
    if (!advance(order, table, row)) continue;
    make_room(samples, table.lines);
    samples.push_back({row.values[kTime], three(row, kGyro), three(row, kAccel)});
  }
  warn_of_repeats(order, path, warnings);
  return samples;
}

std::vector<GnssRecord> read_gnss_csv(const std::string& path, std::vector<std::string>& warnings) {
  CsvTable table = open_csv(path, gnss_fields(), warnings);
  check_gnss_header(table);
  std::vector<GnssRecord> records;
  TimeOrder order;
  CsvRow row;
  while (next_row(table, row)) {
    if (!advance(order, table, row)) continue;
    make_room(records, table.lines);
    records.push_back(gnss_record(table, row));
  }
  warn_of_repeats(order, path, warnings);
  return records;
}

std::vector<BaroRecord> read_baro_csv(const std::string& path, std::vector<std::string>& warnings) {
  CsvTable table = open_csv(path, baro_fields(), warnings);
  std::vector<BaroRecord> records;
  TimeOrder order;
  CsvRow row;
  while (next_row(table, row)) {
    if (!advance(order, table, row)) continue;
    make_room(records, table.lines);
    records.push_back(baro_record(row));
  }
  warn_of_repeats(order, path, warnings);
  return records;
}

}  // namespace liealign
