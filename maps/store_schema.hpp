// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Tables of the map store; docs/store.md describes them.
#include <filesystem>

#include "plumbline/maps/store.hpp"
#include "store_sqlite.hpp"

namespace plumbline::maps {

constexpr std::int64_t kStoreApplication = 0x504c4d53;  ///< "PLMS", in the head of the SQLite file

void create_tables(Database& database, const StoreHeader& header);
/// Nothing was ever committed.
bool is_blank(Database& database);
/// Throws a StoreFailure for a foreign, unfinished, older or newer file.
void check_store(Database& database);
StoreHeader read_header(Database& database);
void put_result_frame(Database& database, const ResultFrame& frame);
/// The map's own frame when none was put.
ResultFrame read_result_frame(Database& database);
/// Loops that were closed, encoded; a store that was made before they were kept has none.
Bytes read_loops(Database& database);
void put_loops(Database& database, const Bytes& loops);
/// The lines of the table log.
std::vector<std::string> read_log(Database& database);
/// Refuses what is no file before SQLite does with fewer words.
void check_file(const std::filesystem::path& file);

}  // namespace plumbline::maps
