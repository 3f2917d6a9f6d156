// SPDX-License-Identifier: BSD-3-Clause
#include "store_sqlite.hpp"

#include <limits>

namespace plumbline::maps {
namespace {

int flags_of(Database::Access access) {
  switch (access) {
    case Database::Access::kRead:
      return SQLITE_OPEN_READONLY;
    case Database::Access::kWrite:
      return SQLITE_OPEN_READWRITE;
    case Database::Access::kCreate:
      break;
  }
  return SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
}

sqlite3* open(const std::filesystem::path& file, Database::Access access) {
  sqlite3* database = nullptr;
  // An absolute path is never taken for a URI or for an option.
  const std::string path = std::filesystem::absolute(file).string();
  // With a mutex: clouds are read by several threads.
  const int code =
      sqlite3_open_v2(path.c_str(), &database, flags_of(access) | SQLITE_OPEN_FULLMUTEX, nullptr);
  if (code == SQLITE_OK) return database;
  const std::string why = sqlite3_errstr(code);
  sqlite3_close_v2(database);
  if (access == Database::Access::kCreate) {
    throw StoreFailure(core::ErrorKind::kOutput,
                       "cannot be made (" + why + "); check folder and permissions");
  }
  throw StoreFailure(core::ErrorKind::kInput, "cannot be opened (" + why + "); check path and permissions");
}

std::string remedy_of(int code) {
  switch (code & 0xff) {
    case SQLITE_FULL:
      return "the disk is full; what was stored before is safe: free some space and go on from there";
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
      return "is no map store; give the map.db of a result folder";
    default:
      return "damaged; use a copy of the file or map the recording again";
  }
}

}  // namespace

Statement::Statement(Database& database, const char* sql)
    : database_(database), statement_(nullptr, &sqlite3_finalize) {
  sqlite3_stmt* statement = nullptr;
  database_.check(sqlite3_prepare_v2(database_.get(), sql, -1, &statement, nullptr));
  statement_.reset(statement);
}
Statement& Statement::bind(int place, std::int64_t value) {
  database_.check(sqlite3_bind_int64(statement_.get(), place, value));
  return *this;
}
Statement& Statement::bind(int place, const std::string& text) {
  database_.check(
      sqlite3_bind_text64(statement_.get(), place, text.c_str(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}
Statement& Statement::bind(int place, const Bytes& blob) {
  static const std::uint8_t kNothing = 0;  // a null pointer would be NULL instead of an empty blob
  database_.check(sqlite3_bind_blob64(statement_.get(), place, blob.empty() ? &kNothing : blob.data(),
                                      blob.size(), SQLITE_STATIC));
  return *this;
}
bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) {
    const StoreFailure failure = [&] {
      try {
        database_.check(code);
      } catch (const StoreFailure& f) {
        return f;
      }
      return StoreFailure(core::ErrorKind::kInternal, "SQLite gives no reason");
    }();
    sqlite3_reset(statement_.get());
    throw failure;
  }
  sqlite3_reset(statement_.get());
  return false;
}
void Statement::run() {
  while (step()) {
  }
}
void Statement::rewind() { sqlite3_reset(statement_.get()); }
int Statement::type(int column) const { return sqlite3_column_type(statement_.get(), column); }
std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }
std::string Statement::text(int column) const {
  const auto* begin =
      static_cast<const char*>(static_cast<const void*>(sqlite3_column_text(statement_.get(), column)));
  return begin == nullptr
             ? std::string()
             : std::string(begin, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column)));
}
Bytes Statement::blob(int column) const {
  const auto* begin = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  if (begin == nullptr) return {};
  return {begin, begin + sqlite3_column_bytes(statement_.get(), column)};
}
Bytes Statement::unpacked(int column) const {
  const auto* begin = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  if (begin == nullptr) throw BadBytes("its bytes are missing");
  return unpack(begin, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column)));
}

Database::Database(const std::filesystem::path& file, Access access)
    : access_(access), database_(open(file, access), &sqlite3_close_v2) {
  constexpr int kPatienceMs = 3000;
  sqlite3_busy_timeout(database_.get(), kPatienceMs);
}
void Database::check(int code) const {
  if (code == SQLITE_OK) return;
  const bool content = (code & 0xff) == SQLITE_NOTADB || (code & 0xff) == SQLITE_CORRUPT;
  throw StoreFailure(access_ == Access::kRead || content ? core::ErrorKind::kInput : core::ErrorKind::kOutput,
                     remedy_of(code) + " (SQLite: " + sqlite3_errmsg(database_.get()) + ")");
}
void Database::run(const char* sql) { check(sqlite3_exec(get(), sql, nullptr, nullptr, nullptr)); }
std::int64_t Database::number(const char* sql) {
  Statement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

Transaction::Transaction(Database& database, bool writes) : database_(database) {
  database_.run(writes ? "BEGIN IMMEDIATE" : "BEGIN");
}
Transaction::~Transaction() {
  if (open_) sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
}
void Transaction::commit() {
  database_.run("COMMIT");
  open_ = false;
}

}  // namespace plumbline::maps
