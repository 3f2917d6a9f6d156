// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A row between a store and its copy. As bytes: how many follow (32 bits), the table's place and whether the
// row is removed (one byte), its key, what SQLite type it has (one byte), its content.
#include <sqlite3.h>

#include "store/store_check.hpp"

namespace plumbline::maps {

struct StoreRow {
  RowName name;
  bool removed = false;
  int type = SQLITE_BLOB;  ///< SQLITE_BLOB, SQLITE_TEXT or SQLITE_INTEGER: which of these holds it
  Bytes data;
  std::string text;
  std::int64_t integer = 0;
};

constexpr std::size_t kRowLength = sizeof(std::uint32_t);  ///< bytes of the length in front

void append(StoreRow row, ByteWriter& to);
/// What follows the length. Throws BadBytes.
StoreRow parse_row(const Bytes& bytes);

}  // namespace plumbline::maps
