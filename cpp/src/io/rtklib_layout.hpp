// The header of an RTKLIB .pos file: which cell of a row holds what. Private to the reader.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "liealign/core/types.hpp"
#include "liealign/io/gps_time.hpp"
#include "liealign/io/rtklib_pos.hpp"
#include "liealign/io/text_file.hpp"

namespace liealign::rtklib {

inline constexpr std::size_t kAbsent = std::numeric_limits<std::size_t>::max();
using Cells = std::vector<std::string_view>;  // the texts of a row, which hold until the next line is read
using ThreeCells = std::array<std::size_t, 3>;
inline constexpr ThreeCells kAbsentCells = {kAbsent, kAbsent, kAbsent};

struct Layout {
  std::size_t line = 0;  // of the header; 0 before it was read
  std::string text;
  RtklibPosForm form = RtklibPosForm::llh_deg;
  std::string time_label;
  TimeScale scale = TimeScale::gpst;
  char separator = ' ';                // besides blanks
  std::vector<std::string> labels;     // of each cell of a row
  ThreeCells position = kAbsentCells;  // first cell of each coordinate: dms takes three cells for two of them
  std::size_t quality = kAbsent;
  ThreeCells sd = kAbsentCells;
  ThreeCells sd_cross = kAbsentCells;
  ThreeCells velocity = kAbsentCells;     // absent without out-outvel
  ThreeCells sd_velocity = kAbsentCells;  // as velocity
  ThreeCells sd_velocity_cross = kAbsentCells;
  bool height_stated = false;
};

// The file while it is read.
struct Source {
  std::string path;
  TextLines lines;
  Layout layout = {};
};

[[noreturn]] void fail(const Source& source, std::size_t cell, const std::string& text);

// A cell for a message: not too long, without control characters.
std::string shown(std::string_view text);

// The next line that is not blank, without blanks around it; false after the last one.
bool next_line(Source& source, std::string_view& line);

// Cells are separated by blanks, or by the separator with blanks around it.
void split(std::string_view line, char separator, Cells& cells);

// The finite number that the whole text is; false where it is none.
bool parse_number(std::string_view text, double& value);

// A cell that is no finite number in [min, max] is refused with `label is "text"; expected <expected>`.
struct Bounds {
  std::string_view expected;
  double min = std::numeric_limits<double>::lowest();
  double max = std::numeric_limits<double>::max();
};
[[noreturn]] void fail_value(const Source& source, const Cells& cells, std::size_t cell, std::string_view expected);
double number(const Source& source, const Cells& cells, std::size_t cell, const Bounds& bounds);
int whole_number(const Source& source, const Cells& cells, std::size_t cell, const Bounds& bounds);
Vector3d three(const Source& source, const Cells& cells, const ThreeCells& at, const Bounds& bounds);

// "yyyy/mm/dd" and "hh:mm:ss.sss"; false where the text is not of that form.
bool parse_calendar(std::string_view date, std::string_view time_of_day, CalendarTime& time);

// Takes from a line that starts with '%' what it says about the layout. Throws InputError for what cannot be used.
void read_header_line(Source& source, std::string_view line);

// Throws InputError for a row above which no header names the columns, and says what the file may be.
[[noreturn]] void fail_without_header(const Source& source, std::string_view line);

}  // namespace liealign::rtklib
