// SPDX-License-Identifier: BSD-3-Clause
#include <system_error>

#include "plumbline/maps/store_replica.hpp"
#include "store/store_schema.hpp"
#include "store/store_sqlite.hpp"

namespace plumbline::maps {
namespace {

using core::ErrorKind;

constexpr std::int64_t kLedgerApplication = 0x504c4e57;  // "PLNW", in the head of the SQLite file

void check_ledger(Database& database) {
  if (database.number("PRAGMA application_id") != kLedgerApplication) {
    throw StoreFailure(ErrorKind::kInput, "is not a network.db of Plumbline; move it away");
  }
}

}  // namespace

/// All texts; none if the file does not exist yet.
core::Result<std::map<std::string, std::string>> Ledger::all() const {
  std::map<std::string, std::string> texts;
  std::error_code ignored;
  if (!std::filesystem::exists(file_, ignored)) return texts;
  return guarded(file_, ErrorKind::kInput, [&] {
    Database database(file_, Database::Access::kRead);
    if (is_blank(database)) return texts;  // its writer was killed before the first commit
    check_ledger(database);
    Statement rows(database, "SELECT name, value FROM text");
    while (rows.step()) texts.emplace(rows.text(0), rows.text(1));
    return texts;
  });
}

/// Stores the texts durably, in one transaction.
core::Result<void> Ledger::put(const std::map<std::string, std::string>& texts) const {
  return guarded(file_, ErrorKind::kOutput, [&] {
    Database database(file_, Database::Access::kCreate);
    database.run("PRAGMA synchronous = FULL");
    Transaction whole(database, true);
    if (database.number("SELECT count(*) FROM sqlite_master") == 0) {
      database.run("PRAGMA application_id = " + std::to_string(kLedgerApplication));
      database.run("CREATE TABLE text (name TEXT PRIMARY KEY, value TEXT NOT NULL)");
    }
    check_ledger(database);
    Statement put(database, "REPLACE INTO text VALUES (?, ?)");
    for (const auto& [name, value] : texts) put.bind(1, name).bind(2, value).run();
    whole.commit();
  });
}

}  // namespace plumbline::maps
