// Reading named numeric columns from CSV: one pass over the lines, std::from_chars, no allocation per cell.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "liealign/core/error.hpp"
#include "liealign/io/csv.hpp"
#include "liealign/io/text_file.hpp"

namespace liealign {
namespace {

constexpr std::size_t kLongestShown = 40;    // characters of a cell in a message
constexpr std::size_t kMostNamesShown = 30;  // columns in a message

std::string place(const CsvTable& table, std::size_t line, std::size_t cell) {
  return table.path + ":" + std::to_string(line) + ":" + std::to_string(cell + 1) + ": ";
}

[[noreturn]] void fail(const CsvTable& table, std::size_t line, std::size_t cell, const std::string& text) {
  throw InputError(place(table, line, cell) + text);
}

// ---- Text into lines, cells and numbers

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

// The next line that is neither blank nor a comment.
bool next_line(CsvTable& table, std::string_view& line) {
  while (table.lines.next(line)) {
    line = trim(line);
    if (!line.empty() && line.front() != '#') return true;
  }
  return false;
}

// Where the first cell of a line ends: at the comma, which does not count between quotes.
std::size_t cell_end(std::string_view line) {
  std::size_t at = 0;
  while (at < line.size() && is_space(line[at])) ++at;
  while (at < line.size() && line[at] == '"') {  // again for a doubled quote, which closes and reopens
    at = line.find('"', at + 1);
    if (at == std::string_view::npos) return line.size();
    ++at;
  }
  while (at < line.size() && line[at] != ',') ++at;  // cells are too short for a call of find()
  return at;
}

void split(std::string_view line, std::vector<std::string_view>& cells) {
  cells.clear();
  for (;;) {
    const std::size_t end = cell_end(line);
    std::string_view cell = trim(line.substr(0, end));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = trim(cell.substr(1, cell.size() - 2));
    cells.push_back(cell);
    if (end == line.size()) return;
    line.remove_prefix(end + 1);
  }
}

// The number, which may be NaN or infinite if the text says so; nothing where the text is no number or too large.
std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size()) return std::nullopt;
  if (error == std::errc{}) return value;
  // from_chars calls 1e-400 out of range just as it does 1e400; the first is a good zero.
  const std::size_t exponent = text.find_first_of("eE");
  const bool too_small = exponent != std::string_view::npos && text.substr(exponent + 1).starts_with('-');
  return too_small ? std::optional(0.0) : std::nullopt;
}

// ---- Words for messages

std::string shown(std::string_view text) {
  std::string out(text.substr(0, kLongestShown));
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  }
  return text.size() > kLongestShown ? out + "..." : out;
}

std::string expected_header(const std::vector<CsvField>& fields) {
  std::string out;
  for (const CsvField& field : fields) {
    if (!field.required) continue;
    if (!out.empty()) out += ',';
    out += field.name;
  }
  return out;
}

std::string found_columns(const std::vector<std::string_view>& names) {
  std::string out;
  for (std::size_t i = 0; i < std::min(names.size(), kMostNamesShown); ++i) {
    if (i > 0) out += ',';
    out += shown(names[i]);
  }
  return names.size() > kMostNamesShown ? out + ",..." : out;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// Insertions, deletions and replacements that turn one word into the other (Levenshtein).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

bool is_slip_of(std::string_view found, std::string_view wanted) {
  const std::size_t longest_difference = std::min<std::size_t>(2, wanted.size() / 3);
  return found.size() <= wanted.size() + 2 && edit_distance(lower(found), lower(wanted)) <= longest_difference;
}

// The same quantity in another unit or spelt out: gyro_x_dps for gyro_x_rps, latitude for lat_deg.
bool is_variant_of(std::string_view found, std::string_view wanted) {
  return lower(found).starts_with(wanted.substr(0, wanted.rfind('_')));
}

// The column, not asked for under its own name, that may be meant by `wanted`.
template <typename IsClose>
std::size_t close_column(const CsvTable& table, const std::vector<std::string_view>& names, std::string_view wanted,
                         const IsClose& is_close) {
  for (std::size_t cell = 0; cell < names.size(); ++cell) {
    const bool asked_for = std::any_of(table.fields.begin(), table.fields.end(),
                                       [&](const CsvField& field) { return field.name == names[cell]; });
    if (!asked_for && is_close(names[cell], wanted)) return cell;
  }
  return kNoCell;
}

// ---- The header

// A file that is no comma-separated table with a header, told from one that lacks a column.
void check_is_header(const CsvTable& table, std::string_view line, const std::vector<std::string_view>& names) {
  const std::string header = expected_header(table.fields);
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 && c != '\t'; };
  if (std::any_of(line.begin(), line.end(), is_control)) {
    fail(table, table.lines.number(), 0, "the file is not UTF-8 text; expected a CSV file with the header " + header);
  }
  if (names.size() == 1 && line.find_first_of(";\t") != std::string_view::npos) {
    const std::string separator = line.find(';') != std::string_view::npos ? "semicolons" : "tabs";
    fail(table, table.lines.number(), 0,
         "the columns are separated by " + separator +
             "; expected commas between columns and points in numbers: header " + header);
  }
  if (parse_number(names.front())) {
    fail(table, table.lines.number(), 0,
         "the first row holds numbers; expected the header " + header +
             " above it (a line that starts with # is a comment)");
  }
}

