// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Checks rows from an untrusted sender before they are stored.
#include <vector>

#include "store/map_rows.hpp"
#include "store/store_schema.hpp"

namespace plumbline::maps {

/// Key of a row; `table` is an index into kRowTables.
struct RowName {
  std::size_t table = 0;
  std::string key;  ///< of a named table
  std::int64_t robot = 0;
  std::int64_t number = 0;
};

/// Largest size of a packed row, bytes.
constexpr std::size_t kMostRowBytes = 16U << 20U;

/// Decodes a row of a map. Throws BadBytes with the reason: a key out of range, bytes that do not decode or
/// that belong to another row, numbers that are not finite. Robots in the row of the header are added to
/// `robots`.
RowContent check_row(const RowName& name, const Bytes& bytes, std::vector<RobotInfo>& robots);
/// The same for a row that is removed.
void check_name(const RowName& name);

}  // namespace plumbline::maps
