// SPDX-License-Identifier: BSD-3-Clause
#include "store/store_schema.hpp"

#include <algorithm>
#include <iterator>

#include "plumbline/core/git_lfs.hpp"
#include "store/store_codec.hpp"

namespace plumbline::maps {
namespace {

/// `changed`: the number of the transaction that last wrote the row. It stands before the content, so that
/// looking for it does not read that.
void create_table(Database& database, const RowTable& table) {
  const std::string name = table.name;
  const std::string columns = table.named ? " (key TEXT PRIMARY KEY, changed INTEGER NOT NULL, data NOT NULL)"
                                          : " (robot INTEGER NOT NULL, number INTEGER NOT NULL, changed "
                                            "INTEGER NOT NULL, data BLOB NOT NULL,"
                                            " PRIMARY KEY (robot, number))";
  database.run("CREATE TABLE " + name + columns);
}

/// One entry of the header.
template <typename Value>
void put_header(Database& database, std::int64_t transaction, const char* key, const Value& value) {
  Statement(database, "REPLACE INTO header VALUES (?, ?, ?)")
      .bind(1, std::string(key))
      .bind(2, transaction)
      .bind(3, value)
      .run();
}

std::string get_text(Database& database, const char* key) {
  Statement statement(database, "SELECT data FROM header WHERE key = ?");
  if (!statement.bind(1, std::string(key)).step()) throw BadBytes(std::string("its header has no ") + key);
  return statement.text(0);
}

}  // namespace

std::string index_of(const std::string& table) {
  const auto* found = std::find_if(std::begin(kRowTables), std::end(kRowTables),
                                   [&](const RowTable& t) { return table == t.name; });
  return std::to_string(std::distance(std::begin(kRowTables), found));
}

/// One table per kind of rows, with the transaction of the last change.
void create_tables(Database& database) {
  database.run("PRAGMA application_id = " + std::to_string(kStoreApplication));
  for (const RowTable& table : kRowTables) create_table(database, table);
  database.run(
      "CREATE TABLE seen (robot INTEGER NOT NULL, number INTEGER NOT NULL, data BLOB NOT NULL,"
      " PRIMARY KEY (robot, number))");
  database.run(
      "CREATE TABLE picture (robot INTEGER NOT NULL, number INTEGER NOT NULL, small BLOB NOT NULL,"
      " whole BLOB NOT NULL, PRIMARY KEY (robot, number))");
  database.run(
      "CREATE TABLE removed (place INTEGER NOT NULL, robot INTEGER NOT NULL, number INTEGER NOT NULL,"
      " changed INTEGER NOT NULL, PRIMARY KEY (place, robot, number))");
  database.run("PRAGMA user_version = " + std::to_string(kStoreFormat));
}

/// The header of a new store, as its first transaction.
void put_header(Database& database, const StoreHeader& header) {
  constexpr std::int64_t kFirst = 1;
  put_header(database, kFirst, "input", header.input);
  put_header(database, kFirst, "program", header.program_version);
  put_header(database, kFirst, "configuration", header.configuration);
  put_robots(database, kFirst, header.robots);
  put_camera_estimates(database, kFirst, header.robots);
  put_complete(database, kFirst, false);
}

void put_robots(Database& database, std::int64_t transaction, const std::vector<RobotInfo>& robots) {
  put_header(database, transaction, "robots", pack(encoded(robots)));
}

void put_camera_versions(Database& database, std::int64_t transaction, const std::vector<RobotInfo>& robots) {
  std::vector<CameraVersions> versions;
  versions.reserve(robots.size());
  for (const RobotInfo& robot : robots) versions.push_back({robot.number, robot.versions});
  put_header(database, transaction, "cameras", pack(encoded(versions)));
}

/// Estimates and standard deviations that differ from the defaults.
CameraEstimates estimates_of(const std::vector<RobotInfo>& robots) {
  CameraEstimates estimates;
  for (const RobotInfo& robot : robots) {
    if (robot.estimate) estimates.each.emplace_back(robot.number, *robot.estimate);
    if (encoded(robot.camera.sigma) != encoded(sensor::CameraSigma()))
      estimates.told.emplace_back(robot.number, robot.camera.sigma);
  }
  return estimates;
}

void put_camera_estimates(Database& database, std::int64_t transaction,
                          const std::vector<RobotInfo>& robots) {
  const CameraEstimates estimates = estimates_of(robots);
  if (!estimates.each.empty() || !estimates.told.empty())
    put_header(database, transaction, "estimates", pack(encoded(estimates)));
}

void put_complete(Database& database, std::int64_t transaction, bool complete) {
  put_header(database, transaction, "complete", std::int64_t{complete ? 1 : 0});
}

/// The last transaction of each stream.
StoreHeads read_heads(Database& database) {
  StoreHeads heads;
  const auto last = [&](const std::string& table, const std::string& where) {
    return database.number(("SELECT max(changed) FROM " + table + where).c_str());
  };
  for (const RowTable& table : kRowTables) {
    std::int64_t& head = heads[table.stream];
    head = std::max(head, last(table.name, ""));
  }
  heads.map = std::max(heads.map, last("removed", ""));  // clouds are never removed
  return heads;
}

bool is_blank(Database& database) {
  return database.number("PRAGMA application_id") == 0 &&
         database.number("SELECT count(*) FROM sqlite_master") == 0;
}

void check_store(Database& database) {
  // An empty file: its run was killed early
  const std::int64_t application = database.number("PRAGMA application_id");
  if (is_blank(database)) {
    throw StoreFailure(core::ErrorKind::kInput,
                       "holds nothing: the run that made it ended before it began; map the recording again");
  }

  // Other programs use SQLite too
  if (application != kStoreApplication) {
    throw StoreFailure(core::ErrorKind::kInput,
                       "is an SQLite file, but not a map store; give the map.db of a result folder");
  }

  // Newer formats need a newer program
  const std::int64_t format = database.number("PRAGMA user_version");
  if (format > kStoreFormat) {
    throw StoreFailure(core::ErrorKind::kInput, "is a map store of format " + std::to_string(format) +
                                                    ", this program reads up to " +
                                                    std::to_string(kStoreFormat) + "; use a newer Plumbline");
  }

  // Older formats are not converted
  if (format < 1) throw BadBytes("its format number is wrong");
  if (format < kStoreFormat) {
    throw StoreFailure(core::ErrorKind::kInput, "is a map store of format " + std::to_string(format) +
                                                    " by an older Plumbline, this program reads format " +
                                                    std::to_string(kStoreFormat) +
                                                    "; map the recording again");
  }
}

StoreHeader read_header(Database& database) {
  // Texts of the run
  StoreHeader header;
  header.input = get_text(database, "input");
  header.program_version = get_text(database, "program");
  header.configuration = get_text(database, "configuration");
  header.format = static_cast<int>(database.number("PRAGMA user_version"));

  // Every store has at least one robot
  Statement robots(database, "SELECT data FROM header WHERE key = 'robots'");
  if (!robots.step()) throw BadBytes("its header has no robots");
  header.robots = decode<std::vector<RobotInfo>>(robots.unpacked(0));
  const auto each = [&header](std::int32_t number, const auto& set) {
    for (RobotInfo& robot : header.robots) {
      if (robot.number == number) set(robot);
    }
  };

  // Cameras that were refined during the run
  Statement cameras(database, "SELECT data FROM header WHERE key = 'cameras'");
  if (cameras.step()) {
    for (const CameraVersions& of : decode<std::vector<CameraVersions>>(cameras.unpacked(0)))
      each(of.robot, [&of](RobotInfo& robot) { robot.versions = of.versions; });
  }

  // Estimates and standard deviations, by robot
  Statement estimates(database, "SELECT data FROM header WHERE key = 'estimates'");
  if (estimates.step()) {
    const auto all = decode<CameraEstimates>(estimates.unpacked(0));
    for (const auto& of : all.each) each(of.first, [&of](RobotInfo& robot) { robot.estimate = of.second; });

    // Standard deviations hold for all versions
    for (const auto& of : all.told) {
      each(of.first, [&of](RobotInfo& robot) {
        robot.camera.sigma = of.second;
        for (CameraVersion& version : robot.versions) version.camera.sigma = of.second;
        if (robot.estimate) robot.estimate->found.sigma = of.second;
      });
    }
  }
  return header;
}

void put_result_frame(Database& database, std::int64_t transaction, const ResultFrame& frame) {
  put_header(database, transaction, "result", pack(encoded(frame)));
}

ResultFrame read_result_frame(Database& database) {
  Statement statement(database, "SELECT data FROM header WHERE key = 'result'");
  return statement.step() ? decode<ResultFrame>(statement.unpacked(0)) : ResultFrame();
}

/// A file that can be a store, else a reason for the user.
void check_file(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    throw StoreFailure(core::ErrorKind::kInput, "no such file; give the map.db of a result folder");
  }
  if (!std::filesystem::is_regular_file(file, ignored)) {
    throw StoreFailure(core::ErrorKind::kInput, "is not a file; give the map.db of a result folder");
  }
  if (core::is_lfs_pointer(file)) throw StoreFailure(core::ErrorKind::kInput, core::kLfsPointer);
  constexpr std::uintmax_t kHeaderBytes = 100;  // of any SQLite file; a shorter one opens as an empty one
  const std::uintmax_t bytes = std::filesystem::file_size(file, ignored);
  if (bytes > 0 && bytes < kHeaderBytes) throw BadBytes("it ends before its header does");
}

}  // namespace plumbline::maps