[[noreturn]] void fail_missing(const CsvTable& table, const std::vector<std::string_view>& names,
                               const CsvField& field) {
  std::string text = "column " + std::string(field.name) + " is missing; found " + found_columns(names);
  std::size_t close = close_column(table, names, field.name, is_variant_of);
  if (close == kNoCell) close = close_column(table, names, field.name, is_slip_of);
  if (close != kNoCell) {
    text += "; did you mean " + shown(names[close]) + "? It must be named " + std::string(field.name);
    if (!field.unit.empty()) text += " and be in " + std::string(field.unit);
  }
  fail(table, table.header_line, close == kNoCell ? 0 : close, text);
}

void find_fields(CsvTable& table, const std::vector<std::string_view>& names, std::vector<std::string>& warnings) {
  for (const CsvField& field : table.fields) {
    const auto first = std::find(names.begin(), names.end(), field.name);
    if (first == names.end()) {
      if (field.required) fail_missing(table, names, field);
      table.cell_of_field.push_back(kNoCell);
      const std::size_t slip = close_column(table, names, field.name, is_slip_of);
      if (slip != kNoCell) {
        warnings.push_back(place(table, table.header_line, slip) + "column " + shown(names[slip]) +
                           " is ignored; did you mean " + std::string(field.name) + "?");
      }
      continue;
    }
    const auto cell = static_cast<std::size_t>(first - names.begin());
    const auto second = std::find(first + 1, names.end(), field.name);
    if (second != names.end()) {
      fail(table, table.header_line, static_cast<std::size_t>(second - names.begin()),
           "column " + std::string(field.name) + " appears twice, first as column " + std::to_string(cell + 1) +
               "; keep one of the two");
    }
    table.cell_of_field.push_back(cell);
  }
}

[[noreturn]] void fail_cell_count(const CsvTable& table, std::size_t cells) {
  std::string text = "the row has " + std::to_string(cells) + (cells == 1 ? " cell" : " cells") + "; expected " +
                     std::to_string(table.cells_per_row) + " as in the header";
  if (table.lines.cut_off()) {
    text += "; the file ends within this line: if it was cut off, remove the line";
  }
  fail(table, table.lines.number(), std::min(cells, table.cells_per_row), text);
}

}  // namespace

CsvTable open_csv(const std::string& path, const std::vector<CsvField>& fields, std::vector<std::string>& warnings) {
  CsvTable table{path, TextLines(path), fields};
  std::string_view line;
  if (!next_line(table, line)) {
    throw InputError(
        path + (table.lines.number() == 0 ? ": the file is empty" : ": the file holds only blank lines and comments") +
        "; expected the header " + expected_header(fields));
  }
  table.header_line = table.lines.number();
  std::vector<std::string_view> names;
  split(line, names);
  check_is_header(table, line, names);
  find_fields(table, names, warnings);
  table.cells_per_row = names.size();
  return table;
}

bool next_row(CsvTable& table, CsvRow& row) {
  std::string_view line;
  if (!next_line(table, line)) {
    if (table.rows > 0) return false;
    fail(table, table.header_line, 0, "no row follows the header; expected at least one row of numbers");
  }
  ++table.rows;
  row.line = table.lines.number();
  split(line, row.cells);
  if (row.cells.size() != table.cells_per_row) fail_cell_count(table, row.cells.size());

  row.values.assign(table.fields.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < table.fields.size(); ++i) {
    const CsvField& field = table.fields[i];
    if (table.cell_of_field[i] == kNoCell) continue;
    const std::string_view cell = row.cells[table.cell_of_field[i]];
    if (cell.empty() && !field.required) continue;
    const std::optional<double> value = parse_number(cell);
    if (!value || !(*value >= field.min && *value <= field.max)) fail_at(table, row, i);  // NaN fails here too
    row.values[i] = *value;
  }
  return true;
}

void fail_at(const CsvTable& table, std::size_t line, std::size_t field, const std::string& text) {
  const std::size_t cell = table.cell_of_field[field];
  fail(table, line, cell == kNoCell ? 0 : cell, text);
}

void fail_at(const CsvTable& table, const CsvRow& row, std::size_t field) {
  const CsvField& wanted = table.fields[field];
  const std::string_view cell = row.cells[table.cell_of_field[field]];
  std::string text = std::string(wanted.name) + (cell.empty() ? " is empty" : " is \"" + shown(cell) + "\"") +
                     "; expected " + std::string(wanted.expected);
  if (!wanted.unit.empty()) text += " [" + std::string(wanted.unit) + "]";
  fail_at(table, row.line, field, text);
}

}  // namespace liealign
