// The header of an RTKLIB .pos file, and its text into lines, cells and numbers.
// SPDX-License-Identifier: Apache-2.0
#include "rtklib_layout.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "liealign/core/error.hpp"

namespace liealign::rtklib {
namespace {

constexpr std::string_view kBlanks = " \t\r";
constexpr std::size_t kLongestShown = 40;  // characters of a cell in a message

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

// ---- The lines of the header

// "% (lat/lon/height=WGS84/ellipsoidal,Q=...)"
void read_legend(Source& source, std::string_view line) {
  constexpr std::string_view kKey = "lat/lon/height=";
  const std::size_t key = line.find(kKey);
  if (key == std::string_view::npos) return;
  std::string_view value = line.substr(key + kKey.size());
  value = value.substr(0, value.find_first_of(",)"));
  const std::string_view datum = value.substr(0, value.find('/'));
  const std::string_view height = value.substr(std::min(datum.size() + 1, value.size()));
  if (height == "geodetic") {
    fail(
        source, 0,
        "the heights are \"geodetic\", that is above the geoid; expected heights above the ellipsoid: run RTKLIB again "
        "with out-height=ellipsoidal (RTKPOST: Options, Output, Height: Ellipsoidal)");
  }
  if (datum != "WGS84" || height != "ellipsoidal") {
    fail(source, 0,
         "lat/lon/height is \"" + shown(value) + "\"; expected WGS84/ellipsoidal: run RTKLIB again with this setting");
  }
  source.layout.height_stated = true;
}

bool read_time_scale(std::string_view label, TimeScale& scale) {
  if (label == "GPST") scale = TimeScale::gpst;
  if (label == "UTC") scale = TimeScale::utc;
  if (label == "JST") scale = TimeScale::jst;
  return label == "GPST" || label == "UTC" || label == "JST";
}

// "% obs start : 2019/10/11 11:16:48.0 UTC (week2074 472626.0s)" gives one instant twice, the second time in GPST: it
// shows how many leap seconds this RTKLIB knew of. Versions with an old table are in use.
void check_leap_seconds(const Source& source, std::string_view line) {
  if (line.find("obs start") == std::string_view::npos && line.find("obs end") == std::string_view::npos) return;
  Cells words;
  split(line.substr(std::min(line.find(':') + 1, line.size())), ' ', words);
  CalendarTime calendar;
  TimeScale scale;
  double week = 0.0;
  double tow_s = 0.0;
  if (words.size() < 5 || !read_time_scale(words[2], scale) || scale == TimeScale::gpst) return;
  if (!words[3].starts_with("(week") || !words[4].ends_with("s)")) return;
  if (!parse_calendar(words[0], words[1], calendar) || !fault_of(calendar, scale).empty()) return;
  if (!parse_number(words[3].substr(5), week) || !parse_number(words[4].substr(0, words[4].size() - 2), tow_s)) return;
  const GpsTime ours = gps_time(calendar, scale);
  const double ours_s = static_cast<double>(ours.whole_s) + ours.fraction_s;
  const double missing_s = std::round(ours_s - (week * static_cast<double>(kSecondsPerWeek) + tow_s));
  constexpr double kMost_s = 60.0;  // more is not about leap seconds
  if (missing_s == 0.0 || std::abs(missing_s) > kMost_s) return;
  const int leaps = leap_seconds(ours);
  fail(source, 0,
       "the " + std::string(words[2]) + " of the header is " + std::to_string(leaps - static_cast<int>(missing_s)) +
           " s from its GPST; expected " + std::to_string(leaps) +
           " s: this RTKLIB had another table of leap seconds, so run it again with times in GPST "
           "(out-timesys=gpst)");
}

// ---- The line that names the columns

struct Names {
  std::array<std::string_view, 3> position, sd, sd_cross, velocity, sd_velocity, sd_velocity_cross;
};

constexpr Names kLlhNames = {{"latitude", "longitude", "height"},
                             {"sdn", "sde", "sdu"},
                             {"sdne", "sdeu", "sdun"},
                             {"vn", "ve", "vu"},
                             {"sdvn", "sdve", "sdvu"},
                             {"sdvne", "sdveu", "sdvun"}};
constexpr Names kEcefNames = {{"x-ecef", "y-ecef", "z-ecef"}, {"sdx", "sdy", "sdz"},
                              {"sdxy", "sdyz", "sdzx"},       {"vx", "vy", "vz"},
                              {"sdvx", "sdvy", "sdvz"},       {"sdvxy", "sdvyz", "sdvzx"}};
constexpr std::string_view kDms = "(d'\")";

bool is_label_of(std::string_view label, std::string_view name) {
  if (name == "sdun" && label.starts_with("sdue(")) return true;  // so misspelt above degrees, minutes, seconds
  return label.starts_with(name) && (label.size() == name.size() || label[name.size()] == '(');
}

std::size_t find_cell(const Layout& layout, std::string_view name) {
  const auto is_it = [&](const std::string& label) { return is_label_of(label, name); };
  const auto found = std::find_if(layout.labels.begin(), layout.labels.end(), is_it);
  return found == layout.labels.end() ? kAbsent : static_cast<std::size_t>(found - layout.labels.begin());
}

ThreeCells find_cells(const Source& source, const std::array<std::string_view, 3>& names) {
  ThreeCells cells;
  for (std::size_t i = 0; i < names.size(); ++i) {
    cells[i] = find_cell(source.layout, names[i]);
    if (cells[i] == kAbsent) {
      fail(source, 0,
           "column " + std::string(names[i]) + " is missing; expected the columns that RTKLIB writes: run it again");
    }
  }
  return cells;
}

// The separator stands after the first name, where the header and the rows have it in the same way.
char separator_after(std::string_view line, std::string_view label) {
  const std::size_t at = line.find_first_not_of(kBlanks, line.find(label) + label.size());
  constexpr std::string_view kUsual = ",;|";
  return at != std::string_view::npos && kUsual.find(line[at]) != std::string_view::npos ? line[at] : ' ';
}

void set_labels(Source& source, std::string_view line) {
  Layout& layout = source.layout;
  Cells words;
  split(line.substr(1), layout.separator, words);
  layout.time_label = words.front();
  if (!read_time_scale(words.front(), layout.scale)) {
    fail(source, 0, "the time label is \"" + shown(words.front()) + "\"; expected GPST, UTC or JST");
  }
  layout.labels = {layout.time_label, layout.time_label};
  for (std::size_t i = 1; i < words.size(); ++i) {
    layout.labels.insert(layout.labels.end(), words[i].ends_with(kDms) ? 3 : 1, std::string(words[i]));
  }
}

// The first name with its unit, which tells the form; empty for a line that names no columns.
std::string_view first_name(const Source& source, std::string_view line, RtklibPosForm& form) {
  struct Form {
    std::string_view name;
    RtklibPosForm form;
  };
  constexpr std::array<Form, 3> kForms = {{{"latitude(deg)", RtklibPosForm::llh_deg},
                                           {"latitude(d'\")", RtklibPosForm::llh_dms},
                                           {"x-ecef(m)", RtklibPosForm::ecef}}};
  if (line.find("e-baseline(") != std::string_view::npos) {
    fail(source, 0,
         "the positions are e/n/u-baseline, relative to the base; expected positions on the Earth: run RTKLIB again "
         "with out-solformat=llh (RTKPOST: Options, Output, Solution Format: Lat/Lon/Height)");
  }
  for (const Form& f : kForms) {
    form = f.form;
    if (line.find(f.name) != std::string_view::npos) return f.name;
  }
  return {};
}

void find_columns(Source& source, const Names& names) {
  Layout& layout = source.layout;
  layout.position = find_cells(source, names.position);
  layout.quality = find_cells(source, {"Q", "Q", "Q"})[0];
  layout.sd = find_cells(source, names.sd);
  layout.sd_cross = find_cells(source, names.sd_cross);
  if (find_cell(layout, names.velocity[0]) == kAbsent) return;
  layout.velocity = find_cells(source, names.velocity);
  layout.sd_velocity = find_cells(source, names.sd_velocity);
  layout.sd_velocity_cross = find_cells(source, names.sd_velocity_cross);
}

void read_columns(Source& source, std::string_view line) {
  Layout& layout = source.layout;
  RtklibPosForm form = RtklibPosForm::llh_deg;
  const std::string_view first = first_name(source, line, form);
  if (first.empty()) return;
  if (layout.line > 0) {
    if (line == layout.text) return;  // files joined end to end
    fail(source, 0,
         "the columns differ from those on line " + std::to_string(layout.line) + "; expected one form in one file");
  }
  layout.line = source.lines.number();
  layout.text = line;
  layout.form = form;
  layout.separator = separator_after(line, first);
  if (form == RtklibPosForm::ecef) layout.height_stated = true;
  set_labels(source, line);
  find_columns(source, form == RtklibPosForm::ecef ? kEcefNames : kLlhNames);
}

}  // namespace

void fail(const Source& source, std::size_t cell, const std::string& text) {
  throw InputError(source.path + ":" + std::to_string(source.lines.number()) + ":" + std::to_string(cell + 1) + ": " +
                   text);
}

std::string shown(std::string_view text) {
  std::string out(text.substr(0, kLongestShown));
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  }
  return text.size() > kLongestShown ? out + "..." : out;
}

