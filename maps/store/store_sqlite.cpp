// SPDX-License-Identifier: BSD-3-Clause
#include "store/store_sqlite.hpp"

#include <cerrno>
#include <system_error>

#include "plumbline/core/shortage.hpp"

namespace plumbline::maps {
namespace {

constexpr int kPatienceMs = 3000;

/// The shortage that made SQLite fail; "": something else was wrong.
std::string shortage_of(const SQLite::Exception& error) {
  const int code = error.getErrorCode() & 0xff;
  if (code == SQLITE_NOMEM || error.getExtendedErrorCode() == SQLITE_IOERR_NOMEM)
    return core::shortage_of(ENOMEM);
  const bool open = code == SQLITE_CANTOPEN || code == SQLITE_IOERR;
  return open && core::files_are_short() ? core::shortage_of(EMFILE) : "";
}

/// Rolls back what a killed writer had not committed: SQLite does so when a file is first read, but only if
/// it is open for writing. Without a journal that is not needed, and readers change nothing.
void roll_back_journal(const std::string& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file + "-journal", ignored)) return;
  try {
    SQLite::Database database(file, SQLITE_OPEN_READWRITE | SQLITE_OPEN_FULLMUTEX, kPatienceMs);
    SQLite::Statement(database, "SELECT count(*) FROM sqlite_master").executeStep();
  } catch (const SQLite::Exception&) {
    return;  // reading the file tells why
  }
}

/// With a mutex, because several threads read clouds. An absolute path is never read as a URI or an option.
SQLite::Database opened(const std::filesystem::path& file, Database::Access access) {
  try {
    const std::string path = std::filesystem::absolute(file).string();
    if (access == Database::Access::kRead) roll_back_journal(path);
    return SQLite::Database(path, static_cast<int>(access) | SQLITE_OPEN_FULLMUTEX, kPatienceMs);
  } catch (const SQLite::Exception& error) {
    const std::string why = error.getErrorStr();
    if (const std::string shortage = shortage_of(error); !shortage.empty())
      throw StoreFailure(core::ErrorKind::kOutput, "cannot be opened: " + shortage);
    if (access != Database::Access::kCreate) {
      throw StoreFailure(core::ErrorKind::kInput,
                         "cannot be opened (" + why + "); check path and permissions");
    }
    throw StoreFailure(core::ErrorKind::kOutput,
                       "cannot be made (" + why + "); check folder and permissions");
  }
}

std::string remedy_of(int code) {
  switch (code & 0xff) {
    case SQLITE_FULL:
      return "the disk is full; what was stored before is safe: free some space and continue";
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
      return "cannot be read or written; what was stored before is safe: check disk, folder and permissions";
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return "may not be written; check the permissions of the file and its folder";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "is in use by another program; wait until that is done";
    case SQLITE_NOTADB:
      return "is not a map store; give the map.db of a result folder";
    default:
      return "damaged; use a copy of the file or map the recording again";
  }
}

}  // namespace

StoreFailure failure_of(const SQLite::Exception& error, core::ErrorKind kind) {
  if (const std::string shortage = shortage_of(error); !shortage.empty())
    return {core::ErrorKind::kOutput, shortage + " (SQLite: " + error.what() + ")"};
  const int code = error.getErrorCode() & 0xff;
  const bool content = code == SQLITE_NOTADB || code == SQLITE_CORRUPT;
  return {content ? core::ErrorKind::kInput : kind, remedy_of(code) + " (SQLite: " + error.what() + ")"};
}

Database::Database(const std::filesystem::path& file, Access access)
    : SQLite::Database(opened(file, access)) {}

std::int64_t Database::number(const std::string& sql) {
  Statement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

/// True if a row was read; resets after the last and after an error.
bool Statement::step() {
  try {
    if (executeStep()) return true;
  } catch (const SQLite::Exception&) {
    tryReset();
    throw;
  }
  reset();
  return false;
}

Bytes Statement::blob(int column) const {
  const SQLite::Column value = getColumn(column);
  const auto* begin = static_cast<const std::uint8_t*>(value.getBlob());
  return begin == nullptr ? Bytes() : Bytes(begin, begin + value.getBytes());
}

Bytes Statement::unpacked(int column) const {
  const SQLite::Column value = getColumn(column);
  const auto* begin = static_cast<const std::uint8_t*>(value.getBlob());
  if (begin == nullptr) throw BadBytes("its bytes are missing");
  return unpack(begin, static_cast<std::size_t>(value.getBytes()));
}

/// Calls `row` in order of robot and number; damage names its row.
void each_row(Database& database, const std::string& table,
              const std::function<void(std::int64_t, std::int64_t, const Bytes&)>& row) {
  Statement rows(database, ("SELECT robot, number, data FROM " + table + " ORDER BY robot, number").c_str());
  while (rows.step()) {
    const std::int64_t robot = rows.integer(0);
    const std::int64_t number = rows.integer(1);
    try {
      row(robot, number, rows.unpacked(2));
    } catch (const BadBytes& bad) {
      throw BadBytes(table + " " + std::to_string(robot) + "/" + std::to_string(number) + ": " + bad.what());
    }
  }
}

}  // namespace plumbline::maps
