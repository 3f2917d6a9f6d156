// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The little of SQLite that stores need, with errors as exceptions that end as core::Result at the store's
// public functions.
#include <sqlite3.h>

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include "plumbline/core/error.hpp"
#include "store_bytes.hpp"

namespace plumbline::maps {

/// What went wrong and what to do about it, without the file's name.
struct StoreFailure : std::runtime_error {
  StoreFailure(core::ErrorKind k, const std::string& what) : std::runtime_error(what), kind(k) {}
  core::ErrorKind kind;
};

class Database;

class Statement {
 public:
  Statement(Database& database, const char* sql);
  Statement& bind(int place, std::int64_t value);  ///< places count from 1
  Statement& bind(int place, const std::string& text);
  Statement& bind(int place, const Bytes& blob);  ///< not copied: must live until reset
  /// True: there is a row. After the last one, and after run(), the statement is ready for new values.
  bool step();
  void run();
  void rewind();                             ///< ready for new values before the last row
  [[nodiscard]] int type(int column) const;  ///< SQLITE_INTEGER, SQLITE_TEXT, SQLITE_BLOB ...
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] std::string text(int column) const;
  [[nodiscard]] Bytes blob(int column) const;
  [[nodiscard]] Bytes unpacked(int column) const;  ///< throws BadBytes

 private:
  Database& database_;
  std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement_;
};

class Database {
 public:
  enum class Access { kRead, kWrite, kCreate };
  Database(const std::filesystem::path& file, Access access);
  void run(const char* sql);
  [[nodiscard]] std::int64_t number(const char* sql);  ///< first column of the first row
  [[nodiscard]] sqlite3* get() const { return database_.get(); }
  /// Throws a StoreFailure unless `code` says that all is well.
  void check(int code) const;

 private:
  Access access_;
  std::unique_ptr<sqlite3, decltype(&sqlite3_close_v2)> database_;
};

/// Rolls back unless committed.
class Transaction {
 public:
  /// A writing one waits its turn at once instead of at its first change.
  Transaction(Database& database, bool writes);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

/// Runs `action`; its exceptions become errors that begin with the file.
template <typename Action>
auto guarded(const std::filesystem::path& file, core::ErrorKind kind, const Action& action)
    -> core::Result<decltype(action())> {
  try {
    if constexpr (std::is_void_v<decltype(action())>) {
      action();
      return {};
    } else {
      return action();
    }
  } catch (const StoreFailure& failure) {
    return core::failure(failure.kind, file.string() + ": " + failure.what());
  } catch (const BadBytes& bad) {
    return core::failure(kind, file.string() + ": damaged: " + bad.what() +
                                   "; use a copy of the file or map the recording again");
  }
}

}  // namespace plumbline::maps
