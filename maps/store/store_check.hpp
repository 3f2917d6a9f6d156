// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Rows from a stranger, looked at before they are stored.
#include <vector>

#include "store/store_schema.hpp"

namespace plumbline::maps {

/// A row on its way: of a table of kRowTables, by its place there.
struct RowName {
  std::size_t place = 0;
  std::string key;  ///< of a named table
  std::int64_t robot = 0;
  std::int64_t number = 0;
};

/// The most bytes that a row of a table takes, packed.
constexpr std::size_t kMostRowBytes = 16U << 20U;

/// Throws BadBytes with the reason: a key out of range, bytes that do not decode or that belong to another
/// row, numbers that are not finite. `robots` are learned from the header's row.
void check_row(const RowName& name, const Bytes& bytes, std::vector<RobotInfo>& robots);
/// The same of a row that goes.
void check_name(const RowName& name);

}  // namespace plumbline::maps
