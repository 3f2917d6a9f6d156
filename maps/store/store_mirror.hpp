// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keeps a table equal to the program's data, at a cost that depends on the changes only.
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "store/store_schema.hpp"
#include "store/store_sqlite.hpp"

namespace plumbline::maps {

/// Rows have two numbers as key and hold packed bytes. In a round, begin_round() comes first, then every row
/// is put or marked, then delete_unmarked(): changed rows are written, rows neither put nor marked are
/// deleted.
class Mirror {
 public:
  using Key = std::pair<std::int32_t, std::int64_t>;

  /// `transaction`: number of the current one, whenever rows change.
  Mirror(Database& database, const std::string& table, const std::int64_t& transaction)
      : database_(database),
        transaction_(transaction),
        put_(database, ("REPLACE INTO " + table + " VALUES (?, ?, ?, ?)").c_str()),
        delete_tombstone_(database, ("DELETE FROM removed WHERE place = " + index_of(table) +
                                     " AND robot = ? AND number = ?")
                                        .c_str()),
        insert_tombstone_(database,
                          ("REPLACE INTO removed VALUES (" + index_of(table) + ", ?, ?, ?)").c_str()),
        erase_(database, ("DELETE FROM " + table + " WHERE robot = ? AND number = ?").c_str()),
        get_(database, ("SELECT data FROM " + table + " WHERE robot = ? AND number = ?").c_str()),
        keys_("SELECT robot, number FROM " + table) {
    reload();
  }

  /// Reads the keys again after a round that was rolled back; the contents stay unknown.
  void reload() {
    rows_.clear();
    Statement keys(database_, keys_.c_str());
    while (keys.step()) {
      rows_[{static_cast<std::int32_t>(keys.integer(0)), keys.integer(1)}] = Row{};
    }
  }
  void begin_round() { ++round_; }
  /// For rows that never change: true if this one is stored with known content, and need not be put.
  bool mark_unchanged(Key key) {
    const auto found = rows_.find(key);
    if (found == rows_.end() || !found->second.known) return false;
    found->second.round = round_;
    return true;
  }
  /// For rows that never change and whose content does not matter: keeps this one.
  void mark_present(Key key) {
    const auto found = rows_.find(key);
    if (found != rows_.end()) found->second.round = round_;
  }
  /// Deletes a row if it exists.
  void erase(Key key) {
    if (rows_.erase(key) != 0) remove(key);
  }
  void put(Key key, const Bytes& bytes) {
    const std::size_t hash = std::hash<std::string_view>()(
        {static_cast<const char*>(static_cast<const void*>(bytes.data())), bytes.size()});
    const auto [row, is_new] = rows_.try_emplace(key);
    row->second.round = round_;

    // An unchanged row costs one hash
    if (!is_new && row->second.known && row->second.hash == hash) return;

    // After a restart the stored bytes are compared
    const Bytes packed = pack(bytes);
    const bool is_there = !is_new && !row->second.known && holds(key, packed);
    row->second.known = true;
    row->second.hash = hash;
    if (is_there) return;
    put_.bind(1, key.first).bind(2, key.second).bind(3, transaction_).bind(4, packed).run();
    if (is_new) delete_tombstone_.bind(1, key.first).bind(2, key.second).run();
  }
  /// Deletes the rows that this round neither put nor marked; only those of `robot`, unless that is -1.
  void delete_unmarked(std::int32_t robot = -1) {
    for (auto row = rows_.begin(); row != rows_.end();) {
      if (row->second.round == round_ || (robot >= 0 && row->first.first != robot)) {
        ++row;
        continue;
      }
      remove(row->first);
      row = rows_.erase(row);
    }
  }

 private:
  struct Row {
    std::size_t hash = 0;
    bool known = false;  ///< true: `hash` is that of the row in the file
    std::uint64_t round = 0;
  };
  /// Leaves a tombstone for copies.
  void remove(Key key) {
    erase_.bind(1, key.first).bind(2, key.second).run();
    insert_tombstone_.bind(1, key.first).bind(2, key.second).bind(3, transaction_).run();
  }
  bool holds(Key key, const Bytes& packed) {
    const bool found = get_.bind(1, key.first).bind(2, key.second).step();
    const bool equal = found && get_.blob(0) == packed;
    get_.reset();
    return equal;
  }

  Database& database_;
  const std::int64_t& transaction_;
  Statement put_;
  Statement delete_tombstone_;
  Statement insert_tombstone_;
  Statement erase_;
  Statement get_;
  std::string keys_;
  std::map<Key, Row> rows_;
  std::uint64_t round_ = 0;
};

}  // namespace plumbline::maps