bool next_line(Source& source, std::string_view& line) {
  while (source.lines.next(line)) {
    line = trim(line);
    if (!line.empty()) return true;
  }
  return false;
}

void split(std::string_view line, char separator, Cells& cells) {
  cells.clear();
  const auto skip_blanks = [&](std::size_t at) {
    while (at < line.size() && is_blank(line[at])) ++at;
    return at;
  };
  std::size_t at = skip_blanks(0);
  while (at < line.size()) {
    std::size_t end = at;
    while (end < line.size() && line[end] != separator && !is_blank(line[end])) ++end;
    cells.push_back(line.substr(at, end - at));
    at = skip_blanks(end);
    if (at == line.size() || separator == ' ' || line[at] != separator) continue;
    at = skip_blanks(at + 1);
    if (at < line.size()) continue;
    cells.push_back({});  // nothing after the last separator
    return;
  }
}

bool parse_number(std::string_view text, double& value) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
}

void fail_value(const Source& source, const Cells& cells, std::size_t cell, std::string_view expected) {
  fail(source, cell,
       source.layout.labels[cell] + (cells[cell].empty() ? " is empty" : " is \"" + shown(cells[cell]) + "\"") +
           "; expected " + std::string(expected));
}

double number(const Source& source, const Cells& cells, std::size_t cell, const Bounds& bounds) {
  double value = 0.0;
  if (!parse_number(cells[cell], value) || !(value >= bounds.min && value <= bounds.max)) {
    fail_value(source, cells, cell, bounds.expected);
  }
  return value;
}

