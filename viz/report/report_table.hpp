// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Tables of a result read back (frames.csv and timing.csv), with descriptions of their columns.
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::report {

/// Cells as plain text, without the quotes of the table.
class CsvTable {
 public:
  /// Errors (kInput): cannot be read, without header, or a line that does not have its columns.
  static core::Result<CsvTable> read(const std::filesystem::path& file);

  [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }
  [[nodiscard]] std::size_t rows() const { return columns_.empty() ? 0 : cells_.size() / columns_.size(); }
  /// Index of a column; columns().size() where there is none of that name.
  [[nodiscard]] std::size_t column(const std::string& name) const;
  /// Empty where there is no such column.
  [[nodiscard]] std::string_view text(std::size_t row, std::size_t column) const;
  /// NaN where there is no number.
  [[nodiscard]] double number(std::size_t row, std::size_t column) const;

 private:
  struct Cell {
    std::size_t begin, length;
  };
  std::string text_;
  std::vector<std::string> columns_;
  std::vector<Cell> cells_;
};

/// A whole file; empty when it cannot be read.
std::string read_bytes(const std::filesystem::path& file);

/// "is damaged" of a file that was read in vain; "cannot be read (Permission denied)" if it cannot be opened.
std::string fault_of(const std::filesystem::path& file);

}  // namespace plumbline::report
