// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A network.db as a killed process leaves it in the middle of a transaction.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <string>

namespace plumbline::tests {

/// Copies a database while a transaction has changed its file, and the journal that leads back.
inline void copy_with_hot_journal(const std::filesystem::path& from, const std::filesystem::path& to) {
  sqlite3* writer = nullptr;
  ASSERT_EQ(sqlite3_open(from.c_str(), &writer), SQLITE_OK);
  const char* const many =  // more than fits into the cache, so that it goes to the file before the commit
      "PRAGMA cache_size = 1; BEGIN IMMEDIATE; UPDATE text SET value = 'half';"
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 500)"
      "INSERT INTO text SELECT 'extra' || i, hex(randomblob(100)) FROM n;";
  ASSERT_EQ(sqlite3_exec(writer, many, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(writer);

  std::filesystem::copy_file(from, to);
  std::filesystem::copy_file(from.string() + "-journal", to.string() + "-journal");
  EXPECT_GT(std::filesystem::file_size(to.string() + "-journal"), 512U);
  EXPECT_EQ(sqlite3_exec(writer, "ROLLBACK", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(writer);
}

}  // namespace plumbline::tests
