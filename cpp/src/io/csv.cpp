// Writing tables as CSV (RFC 4180, lines end in LF).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/io/csv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "liealign/io/text_file.hpp"

namespace liealign {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;
constexpr std::size_t kMostDigitsBeforePoint = 312;  // of a double in fixed notation, with sign and point

// Text on its way to the file, handed over a buffer at a time.
struct TableText {
  PartFile& file;
  std::vector<char> buffer;
  std::size_t used = 0;

  void flush() {
    file.write({buffer.data(), used});
    used = 0;
  }

  // Room for `bytes` more, at the returned place; the caller advances `used`.
  char* room(std::size_t bytes) {
    if (buffer.size() - used < bytes) flush();
    if (buffer.size() < bytes) buffer.resize(bytes);
    return buffer.data() + used;
  }

  void append(std::string_view text) {
    std::copy(text.begin(), text.end(), room(text.size()));
    used += text.size();
  }
};

void append_cell(double x, int decimals, TableText& out) {
  if (!std::isfinite(x)) return;
  const std::size_t most = kMostDigitsBeforePoint + static_cast<std::size_t>(std::max(decimals, 0));
  char* const begin = out.room(most);
  char* end = decimals < 0 ? std::to_chars(begin, begin + most, x).ptr
                           : std::to_chars(begin, begin + most, x, std::chars_format::fixed, decimals).ptr;
  // A small negative number rounds to "-0.00": the sign says nothing any more.
  const bool negative_zero =
      decimals >= 0 && *begin == '-' && std::all_of(begin + 1, end, [](char c) { return c == '0' || c == '.'; });
  if (negative_zero) end = std::copy(begin + 1, end, begin);
  out.used += static_cast<std::size_t>(end - begin);
}

void append_text_cell(std::string_view text, TableText& out) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    out.append(text);
    return;
  }
  std::string quoted = "\"";
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  out.append(quoted + '"');
}

}  // namespace

void write_csv(PartFile& file, const std::vector<CsvColumn>& columns, std::size_t rows, const CsvFill& fill,
               const CsvTextColumn& last_column) {
  TableText out{file, std::vector<char>(kBufferBytes)};

  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (i > 0) out.append(",");
    append_text_cell(columns[i].name, out);
  }
  if (last_column.text) {
    if (!columns.empty()) out.append(",");
    append_text_cell(last_column.name, out);
  }
  out.append("\n");

  std::vector<double> cells(columns.size());
  for (std::size_t row = 0; row < rows; ++row) {
    std::fill(cells.begin(), cells.end(), std::numeric_limits<double>::quiet_NaN());
    fill(row, cells.data());
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (i > 0) out.append(",");
      append_cell(cells[i], columns[i].decimals, out);
    }
    if (last_column.text) {
      if (!columns.empty()) out.append(",");
      append_text_cell(last_column.text(row), out);
    }
    out.append("\n");
  }
  out.flush();
}

void write_csv(const std::string& path, const std::vector<CsvColumn>& columns, std::size_t rows, const CsvFill& fill,
               const CsvTextColumn& last_column) {
  PartFile file(path);
  write_csv(file, columns, rows, fill, last_column);
  file.commit();
}

}  // namespace liealign
