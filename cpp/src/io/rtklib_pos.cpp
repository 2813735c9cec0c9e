// The rows of an RTKLIB .pos file to GnssRecord: SI, radians, NED, GPS time; doubtful ones refused by line and cell.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/io/rtklib_pos.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/io/text_file.hpp"
#include "rtklib_layout.hpp"

namespace liealign {
namespace {

using rtklib::Bounds;
using rtklib::Cells;
using rtklib::fail;
using rtklib::fail_value;
using rtklib::kAbsent;
using rtklib::Layout;
using rtklib::number;
using rtklib::shown;
using rtklib::Source;
using rtklib::three;
using rtklib::ThreeCells;
using rtklib::whole_number;

// ---- What cells may hold

constexpr Bounds kAnyNumber = {"a finite number"};
constexpr Bounds kSignedRoot = {"a finite number", -1e150, 1e150};  // its square is a number
constexpr Bounds kSigma = {"a number of 0 or more", 0.0, 1e150};
constexpr Bounds kLatitude = {"a number from -90 to 90", -90.0, 90.0};
constexpr Bounds kLongitude = {"a number from -180 to 360", -180.0, 360.0};
constexpr Bounds kMinutes = {"minutes from 0 to 59", 0.0, 59.0};
constexpr Bounds kSeconds = {"seconds from 0 to 60", 0.0, 60.0};
constexpr Bounds kHeight = {"a number from -1000 to 100000, above the ellipsoid", -1e3, 1e5};
constexpr Bounds kQuality = {"an integer of 0 or more", 0.0, std::numeric_limits<int>::max()};
constexpr Bounds kWeek = {"a GPS week from 0 to 9999", 0.0, 9999.0};
constexpr Bounds kTow = {"seconds of the week from 0 to below 604800", 0.0, 604800.0};

// ---- What the rows add up to

struct Tally {
  std::size_t count = 0;
  std::size_t first_line = 0;
};

void add(Tally& tally, std::size_t line) {
  if (tally.count++ == 0) tally.first_line = line;
}

struct Reading {
  Source source;
  RtklibPos out = {};
  GpsTime last_time = {};
  std::string last_row = {};  // the last row that was let through; empty before the first
  std::size_t last_line = 0;  // its line
  Tally repeats = {}, no_solution = {}, no_velocity = {}, no_velocity_std = {}, rounded = {};
};

// ---- Time

GpsTime read_time(const Source& source, const Cells& cells, bool& week_tow) {
  const TimeScale scale = source.layout.scale;
  week_tow = cells[0].find('/') == std::string_view::npos;
  if (week_tow) {
    const int week = whole_number(source, cells, 0, kWeek);
    const double tow_s = number(source, cells, 1, kTow);
    if (tow_s >= kTow.max) fail_value(source, cells, 1, kTow.expected);
    const GpsTime time = gps_time(week, tow_s, scale);
    if (time.whole_s < 0) fail(source, 0, "the time is before GPS time began on 1980-01-06");
    return time;
  }
  const auto text = [&] { return "the time is \"" + shown(cells[0]) + " " + shown(cells[1]) + "\""; };
  CalendarTime calendar;
  if (!rtklib::parse_calendar(cells[0], cells[1], calendar)) {
    fail(source, 0, text() + "; expected yyyy/mm/dd hh:mm:ss.sss, or week and seconds of the week");
  }
  const std::string fault = fault_of(calendar, scale);
  if (!fault.empty()) fail(source, 0, text() + " " + source.layout.time_label + ", " + fault);
  return gps_time(calendar, scale);
}

bool before(const GpsTime& a, const GpsTime& b) {
  return a.whole_s != b.whole_s ? a.whole_s < b.whole_s : a.fraction_s < b.fraction_s;
}

// RTKLIB has no second 60: in UTC it writes the second after the leap second twice.
std::string what_to_do(const Reading& reading, const GpsTime& time) {
  const int leaps = leap_seconds(time);
  if (reading.source.layout.scale != TimeScale::gpst && leap_seconds({time.whole_s - 3, 0.0}) < leaps) {
    return "RTKLIB cannot write a leap second in UTC: run it again with out-timesys=gpst";
  }
  return "";
}

// True where the row is to be kept.
bool advance(Reading& reading, std::string_view row, const Cells& cells, const GpsTime& time) {
  if (!reading.last_row.empty() && !before(reading.last_time, time)) {
    const Source& source = reading.source;
    Cells last_cells;
    rtklib::split(reading.last_row, source.layout.separator, last_cells);
    if (cells == last_cells) {
      add(reading.repeats, source.lines.number());
      return false;
    }
    const bool back = before(time, reading.last_time);
    const std::string now = "the time is " + shown(cells[0]) + " " + shown(cells[1]);
    const std::string last =
        shown(last_cells[0]) + " " + shown(last_cells[1]) + " on line " + std::to_string(reading.last_line);
    const std::string leap = what_to_do(reading, time);
    if (back) {
      fail(source, 0,
           now + ", before " + last + "; times must not go back: " +
               (leap.empty() ? "run RTKLIB again with pos1-soltype=combined or forward (backward writes the last epoch "
                               "first), or sort the rows"
                             : leap));
    }
    fail(source, 0,
         now + " as in " + last + ", but the rows differ; expected one row for each time: " +
             (leap.empty() ? "remove one of the two lines" : leap));
  }
  reading.last_time = time;
  reading.last_row = row;
  reading.last_line = reading.source.lines.number();
  return true;
}

// ---- Position and covariance

double degrees(const Source& source, const Cells& cells, std::size_t cell, const Bounds& bounds) {
  const double first = number(source, cells, cell, bounds);
  if (source.layout.form != RtklibPosForm::llh_dms) return first;
  const double minutes = number(source, cells, cell + 1, kMinutes);
  const double seconds = number(source, cells, cell + 2, kSeconds);
  const double size = std::abs(first) + (minutes + seconds / 60.0) / 60.0;
  const double value = std::signbit(first) ? -size : size;  // "-0 17 50" is south of the equator
  if (!(value >= bounds.min && value <= bounds.max)) fail_value(source, cells, cell, bounds.expected);
  return value;
}

void set_position(const Source& source, const Cells& cells, GnssRecord& record) {
  const ThreeCells& at = source.layout.position;
  if (source.layout.form != RtklibPosForm::ecef) {
    const double lon_deg = degrees(source, cells, at[1], kLongitude);
    record.lat_rad = degrees(source, cells, at[0], kLatitude) * kDegToRad;
    record.lon_rad = (lon_deg < 180.0 ? lon_deg : lon_deg - 360.0) * kDegToRad;
    record.height_m = number(source, cells, at[2], kHeight);
    return;
  }
  constexpr double kLeastRadius_m = 6.3e6;  // the pole less 1000 m is at 6.356e6
  constexpr double kMostRadius_m = 6.5e6;
  const Vector3d p_ea_e = three(source, cells, at, kAnyNumber);
  const bool near = p_ea_e.norm() > kLeastRadius_m && p_ea_e.norm() < kMostRadius_m;
  const Geodetic g = near ? geodetic_from_ecef(p_ea_e) : Geodetic{};
  if (!near || g.height_m < kHeight.min || g.height_m > kHeight.max) {
    fail(source, at[0],
         "the position is " + std::to_string(p_ea_e.norm()) +
             " m from the centre of the Earth; expected a height from -1000 to 100000 m above the ellipsoid");
  }
  record.lat_rad = g.lat_rad;
  record.lon_rad = g.lon_rad < kPi ? g.lon_rad : g.lon_rad - 2.0 * kPi;
  record.height_m = g.height_m;
}

// P_a from the sigmas and the signed roots of the off-diagonals 01, 12, 20.
Matrix3d covariance(const Vector3d& sd, const Vector3d& cross) {
  Matrix3d P = sd.cwiseAbs2().asDiagonal();
  P(0, 1) = P(1, 0) = cross(0) * std::abs(cross(0));
  P(1, 2) = P(2, 1) = cross(1) * std::abs(cross(1));
  P(0, 2) = P(2, 0) = cross(2) * std::abs(cross(2));
  return P;
}

// By Sylvester on the correlation matrix, as for gnss.csv.
bool is_positive_definite(const Matrix3d& P) {
  constexpr double kLeastDeterminant = 1e-12;  // rounding leaves about 1e-15 on a singular one
  const Vector3d sd = P.diagonal().cwiseSqrt();
  const double a = P(0, 1) / sd(0) / sd(1);
  const double b = P(1, 2) / sd(1) / sd(2);
  const double c = P(0, 2) / sd(0) / sd(2);
  return std::abs(a) < 1.0 && 1.0 + 2.0 * a * b * c - a * a - b * b - c * c > kLeastDeterminant;
}

// RTKLIB prints 0.1 mm. Where that makes a millimetre covariance singular, the one is taken that rounds to the same
// digits and is farthest from singular: sigmas half a digit up, off-diagonals half a digit towards zero.
Matrix3d position_covariance(Reading& reading, const Cells& cells) {
  constexpr double kHalfDigit_m = 0.5e-4;
  const Source& source = reading.source;
  const Layout& layout = source.layout;
  const Vector3d sd = three(source, cells, layout.sd, kSigma);
  for (std::size_t i = 0; i < 3; ++i) {
    if (sd(static_cast<Eigen::Index>(i)) > 0.0) continue;
    fail_value(source, cells, layout.sd[i],
               "a number above 0: RTKLIB gives no accuracy for this epoch, remove the line");
  }
  const Vector3d cross = three(source, cells, layout.sd_cross, kSignedRoot);
  const Matrix3d P_a_m2 = covariance(sd, cross);
  if (is_positive_definite(P_a_m2)) return P_a_m2;

  const auto towards_zero = [](double x) { return std::copysign(std::max(0.0, std::abs(x) - kHalfDigit_m), x); };
  const Matrix3d unrounded = covariance(sd.array() + kHalfDigit_m, cross.unaryExpr(towards_zero));
  if (!is_positive_definite(unrounded)) {
    fail(source, layout.sd_cross[0],
         "the position covariance is not positive definite; expected signed roots of covariances that fit the standard "
         "deviations, as RTKLIB writes them");
  }
  add(reading.rounded, source.lines.number());
  return unrounded;
}

// ---- A row

// RTKLIB writes zeros where it has no velocity, and zero sigmas where it does not know them.
void set_velocity(Reading& reading, const Cells& cells, const Matrix3d& C_a_n, GnssRecord& record) {
  const Source& source = reading.source;
  const Layout& layout = source.layout;
  const Vector3d v_a_mps = three(source, cells, layout.velocity, kAnyNumber);
  const Vector3d sd = three(source, cells, layout.sd_velocity, kSigma);
  const Vector3d cross = three(source, cells, layout.sd_velocity_cross, kSignedRoot);
  const bool has_std = !sd.isZero(0.0);
  record.has_velocity = has_std || !v_a_mps.isZero(0.0);
  if (!record.has_velocity) return add(reading.no_velocity, source.lines.number());
  record.v_n_mps = C_a_n * v_a_mps;
  if (!has_std) return add(reading.no_velocity_std, source.lines.number());
  const Matrix3d P_n = C_a_n * covariance(sd, cross) * C_a_n.transpose();
  if (!(sd.minCoeff() > 0.0 && P_n.diagonal().minCoeff() > 0.0)) {
    fail(source, layout.sd_velocity[0],
         "the velocity covariance is not positive; expected standard deviations above 0, or all of them 0 where there "
         "are none");
  }
  record.has_velocity_std = true;
  record.std_v_n_mps = P_n.diagonal().cwiseSqrt();
}

void check_cell_count(const Source& source, const Cells& cells) {
  const std::size_t expected = source.layout.labels.size();
  if (cells.size() == expected) return;
  std::string text = "the row has " + std::to_string(cells.size()) + (cells.size() == 1 ? " cell" : " cells") +
                     "; expected " + std::to_string(expected) + " as line " + std::to_string(source.layout.line) +
                     " names them (the time takes two)";
  if (source.lines.cut_off()) {
    text += "; the file ends within this line: if it was cut off, remove the line";
  }
  fail(source, std::min(cells.size(), expected), text);
}

void read_row(Reading& reading, std::string_view line, Cells& cells) {
  const Source& source = reading.source;
  if (source.layout.line == 0) rtklib::fail_without_header(source, line);
  rtklib::split(line, source.layout.separator, cells);
  check_cell_count(source, cells);
  bool week_tow = false;
  const GpsTime time = read_time(source, cells, week_tow);
  if (!advance(reading, line, cells, time)) return;

  GnssRecord record;
  record.fix = whole_number(source, cells, source.layout.quality, kQuality);
  if (record.fix == 0) return add(reading.no_solution, source.lines.number());
  RtklibPos& out = reading.out;
  if (out.records.empty()) {
    out.week = static_cast<int>(time.whole_s / kSecondsPerWeek);
    out.week_tow = week_tow;
  }
  record.t_s = static_cast<double>(time.whole_s - out.week * kSecondsPerWeek) + time.fraction_s;
  record.line = source.lines.number();
  set_position(source, cells, record);
  const Matrix3d C_a_n = source.layout.form == RtklibPosForm::ecef
                             ? Matrix3d(C_n_e(record.lat_rad, record.lon_rad).transpose())
                             : Matrix3d(Vector3d(1.0, 1.0, -1.0).asDiagonal());
  record.P_n_m2 = C_a_n * position_covariance(reading, cells) * C_a_n.transpose();
  record.P_n_m2 = 0.5 * (record.P_n_m2 + record.P_n_m2.transpose()).eval();
  if (source.layout.velocity[0] != kAbsent) set_velocity(reading, cells, C_a_n, record);
  make_room(out.records, source.lines);
  out.records.push_back(record);
}

// ---- Words for the user

void say_assumptions(const Reading& reading, std::vector<std::string>& warnings) {
  const Source& source = reading.source;
  const RtklibPos& out = reading.out;
  std::string text = source.path + ": RTKLIB solution in " + out.time_label;
  if (source.layout.scale != TimeScale::gpst) {
    text += ", brought to GPST with " + std::to_string(leap_seconds(reading.last_time)) + " leap seconds";
  }
  text += "; time_s counts GPS seconds of week " + std::to_string(out.week) +
          " (on past its end), and time_s of the IMU log must be on the same scale";
  if (!out.height_stated) text += "; the header does not say which height it is: taken as above the ellipsoid";
  warnings.push_back(text);
  if (source.layout.scale != TimeScale::gpst && after_known_leap_seconds(reading.last_time)) {
    warnings.push_back(source.path +
                       ": leap seconds after 2027-06-28 are not known to this version; if there was one, "
                       "run RTKLIB again with times in GPST (out-timesys=gpst)");
  }
}

void say(const Reading& reading, const Tally& tally, const std::string& text, std::vector<std::string>& warnings) {
  if (tally.count == 0) return;
  warnings.push_back(reading.source.path + ":" + std::to_string(tally.first_line) + ":1: " +
                     std::to_string(tally.count) + (tally.count == 1 ? " row " : " rows, this is the first, ") + text);
}

}  // namespace

RtklibPos read_rtklib_pos(const std::string& path, std::vector<std::string>& warnings) {
  Reading reading{{path, TextLines(path)}};
  Source& source = reading.source;
  std::string_view line;
  Cells cells;
  while (rtklib::next_line(source, line)) {
    if (line.starts_with('%')) {
      rtklib::read_header_line(source, line);
    } else {
      read_row(reading, line, cells);
    }
  }
  RtklibPos& out = reading.out;
  if (out.records.empty())
    throw InputError(path + ": the file holds no solution; expected at least one row with Q above 0");
  out.time_label = source.layout.time_label;
  out.form = source.layout.form;
  out.height_stated = source.layout.height_stated;
  out.has_velocity = source.layout.velocity[0] != kAbsent;
  say_assumptions(reading, warnings);
  say(reading, reading.repeats, "exactly as the row before: dropped", warnings);
  say(reading, reading.no_solution, "without solution (Q = 0): dropped", warnings);
  say(reading, reading.no_velocity, "without velocity (RTKLIB writes zeros): only the position is used", warnings);
  say(reading, reading.no_velocity_std, "with zero velocity sigmas: gnss.velocity_std_mps is used", warnings);
  say(reading, reading.rounded,
      "with a covariance that is singular in the 0.1 mm that RTKLIB prints: taken as large as "
      "the digits allow",
      warnings);
  return out;
}

}  // namespace liealign
