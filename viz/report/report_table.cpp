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

#include "plumbline/core/numbers.hpp"

namespace plumbline::report {

core::Result<CsvTable> CsvTable::read(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  CsvTable table;
  table.text_ = read_bytes(file);

  if (table.text_.empty()) {
    return core::input_error(fmt::format("{} is not there or cannot be read", name));
  }

  std::size_t line = 0;
  for (std::size_t begin = 0; begin < table.text_.size(); ++line) {
    const std::size_t end = std::min(table.text_.find('\n', begin), table.text_.size());
    std::size_t cells = 0;

    for (std::size_t from = begin; from <= end; ++cells) {
      const std::size_t to = std::min(table.text_.find(',', from), end);
      if (line == 0) {
        table.columns_.push_back(table.text_.substr(from, to - from));
      } else {
        table.cells_.push_back({from, to - from});
      }
      from = to + 1;
    }

    if (cells != table.columns_.size()) {
      return core::input_error(fmt::format("{} is damaged: line {} has {} columns of {}", name, line + 1,
                                           cells, table.columns_.size()));
    }

    begin = end + 1;
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
