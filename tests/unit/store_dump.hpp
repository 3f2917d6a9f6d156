// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A store's rows as they are, to hold two stores against each other.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <string>
#include <vector>

namespace plumbline::tests {

/// All tables with all their rows, as text; but what a robot keeps for itself, which no copy has.
inline std::vector<std::string> dump(const std::filesystem::path& file) {
  std::vector<std::string> lines;
  sqlite3* database = nullptr;
  EXPECT_EQ(sqlite3_open_v2(file.c_str(), &database, SQLITE_OPEN_READONLY, nullptr), SQLITE_OK);
  const auto rows = [&](const std::string& sql, const auto& take) {
    sqlite3_stmt* statement = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr), SQLITE_OK) << sql;
    while (sqlite3_step(statement) == SQLITE_ROW) take(statement);
    sqlite3_finalize(statement);
  };
  std::vector<std::string> tables;
  rows(
      "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT IN ('seen', 'picture') "
      "ORDER BY name",
      [&](sqlite3_stmt* s) {
        tables.emplace_back(reinterpret_cast<const char*>(sqlite3_column_text(s, 0)));
      });
  for (const std::string& table : tables) {
    rows("SELECT * FROM " + table + " ORDER BY 1, 2, 3", [&](sqlite3_stmt* s) {
      std::string line = table;
      for (int c = 0; c < sqlite3_column_count(s); ++c) {
        const auto* data = static_cast<const char*>(sqlite3_column_blob(s, c));
        line += "|" + std::to_string(sqlite3_column_type(s, c)) + ":";
        if (data != nullptr) line.append(data, static_cast<std::size_t>(sqlite3_column_bytes(s, c)));
      }
      lines.push_back(line);
    });
  }
  sqlite3_close(database);
  return lines;
}

}  // namespace plumbline::tests
