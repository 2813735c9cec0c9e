// CSV: the native input imu.csv, gnss.csv and baro.csv, a reader of named numeric columns, and a writer of tables.
// Read: UTF-8 with or without BOM, LF or CRLF; blank lines and lines that start with '#' are skipped; a header of
// names in any order, other columns are ignored; decimal points.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "liealign/ins/baro.hpp"
#include "liealign/ins/gnss.hpp"
#include "liealign/ins/imu.hpp"
#include "liealign/io/text_file.hpp"

namespace liealign {

// ---- The native files -----------------------------------------------------------------------------------------------
// The readers throw InputError `path:line:column: text` (column: the cell, counted from 1) for the first thing they
// cannot use; they require times that do not go back. A row that repeats the one before exactly is dropped, and one
// warning says how many were.

// time_s,gyro_x_rps,gyro_y_rps,gyro_z_rps,accel_x_mps2,accel_y_mps2,accel_z_mps2. At least one sample.
ImuSeries read_imu_csv(const std::string& path, std::vector<std::string>& warnings);

// time_s,lat_deg,lon_deg,height_m,std_n_m,std_e_m,std_d_m and optionally cov_ne_m2,cov_nd_m2,cov_ed_m2;
// vn_mps,ve_mps,vd_mps; with them std_vn_mps,std_ve_mps,std_vd_mps; fix; heading_deg,std_heading_deg. A group comes
// whole or not at all, in the header and, by empty cells, in each row. Longitude is brought to [-180, 180) deg, the
// heading to [0, 360) deg. At least one record.
std::vector<GnssRecord> read_gnss_csv(const std::string& path, std::vector<std::string>& warnings);

// time_s,height_m and optionally std_m, whose cells may be empty. At least one record.
std::vector<BaroRecord> read_baro_csv(const std::string& path, std::vector<std::string>& warnings);

// ---- Reading named columns ------------------------------------------------------------------------------------------

// A column that a reader asks for. A cell that is no finite number in [min, max] is refused with
// `name is "text"; expected <expected> [unit]`.
struct CsvField {
  std::string_view name;
  std::string_view unit = "";  // for messages
  bool required = true;        // else the column may be absent, and its cells may be empty
  std::string_view expected = "a finite number";
  double min = std::numeric_limits<double>::lowest();
  double max = std::numeric_limits<double>::max();
};

inline constexpr std::size_t kNoCell = std::numeric_limits<std::size_t>::max();

// An open table: the lines of the file, and where the asked-for fields stand.
struct CsvTable {
  std::string path;
  TextLines lines;
  std::vector<CsvField> fields;
  std::vector<std::size_t> cell_of_field = {};  // index of the cell in a row, or kNoCell
  std::size_t cells_per_row = 0;
  std::size_t header_line = 0;
  std::size_t rows = 0;  // read so far
};

// One row. `values` goes with CsvTable::fields and is NaN where the file says nothing; `cells` are the texts of all
// cells, which hold until the next row is read.
struct CsvRow {
  std::size_t line = 0;
  std::vector<double> values;
  std::vector<std::string_view> cells;
};

// Opens the file and reads its header. Throws InputError for a missing or repeated column and for a file without header;
// warns of a column that would be ignored but for a slip in its name.
CsvTable open_csv(const std::string& path, const std::vector<CsvField>& fields, std::vector<std::string>& warnings);

// The next row, or false after the last one. Throws InputError for a malformed row, and for a table without rows.
bool next_row(CsvTable& table, CsvRow& row);

// Throws InputError at the cell of this field: with this text, or with the text of its CsvField.
[[noreturn]] void fail_at(const CsvTable& table, std::size_t line, std::size_t field, const std::string& text);
[[noreturn]] void fail_at(const CsvTable& table, const CsvRow& row, std::size_t field);

// ---- Writing --------------------------------------------------------------------------------------------------------

// A numeric column: fixed notation with so many decimals; negative: the shortest text that reads back to the same bits.
struct CsvColumn {
  std::string name;
  int decimals;
};

// Append the header or a row to `out`: for callers that format parts of a table apart, as on several threads, and give
// them to PartFile::write in order. `cells` goes with `columns`; a cell that is not finite is left empty, and there is no
// "-0.00" in fixed notation. `last` is a column of words behind the numbers, quoted where it must be (RFC 4180).
void append_csv_header(std::string& out, const std::vector<CsvColumn>& columns,
                       std::optional<std::string_view> last = std::nullopt);
void append_csv_row(std::string& out, const std::vector<CsvColumn>& columns, const double* cells,
                    std::optional<std::string_view> last = std::nullopt);

// A column of words, written after the numbers. Without `text` there is none.
struct CsvTextColumn {
  std::string name;
  std::function<std::string(std::size_t row)> text;
};

// Writes the header and `rows` rows; fill(row, cells) sets one double per column. Cells arrive as NaN. With a path the
// file appears when it is complete.
// Throws InputError `path: cannot be written: reason`; what fill throws passes through.
using CsvFill = std::function<void(std::size_t row, double* cells)>;
void write_csv(PartFile& file, const std::vector<CsvColumn>& columns, std::size_t rows, const CsvFill& fill,
               const CsvTextColumn& last_column = {});
void write_csv(const std::string& path, const std::vector<CsvColumn>& columns, std::size_t rows, const CsvFill& fill,
               const CsvTextColumn& last_column = {});

}  // namespace liealign
