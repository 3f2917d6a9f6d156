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
  StoreStream stream;
  bool named;  ///< rows have a text `key` instead of `robot` and `number`
};
/// Messages name a table by its index here, and hold rows in this order.
constexpr RowTable kRowTables[] = {
    {"header", StoreStream::kMap, true},
    {"map", StoreStream::kMap, false},
    {"keyframe", StoreStream::kMap, false},
    {"state", StoreStream::kMap, false},
    {"point", StoreStream::kMap, false},
    {"line", StoreStream::kMap, false},
    {"edge", StoreStream::kMap, false},
    {"frame", StoreStream::kMap, false},
    {"log", StoreStream::kMap, false},
    {"attachment", StoreStream::kMap, true},
    {"surface", StoreStream::kClouds, false},
    {"cloud", StoreStream::kClouds, false},
    {"frame_cloud", StoreStream::kClouds, false},
};

/// Index of a table in kRowTables as text; the column `place` of the table `removed` holds it.
std::string index_of(const std::string& table);
/// Creates all tables, empty.
void create_tables(Database& database);
/// Writes the header of a new store, its first transaction.
void put_header(Database& database, const StoreHeader& header);
/// Numbers of the last transactions that wrote or removed a row.
StoreHeads read_heads(Database& database);
/// True if nothing was ever committed.
bool is_blank(Database& database);
/// Throws a StoreFailure for a foreign, unfinished, older or newer file.
void check_store(Database& database);
StoreHeader read_header(Database& database);
void put_robots(Database& database, std::int64_t transaction, const std::vector<RobotInfo>& robots);
/// Stores the robots' refined cameras.
void put_camera_versions(Database& database, std::int64_t transaction, const std::vector<RobotInfo>& robots);
/// Stores what is known of the robots' cameras; no row without robots of which something is.
void put_camera_estimates(Database& database, std::int64_t transaction, const std::vector<RobotInfo>& robots);
CameraEstimates estimates_of(const std::vector<RobotInfo>& robots);
void put_complete(Database& database, std::int64_t transaction, bool complete);
void put_result_frame(Database& database, std::int64_t transaction, const ResultFrame& frame);
/// The map's own frame if none was stored.
ResultFrame read_result_frame(Database& database);
/// Refuses a path that is not a file, with a better message than SQLite's.
void check_file(const std::filesystem::path& file);

}  // namespace plumbline::maps
