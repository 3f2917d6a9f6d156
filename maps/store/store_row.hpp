// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A row between a store and its copy. As bytes: how many follow (32 bits), the table's place and whether the
// row is removed (one byte), its key, what SQLite type it has (one byte), its content.
#include <sqlite3.h>

#include <functional>

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

void append(StoreRow row, ByteWriter& to);
/// Takes all rows that are whole from the front of `bytes`: `row` gets each with the bytes that it took.
/// Throws BadBytes.
void take_rows(Bytes& bytes, const std::function<void(const StoreRow&, std::size_t)>& row);

}  // namespace plumbline::maps