int whole_number(const Source& source, const Cells& cells, std::size_t cell, const Bounds& bounds) {
  const double value = number(source, cells, cell, bounds);
  if (value != std::floor(value)) fail_value(source, cells, cell, bounds.expected);
  return static_cast<int>(value);
}

Vector3d three(const Source& source, const Cells& cells, const ThreeCells& at, const Bounds& bounds) {
  return {number(source, cells, at[0], bounds), number(source, cells, at[1], bounds),
          number(source, cells, at[2], bounds)};
}

bool parse_calendar(std::string_view date, std::string_view time_of_day, CalendarTime& time) {
  // Numbers up to the given sign, the last one to the end of the text.
  const auto take = [](std::string_view& text, char end_sign, auto& value) {
    const std::size_t size = std::min(end_sign == '\0' ? text.size() : text.find(end_sign), text.size());
    const auto [end, error] = std::from_chars(text.data(), text.data() + size, value);
    if (error != std::errc{} || end != text.data() + size) return false;
    if (end_sign != '\0' && size == text.size()) return false;
    text.remove_prefix(std::min(size + 1, text.size()));
    return true;
  };
  return take(date, '/', time.year) && take(date, '/', time.month) && take(date, '\0', time.day) &&
         take(time_of_day, ':', time.hour) && take(time_of_day, ':', time.minute) &&
         take(time_of_day, '\0', time.second) && std::isfinite(time.second);
}

void read_header_line(Source& source, std::string_view line) {
  read_legend(source, line);
  check_leap_seconds(source, line);
  read_columns(source, line);
}

void fail_without_header(const Source& source, std::string_view line) {
  const std::string expected =
      "; expected an RTKLIB solution with the line that names its columns (\"%  GPST  latitude(deg) ...\")";
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 && c != '\t'; };
  if (std::any_of(line.begin(), line.end(), is_control)) fail(source, 0, "the file is not text" + expected);
  if (line.starts_with("$POS,") || line.starts_with("$SAT,") || line.starts_with("$VELACC,") ||
      line.starts_with("$CLK,")) {
    fail(source, 0, "this is RTKLIB's solution status" + expected + ": use the .pos file beside it");
  }
  if (line.starts_with('$')) {
    fail(source, 0,
         "this is NMEA, which has neither the full date nor the covariance in each fix" + expected +
             ": run RTKLIB again with out-solformat=llh");
  }
  fail(source, 0,
       "no line above names the columns, so time scale and units are not known" + expected +
           "; a .pos file of another program: convert it to gnss.csv (docs/formats.md)");
}

}  // namespace liealign::rtklib

namespace liealign {

bool looks_like_rtklib_pos(const std::string& path) {
  constexpr std::string_view kEnding = ".pos";
  constexpr std::size_t kFirstBytes = 4096;
  const auto same_letter = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
  if (path.size() >= kEnding.size() &&
      std::equal(path.end() - static_cast<std::ptrdiff_t>(kEnding.size()), path.end(), kEnding.begin(), same_letter)) {
    return true;
  }
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown)) return false;  // what is read of a pipe is gone
  std::array<char, kFirstBytes> bytes;
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  std::string_view text(bytes.data(), static_cast<std::size_t>(file.gcount()));
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '%';
}

}  // namespace liealign
