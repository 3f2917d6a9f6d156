// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// SQLiteCpp adapted to stores: rows hold packed bytes, errors end as core::Result at the store's public
// functions.
#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>

#include "plumbline/core/error.hpp"
#include "store/store_bytes.hpp"

namespace plumbline::maps {

/// Failure and remedy, without the file's name.
struct StoreFailure : std::runtime_error {
  StoreFailure(core::ErrorKind k, const std::string& what) : std::runtime_error(what), kind(k) {}
  core::ErrorKind kind;
};
/// `kind` unless the file's content is to blame.
StoreFailure failure_of(const SQLite::Exception& error, core::ErrorKind kind);

class Database : public SQLite::Database {
 public:
  enum class Access {
    kRead = SQLITE_OPEN_READONLY,
    kWrite = SQLITE_OPEN_READWRITE,
    kCreate = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE,
  };
  Database(const std::filesystem::path& file, Access access);
  void run(const std::string& sql) { exec(sql); }
  [[nodiscard]] std::int64_t number(const std::string& sql);  ///< first column of the first row, or 0
};

class Statement : public SQLite::Statement {
 public:
  using SQLite::Statement::Statement;
  /// Places count from 1. Bytes are not copied: they must live until all rows were read.
  template <typename T>
  Statement& bind(int parameter, const T& value) {
    if constexpr (std::is_same_v<T, Bytes>) {  // a null pointer would be NULL instead of an empty blob
      bindNoCopy(parameter, value.empty() ? static_cast<const void*>("") : value.data(),
                 static_cast<int>(value.size()));
    } else {
      SQLite::Statement::bind(parameter, value);
    }
    return *this;
  }
  /// True if there is a row. After the last one, and after run(), the statement is ready for new values.
  bool step();
  void run() {
    while (step()) {
    }
  }
  [[nodiscard]] std::int64_t integer(int column) const { return getColumn(column).getInt64(); }
  [[nodiscard]] std::string text(int column) const { return getColumn(column).getString(); }
  [[nodiscard]] Bytes blob(int column) const;
  [[nodiscard]] Bytes unpacked(int column) const;  ///< throws BadBytes
};

/// Rolls back unless committed.
class Transaction : public SQLite::Transaction {
 public:
  /// A writing transaction waits for its turn here instead of at its first change.
  Transaction(Database& database, bool writes)
      : SQLite::Transaction(database, writes ? SQLite::TransactionBehavior::IMMEDIATE
                                             : SQLite::TransactionBehavior::DEFERRED) {}
};

/// Runs `action`; its exceptions become errors that begin with the file, damage those of kInput.
template <typename Action>
auto guarded(const std::filesystem::path& file, core::ErrorKind kind, const Action& action)
    -> core::Result<decltype(action())> {
  // Every message begins with the file
  const auto fail = [&](core::ErrorKind what, const std::string& text) {
    return core::failure(what, file.string() + ": " + text);
  };

  try {
    // Actions may return nothing
    if constexpr (std::is_void_v<decltype(action())>) {
      action();
      return {};
    } else {
      return action();
    }

  } catch (const StoreFailure& failure) {
    return fail(failure.kind, failure.what());
  } catch (const SQLite::Exception& error) {
    const StoreFailure failure = failure_of(error, kind);
    return fail(failure.kind, failure.what());
  } catch (const BadBytes& bad) {
    return fail(core::ErrorKind::kInput, std::string("damaged: ") + bad.what() +
                                             "; use a copy of the file or map the recording again");
  }
}

/// Calls row(robot, number, unpacked bytes) for all rows of `table` by robot and number; what `row` dislikes
/// is reported with the row's name.
void each_row(Database& database, const std::string& table,
              const std::function<void(std::int64_t, std::int64_t, const Bytes&)>& row);

}  // namespace plumbline::maps
