// Writing tables as CSV (RFC 4180, lines end in LF).
//
// Fixed notation with d decimals is the integer nearest to v = |x| 10^d with a point in it. In doubles p = |x| 10^d is v
// within p 2^-53, since 10^d is exact: where p is farther than that from the middle between two integers, v rounds as p
// does, and the text is that of std::to_chars. In the middle, or without room for a fraction, std::to_chars writes.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/io/csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "liealign/io/text_file.hpp"

namespace liealign {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;
constexpr std::size_t kMostDigitsBeforePoint = 312;  // of a double in fixed notation, with sign and point

constexpr std::array<double, 16> kPowersOfTen = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
constexpr std::size_t kMostFixed = 20;  // characters of an integer below 1e15 with sign, point and a zero before it

// "00" to "99": the digits of a number are found in pairs.
constexpr std::array<char, 200> kPairs = [] {
  std::array<char, 200> pairs{};
  for (std::size_t i = 0; i < 100; ++i) {
    pairs[2 * i] = static_cast<char>('0' + i / 10);
    pairs[2 * i + 1] = static_cast<char>('0' + i % 10);
  }
  return pairs;
}();

// The last `count` digits of n go before `end`, the others remain in n. Returns where they begin.
char* put_digits(std::uint64_t& n, int count, char* end) {
  for (; count >= 2; count -= 2) {
    const std::uint64_t rest = n / 100;
    end -= 2;
    std::copy_n(kPairs.data() + 2 * (n - 100 * rest), 2, end);
    n = rest;
  }
  if (count == 1) {
    *--end = static_cast<char>('0' + n % 10);
    n /= 10;
  }
  return end;
}

// Puts x before `end` and returns where it begins, or `end` where std::to_chars has to write it.
char* put_fixed(double x, int decimals, char* const end) {
  constexpr double kMost = 1e15;
  if (decimals >= static_cast<int>(kPowersOfTen.size())) return end;
  const double p = std::abs(x) * kPowersOfTen[static_cast<std::size_t>(decimals)];
  if (!(p < kMost)) return end;
  const auto below = static_cast<std::int64_t>(p);
  const double fraction = p - static_cast<double>(below);  // without a rounding
  if (std::abs(fraction - 0.5) <= 0x1p-52 * p) return end;
  auto n = static_cast<std::uint64_t>(below) + (fraction > 0.5 ? 1U : 0U);
  const bool negative = x < 0.0 && n > 0;  // a small negative number rounds to "0.00": the sign would say nothing
  char* begin = end;
  if (decimals > 0) {
    begin = put_digits(n, decimals, begin);
    *--begin = '.';
  }
  do {
    begin = put_digits(n, n >= 10 ? 2 : 1, begin);
  } while (n > 0);
  if (negative) *--begin = '-';
  return begin;
}

void append_by_to_chars(std::string& out, double x, int decimals) {
  const std::size_t used = out.size();
  out.resize(used + kMostDigitsBeforePoint + static_cast<std::size_t>(std::max(decimals, 0)));
  char* const begin = out.data() + used;
  char* const most = out.data() + out.size();
  char* end = decimals < 0 ? std::to_chars(begin, most, x).ptr
                           : std::to_chars(begin, most, x, std::chars_format::fixed, decimals).ptr;
  const bool negative_zero =
      decimals >= 0 && *begin == '-' && std::all_of(begin + 1, end, [](char c) { return c == '0' || c == '.'; });
  if (negative_zero) end = std::copy(begin + 1, end, begin);
  out.resize(static_cast<std::size_t>(end - out.data()));
}

void append_cell(std::string& out, double x, int decimals) {
  if (!std::isfinite(x)) return;
  std::array<char, kMostFixed> text;
  char* const end = text.data() + text.size();
  const char* const begin = decimals >= 0 ? put_fixed(x, decimals, end) : end;
  if (begin == end) {
    append_by_to_chars(out, x, decimals);
  } else {
    out.append(begin, static_cast<std::size_t>(end - begin));
  }
}

void append_text_cell(std::string& out, std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    out += text;
    return;
  }
  out += '"';
  for (const char c : text) out.append(c == '"' ? 2 : 1, c);
  out += '"';
}

void append_last(std::string& out, bool first, std::optional<std::string_view> last) {
  if (last && !first) out += ',';
  if (last) append_text_cell(out, *last);
  out += '\n';
}

}  // namespace

void append_csv_header(std::string& out, const std::vector<CsvColumn>& columns, std::optional<std::string_view> last) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (i > 0) out += ',';
    append_text_cell(out, columns[i].name);
  }
  append_last(out, columns.empty(), last);
}

void append_csv_row(std::string& out, const std::vector<CsvColumn>& columns, const double* cells,
                    std::optional<std::string_view> last) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (i > 0) out += ',';
    append_cell(out, cells[i], columns[i].decimals);
  }
  append_last(out, columns.empty(), last);
}

void write_csv(PartFile& file, const std::vector<CsvColumn>& columns, std::size_t rows, const CsvFill& fill,
               const CsvTextColumn& last_column) {
  std::string text;
  text.reserve(kBufferBytes + kBufferBytes / 8);  // the last row goes beyond
  const bool with_words = static_cast<bool>(last_column.text);
  append_csv_header(text, columns, with_words ? std::optional<std::string_view>(last_column.name) : std::nullopt);
  std::vector<double> cells(columns.size());
  std::string word;
  for (std::size_t row = 0; row < rows; ++row) {
    std::fill(cells.begin(), cells.end(), std::numeric_limits<double>::quiet_NaN());
    fill(row, cells.data());
    if (with_words) word = last_column.text(row);
    append_csv_row(text, columns, cells.data(), with_words ? std::optional<std::string_view>(word) : std::nullopt);
    if (text.size() < kBufferBytes) continue;
    file.write(text);
    text.clear();
  }
  file.write(text);
}

void write_csv(const std::string& path, const std::vector<CsvColumn>& columns, std::size_t rows, const CsvFill& fill,
               const CsvTextColumn& last_column) {
  PartFile file(path);
  write_csv(file, columns, rows, fill, last_column);
  file.commit();
}

}  // namespace liealign
