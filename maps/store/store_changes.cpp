// SPDX-License-Identifier: BSD-3-Clause
// Reads the rows of a store that a copy lacks.
#include <sqlite3.h>

#include "store/store_row.hpp"
#include "store/store_schema.hpp"

namespace plumbline::maps {
namespace {

using core::ErrorKind;

/// Opens the store and calls `read` in one read transaction.
template <typename Read>
auto in_one_transaction(const std::filesystem::path& file, const Read& read) {
  return guarded(file, ErrorKind::kInput, [&] {
    check_file(file);
    Database database(file, Database::Access::kRead);
    check_store(database);
    const Transaction moment(database, false);
    return read(database);
  });
}

/// The lowest number above `after` in a stream's tables; 0: there is none.
std::int64_t next_number(Database& database, StoreStream stream, std::int64_t after) {
  std::int64_t next = 0;
  const auto look = [&](const std::string& table) {
    Statement lowest(database, ("SELECT min(changed) FROM " + table + " WHERE changed > ?").c_str());
    if (!lowest.bind(1, after).step()) return;
    const std::int64_t number = lowest.integer(0);  // 0 when there is none
    if (number != 0 && (next == 0 || number < next)) next = number;
  };
  for (const RowTable& table : kRowTables) {
    if (table.stream == stream) look(table.name);
  }
  if (stream == StoreStream::kMap) look("removed");
  return next;
}

/// The tombstones of one transaction.
void read_removed(Database& database, std::int64_t number, ByteWriter& to) {
  Statement rows(database,
                 "SELECT place, robot, number FROM removed WHERE changed = ? ORDER BY place, robot, number");
  rows.bind(1, number);
  while (rows.step()) {
    StoreRow row;
    row.removed = true;
    row.name.table = static_cast<std::size_t>(rows.integer(0));
    row.name.robot = rows.integer(1);
    row.name.number = rows.integer(2);
    append(row, to);
  }
}

void read_rows(Database& database, std::size_t index, std::int64_t number, ByteWriter& to) {
  // Rows that this transaction changed, by key
  const RowTable& table = kRowTables[index];
  const std::string key = table.named ? "key" : "robot, number";
  Statement rows(
      database,
      ("SELECT data, " + key + " FROM " + table.name + " WHERE changed = ? ORDER BY " + key).c_str());
  rows.bind(1, number);

  while (rows.step()) {
    // The row's key, a text or two numbers
    StoreRow row;
    row.name.table = index;
    if (table.named) {
      row.name.key = rows.text(1);
    } else {
      row.name.robot = rows.integer(1);
      row.name.number = rows.integer(2);
    }

    // SQLite's type decides the encoding
    row.type = rows.getColumn(0).getType();
    row.data = row.type == SQLITE_BLOB ? rows.blob(0) : Bytes();
    if (row.type == SQLITE_INTEGER) row.integer = rows.integer(0);
    if (row.type == SQLITE_TEXT) row.text = rows.text(0);
    append(row, to);
  }
}

}  // namespace

core::Result<StoreHeads> store_heads(const std::filesystem::path& file) {
  return in_one_transaction(file, [](Database& database) { return read_heads(database); });
}

/// The transaction that follows `after`, removals first.
core::Result<std::optional<StoreTransaction>> next_transaction(const std::filesystem::path& file,
                                                               StoreStream stream, std::int64_t after) {
  return in_one_transaction(file, [&](Database& database) -> std::optional<StoreTransaction> {
    const std::int64_t number = next_number(database, stream, after);
    if (number == 0) return std::nullopt;
    ByteWriter rows;
    if (stream == StoreStream::kMap) read_removed(database, number, rows);
    for (std::size_t index = 0; index < std::size(kRowTables); ++index) {
      if (kRowTables[index].stream == stream) read_rows(database, index, number, rows);
    }
    return StoreTransaction{number, rows.bytes()};
  });
}

}  // namespace plumbline::maps
