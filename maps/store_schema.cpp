// SPDX-License-Identifier: BSD-3-Clause
#include "store_schema.hpp"

#include <utility>

#include "store_codec.hpp"

namespace plumbline::maps {
namespace {

constexpr const char* kTables[] = {"keyframe", "state", "point", "line",    "edge",
                                   "frame",    "log",   "cloud", "surface", "frame_cloud"};

void create_table(Database& database, const char* name) {
  database.run((std::string("CREATE TABLE ") + name +
                " (robot INTEGER NOT NULL, number INTEGER NOT NULL, data BLOB NOT NULL,"
                " PRIMARY KEY (robot, number))")
                   .c_str());
}

void put_text(Database& database, const char* key, const std::string& text) {
  Statement(database, "INSERT INTO header VALUES (?, ?)").bind(1, std::string(key)).bind(2, text).run();
}

std::string get_text(Database& database, const char* key) {
  Statement statement(database, "SELECT value FROM header WHERE key = ?");
  if (!statement.bind(1, std::string(key)).step()) throw BadBytes(std::string("its header has no ") + key);
  return statement.text(0);
}

}  // namespace

void create_tables(Database& database, const StoreHeader& header) {
  database.run(("PRAGMA application_id = " + std::to_string(kStoreApplication)).c_str());
  database.run("CREATE TABLE header (key TEXT PRIMARY KEY, value NOT NULL)");
  database.run("CREATE TABLE attachment (name TEXT PRIMARY KEY, data BLOB NOT NULL)");
  for (const char* table : kTables) create_table(database, table);
  database.run(("PRAGMA user_version = " + std::to_string(kStoreFormat)).c_str());
  put_text(database, "robot", header.robot);
  put_text(database, "input", header.input);
  put_text(database, "program", header.program_version);
  put_text(database, "configuration", header.configuration);
  ByteWriter camera;
  encode(header.camera, camera);
  const Bytes packed = pack(camera.bytes());
  Statement(database, "INSERT INTO header VALUES ('camera', ?)").bind(1, packed).run();
}

bool is_blank(Database& database) {
  return database.number("PRAGMA application_id") == 0 &&
         database.number("SELECT count(*) FROM sqlite_master") == 0;
}

void check_store(Database& database) {
  const std::int64_t application = database.number("PRAGMA application_id");
  if (is_blank(database)) {
    throw StoreFailure(core::ErrorKind::kInput,
                       "holds nothing: the run that made it ended before it began; map the recording again");
  }
  if (application != kStoreApplication) {
    throw StoreFailure(core::ErrorKind::kInput,
                       "is an SQLite file, but no map store; give the map.db of a result folder");
  }
  const std::int64_t format = database.number("PRAGMA user_version");
  if (format > kStoreFormat) {
    throw StoreFailure(core::ErrorKind::kInput, "is a map store of format " + std::to_string(format) +
                                                    ", this program reads up to " +
                                                    std::to_string(kStoreFormat) + "; use a newer Plumbline");
  }
  if (format < 1) throw BadBytes("its format number is wrong");
  if (format < kStoreFormat) {
    throw StoreFailure(core::ErrorKind::kInput, "is a map store of format " + std::to_string(format) +
                                                    " by an older Plumbline, this program reads format " +
                                                    std::to_string(kStoreFormat) +
                                                    "; map the recording again");
  }
}

StoreHeader read_header(Database& database) {
  StoreHeader header;
  header.robot = get_text(database, "robot");
  header.input = get_text(database, "input");
  header.program_version = get_text(database, "program");
  header.configuration = get_text(database, "configuration");
  header.format = static_cast<int>(database.number("PRAGMA user_version"));
  Statement camera(database, "SELECT value FROM header WHERE key = 'camera'");
  if (!camera.step()) throw BadBytes("its header has no camera");
  header.camera = decode_camera(camera.unpacked(0));
  return header;
}

void put_result_frame(Database& database, const ResultFrame& frame) {
  ByteWriter bytes;
  bytes.put(frame.output_from_map);
  bytes.flag(frame.upright);
  const Bytes packed = pack(bytes.bytes());
  Statement(database, "REPLACE INTO header VALUES ('result', ?)").bind(1, packed).run();
}

ResultFrame read_result_frame(Database& database) {
  ResultFrame frame;
  Statement statement(database, "SELECT value FROM header WHERE key = 'result'");
  if (!statement.step()) return frame;
  const Bytes bytes = statement.unpacked(0);
  ByteReader from(bytes);
  from.get(frame.output_from_map);
  frame.upright = from.flag();
  from.expect_end();
  return frame;
}

Bytes read_loops(Database& database) {
  Statement statement(database, "SELECT value FROM header WHERE key = 'loops'");
  return statement.step() ? statement.unpacked(0) : Bytes{};
}

void put_loops(Database& database, const Bytes& loops) {
  const Bytes packed = pack(loops);
  Statement(database, "REPLACE INTO header VALUES ('loops', ?)").bind(1, packed).run();
}

std::vector<std::string> read_log(Database& database) {
  std::vector<std::string> lines;
  Statement rows(database, "SELECT data FROM log ORDER BY robot, number");
  while (rows.step()) {
    const Bytes bytes = rows.unpacked(0);
    for (ByteReader from(bytes); !from.at_end();) from.get(lines.emplace_back());
  }
  return lines;
}

void check_file(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    throw StoreFailure(core::ErrorKind::kInput, "no such file; give the map.db of a result folder");
  }
  if (!std::filesystem::is_regular_file(file, ignored)) {
    throw StoreFailure(core::ErrorKind::kInput, "is no file; give the map.db of a result folder");
  }
}

}  // namespace plumbline::maps
