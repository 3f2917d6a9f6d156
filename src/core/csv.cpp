// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/csv.hpp"

#include <algorithm>

namespace plumbline::core {
namespace {

constexpr std::string_view kFormula = "=+-@\t\r'";  ///< what begins a formula, and the mark against it

}  // namespace

/// A field as CSV; spreadsheets must not take it for a formula.
std::string csv_field(std::string_view text) {
  const bool marked = !text.empty() && kFormula.find(text.front()) != std::string_view::npos;
  std::string field = marked ? "'" : "";
  field += text;
  if (field.find_first_of(",\"\r\n") == std::string::npos) return field;

  // Quotes are doubled within quotes (RFC 4180)
  std::string quoted = "\"";
  for (const char c : field) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

/// The inverse of csv_field().
std::string csv_text(std::string_view field) {
  std::string text;
  if (!field.empty() && field.front() == '"') {
    for (std::size_t i = 1; i < field.size(); ++i) {
      if (field[i] == '"' && (i + 1 >= field.size() || field[++i] != '"')) break;
      text += field[i];
    }
  } else {
    text = field;
  }
  if (!text.empty() && text.front() == '\'') text.erase(0, 1);
  return text;
}

/// The next field of a table; commas and line ends within quotes belong to it.
CsvField next_csv_field(std::string_view table, std::size_t& at) {
  const std::size_t begin = at;
  bool quoted = false;
  for (; at < table.size(); ++at) {
    if (table[at] == '"') quoted = !quoted;
    if (!quoted && (table[at] == ',' || table[at] == '\n')) break;
  }

  // The line ends with its last field
  const std::size_t end = at;
  const bool last = end >= table.size() || table[end] == '\n';
  at = std::min(end + 1, table.size());
  std::string_view field = table.substr(begin, end - begin);
  if (last && !field.empty() && field.back() == '\r') field.remove_suffix(1);  // a table of another program
  return {field, last};
}

}  // namespace plumbline::core
