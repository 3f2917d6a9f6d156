// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Tables of comma-separated values (RFC 4180), as the program writes and reads them. Numbers stand as they
// are. Texts, such as names of robots, are quoted where they hold a comma, a quote or an end of line; and one
// that a spreadsheet would take for a formula, since it begins with = + - @ or a tab, gets an apostrophe in
// front, as does one that begins with an apostrophe: a reader takes one leading apostrophe off.
#include <cstddef>
#include <string>
#include <string_view>

namespace plumbline::core {

/// A text as a field of a table.
std::string csv_field(std::string_view text);

/// The text of a field, without quotes and apostrophe.
std::string csv_text(std::string_view field);

/// A field where it stands in a table, with its quotes.
struct CsvField {
  std::string_view field;
  bool last = false;  ///< of its row
};

/// The field that begins at `at`, which is moved behind it and the comma or the end of line that follows.
CsvField next_csv_field(std::string_view table, std::size_t& at);

}  // namespace plumbline::core
