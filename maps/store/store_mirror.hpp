// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A table that is kept equal to what the program holds, at the cost of what changed.
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "store/store_schema.hpp"
#include "store/store_sqlite.hpp"

namespace plumbline::maps {

/// Rows are named by two numbers and hold packed bytes. A round: begin, put or keep every row there is, end:
/// rows whose bytes changed are written, rows that were not named are deleted.
class Mirror {
 public:
  using Key = std::pair<std::int32_t, std::int64_t>;

  /// `transaction`: the number of the one that is going on, whenever rows change.
  Mirror(Database& database, const std::string& table, const std::int64_t& transaction)
      : database_(database),
        transaction_(transaction),
        put_(database, ("REPLACE INTO " + table + " VALUES (?, ?, ?, ?)").c_str()),
        bring_back_(database,
                    ("DELETE FROM removed WHERE place = " + place_of(table) + " AND robot = ? AND number = ?")
                        .c_str()),
        bury_(database, ("REPLACE INTO removed VALUES (" + place_of(table) + ", ?, ?, ?)").c_str()),
        erase_(database, ("DELETE FROM " + table + " WHERE robot = ? AND number = ?").c_str()),
        get_(database, ("SELECT data FROM " + table + " WHERE robot = ? AND number = ?").c_str()),
        keys_("SELECT robot, number FROM " + table) {
    reread();
  }

  /// After a round that was rolled back: knows again which rows there are, but not what they hold.
  void reread() {
    rows_.clear();
    Statement keys(database_, keys_.c_str());
    while (keys.step()) {
      rows_[{static_cast<std::int32_t>(keys.integer(0)), keys.integer(1)}] = Row{};
    }
  }
  void begin() { ++round_; }
  /// Of rows that never change: whether this one is there for certain, and need not be put.
  bool keep(Key key) {
    const auto found = rows_.find(key);
    if (found == rows_.end() || !found->second.known) return false;
    found->second.round = round_;
    return true;
  }
  /// Of rows that never change and need not be known: this one stays.
  void stay(Key key) {
    const auto found = rows_.find(key);
    if (found != rows_.end()) found->second.round = round_;
  }
  /// A row that is there no longer, if it ever was.
  void erase(Key key) {
    if (rows_.erase(key) != 0) remove(key);
  }
  void put(Key key, const Bytes& bytes) {
    const std::size_t print = std::hash<std::string_view>()(
        {static_cast<const char*>(static_cast<const void*>(bytes.data())), bytes.size()});
    const auto [row, is_new] = rows_.try_emplace(key);
    row->second.round = round_;
    if (!is_new && row->second.known && row->second.print == print) return;
    const Bytes packed = pack(bytes);
    const bool is_there = !is_new && !row->second.known && holds(key, packed);
    row->second.known = true;
    row->second.print = print;
    if (is_there) return;
    put_.bind(1, key.first).bind(2, key.second).bind(3, transaction_).bind(4, packed).run();
    if (is_new) bring_back_.bind(1, key.first).bind(2, key.second).run();
  }
  /// `robot`: rows of others stay whatever was named; -1: they do not.
  void end(std::int32_t robot = -1) {
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
    std::size_t print = 0;
    bool known = false;  ///< whether `print` is that of the row in the file
    std::uint64_t round = 0;
  };
  /// What is removed leaves a note, for those who keep a copy.
  void remove(Key key) {
    erase_.bind(1, key.first).bind(2, key.second).run();
    bury_.bind(1, key.first).bind(2, key.second).bind(3, transaction_).run();
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
  Statement bring_back_;
  Statement bury_;
  Statement erase_;
  Statement get_;
  std::string keys_;
  std::map<Key, Row> rows_;
  std::uint64_t round_ = 0;
};

}  // namespace plumbline::maps
