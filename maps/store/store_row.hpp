// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A row on its way from a store to its copy. As bytes: the number of bytes that follow (32 bits), the table's
// index and whether the row is removed (one byte), its key, its SQLite type (one byte), its content.
#include <sqlite3.h>

#include <functional>

#include "store/store_check.hpp"

namespace plumbline::maps {

struct StoreRow {
  RowName name;
  bool removed = false;
  int type = SQLITE_BLOB;  ///< SQLITE_BLOB, SQLITE_TEXT or SQLITE_INTEGER: which member holds the content
  Bytes data;
  std::string text;
  std::int64_t integer = 0;
};

void append(StoreRow row, ByteWriter& to);
/// Removes all complete rows from the front of `bytes`; `row` gets each with its size in bytes.
/// Throws BadBytes.
void consume_rows(Bytes& bytes, const std::function<void(const StoreRow&, std::size_t)>& row);

}  // namespace plumbline::maps
