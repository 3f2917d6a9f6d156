// SPDX-License-Identifier: BSD-3-Clause
#include "report_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

#include "plumbline/core/csv.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::report {

core::Result<CsvTable> CsvTable::read(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  CsvTable table;
  table.text_ = read_bytes(file);

  if (table.text_.empty()) {
    return core::input_error(fmt::format("{} is not there or cannot be read", name));
  }

  for (std::size_t at = 0, row = 0; at < table.text_.size(); ++row) {
    std::size_t cells = 0;
    for (bool last = false; !last; ++cells) {
      const core::CsvField read = core::next_csv_field(table.text_, at);
      last = read.last;
      const std::string value = core::csv_text(read.field);

      // The first row names the columns.
      if (row == 0) {
        table.columns_.push_back(value);
        continue;
      }
      // The text of a field is no longer than the field, and takes its place.
      const auto begin = static_cast<std::size_t>(read.field.data() - table.text_.data());
      table.text_.replace(begin, value.size(), value);
      table.cells_.push_back({begin, value.size()});
    }

    // Every line must have all columns.
    if (cells != table.columns_.size()) {
      return core::input_error(fmt::format("{} is damaged: line {} has {} columns of {}", name, row + 1,
                                           cells, table.columns_.size()));
    }
  }
  if (table.rows() == 0) return core::input_error(fmt::format("{} is empty", name));

  return table;
}

std::size_t CsvTable::column(const std::string& name) const {
  return static_cast<std::size_t>(std::find(columns_.begin(), columns_.end(), name) - columns_.begin());
}

std::string_view CsvTable::text(std::size_t row, std::size_t column) const {
  if (column >= columns_.size() || row >= rows()) return {};
  const Cell& cell = cells_[row * columns_.size() + column];
  return std::string_view(text_).substr(cell.begin, cell.length);
}

double CsvTable::number(std::size_t row, std::size_t column) const {
  return core::to_number(text(row, column)).value_or(std::numeric_limits<double>::quiet_NaN());
}

std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

std::string fault_of(const std::filesystem::path& file) {
  errno = 0;
  const std::ifstream stream(file, std::ios::binary);
  return stream.is_open() ? "is damaged" : fmt::format("cannot be read ({})", std::strerror(errno));
}

}  // namespace plumbline::report
