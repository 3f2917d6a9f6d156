// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Tables of the map store; docs/reference/store.md describes them.
#include <filesystem>

#include "plumbline/maps/store.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "store/store_codec.hpp"
#include "store/store_sqlite.hpp"

namespace plumbline::maps {

constexpr std::int64_t kStoreApplication = 0x504c4d53;  ///< "PLMS", in the head of the SQLite file

/// A table of rows; all have a column `changed`, the number of the transaction that last wrote the row.
struct RowTable {
  const char* name;
  StoreShare share;
  bool named;  ///< rows have a text `key` instead of `robot` and `number`
};
/// Messages name a table by its place here, and hold rows in this order.
constexpr RowTable kRowTables[] = {
    {"header", StoreShare::kMap, true},
    {"map", StoreShare::kMap, false},
    {"keyframe", StoreShare::kMap, false},
    {"state", StoreShare::kMap, false},
    {"point", StoreShare::kMap, false},
    {"line", StoreShare::kMap, false},
    {"edge", StoreShare::kMap, false},
    {"frame", StoreShare::kMap, false},
    {"log", StoreShare::kMap, false},
    {"attachment", StoreShare::kMap, true},
    {"surface", StoreShare::kClouds, false},
    {"cloud", StoreShare::kClouds, false},
    {"frame_cloud", StoreShare::kClouds, false},
};

/// The place of a table in kRowTables, as the table `removed` names it.
std::string place_of(const std::string& table);
/// Empty ones.
void create_tables(Database& database);
/// Of a new store: its first transaction.
void put_header(Database& database, const StoreHeader& header);
/// The last transactions that wrote or removed a row.
StoreHeads read_heads(Database& database);
/// Nothing was ever committed.
bool is_blank(Database& database);
/// Throws a StoreFailure for a foreign, unfinished, older or newer file.
void check_store(Database& database);
StoreHeader read_header(Database& database);
void put_robots(Database& database, std::int64_t transaction, const std::vector<RobotInfo>& robots);
/// What the robots' cameras turned out to be.
void put_camera_versions(Database& database, std::int64_t transaction, const std::vector<RobotInfo>& robots);
void put_complete(Database& database, std::int64_t transaction, bool complete);
void put_result_frame(Database& database, std::int64_t transaction, const ResultFrame& frame);
/// The map's own frame when none was put.
ResultFrame read_result_frame(Database& database);
/// Refuses what is no file before SQLite does with fewer words.
void check_file(const std::filesystem::path& file);

}  // namespace plumbline::maps
