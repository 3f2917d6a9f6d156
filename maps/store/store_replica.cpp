// SPDX-License-Identifier: BSD-3-Clause
// Writes the rows of a store's copy.
#include "plumbline/maps/store_replica.hpp"

#include <exception>
#include <optional>
#include <system_error>
#include <utility>

#include "plumbline/maps/store.hpp"
#include "store/map_rows.hpp"
#include "store/store_row.hpp"

namespace plumbline::maps {
namespace {

using core::ErrorKind;

std::vector<RobotInfo> read_robots(Database& database) {
  Statement robots(database, "SELECT data FROM header WHERE key = 'robots'");
  return robots.step() ? decode<std::vector<RobotInfo>>(robots.unpacked(0)) : std::vector<RobotInfo>();
}

int type_of(const RowTable& table, const std::string& key) {
  if (std::string(table.name) != "header") return SQLITE_BLOB;
  if (key == "complete") return SQLITE_INTEGER;
  const bool text = key == "input" || key == "program" || key == "configuration";
  return text ? SQLITE_TEXT : SQLITE_BLOB;
}

std::unique_ptr<Database> open_database(const std::filesystem::path& file) {
  std::error_code ignored;
  const bool fresh = !std::filesystem::exists(file, ignored);
  auto database =
      std::make_unique<Database>(file, fresh ? Database::Access::kCreate : Database::Access::kWrite);
  if (fresh || is_blank(*database)) {
    database->run("PRAGMA page_size = 8192");
    database->run("PRAGMA journal_mode = WAL");
    Transaction whole(*database, true);
    create_tables(*database);
    whole.commit();
  }
  check_store(*database);
  database->run("PRAGMA journal_mode = WAL");
  // An acknowledged row may exist nowhere else: it must survive a power cut, too.
  database->run("PRAGMA synchronous = FULL");
  return database;
}

}  // namespace

struct StoreReplica::Impl {
  Impl(std::filesystem::path path, std::unique_ptr<Database> opened)
      : file(std::move(path)), database(std::move(opened)) {
    reread();
    read_map();
  }
  /// Rows of a damaged file are an error only for those who need its map.
  void read_map() {
    map = std::make_shared<GrowingMap>();
    try {
      map->robots = read_robots(*database);
      map->rows = MapRows::read(*database, map->robots);
    } catch (const std::exception& bad) {  // BadBytes, or SQLite's
      map->damage = bad.what();
    }
    map->head = heads.map;
  }
  void reread() {
    heads = read_heads(*database);
    keyframes = static_cast<std::size_t>(database->number("SELECT count(*) FROM keyframe"));
    complete = database->number("SELECT data FROM header WHERE key = 'complete'") == 1;
  }
  /// Forgets the transaction: rolled back, unless it was committed.
  void end_transaction() {
    open.reset();
    partial_row.clear();
    pending = {};
    changes.clear();
    robots = map->robots;
  }
  void apply_row(const StoreRow& row);
  void put(const RowTable& table, const StoreRow& row);
  void apply_changes();
  void count(const RowTable& table, std::size_t size);
  /// Runs `action`; the transaction ends if it fails.
  template <typename Action>
  core::Result<void> guard(const Action& action) {
    core::Result<void> done = guarded(file, ErrorKind::kOutput, action);
    if (!done) end_transaction();
    return done;
  }

  std::filesystem::path file;
  std::unique_ptr<Database> database;
  StoreHeads heads;
  std::size_t keyframes = 0;
  bool complete = false;
  ReplicaBytes bytes;
  std::shared_ptr<GrowingMap> map = std::make_shared<GrowingMap>();  ///< of what is committed
  // The open transaction:
  std::unique_ptr<Transaction> open;
  StoreStream stream = StoreStream::kMap;
  std::int64_t number = 0;
  Bytes partial_row;     ///< beginning of a row whose end has not been received
  ReplicaBytes pending;  ///< received so far
  std::vector<RobotInfo> robots;
  /// A row of the map that was written or, without content, removed.
  struct Change {
    RowName name;
    std::optional<RowContent> content;
  };
  std::vector<Change> changes;
};

/// Received bytes by kind: clouds, poses, everything else.
void StoreReplica::Impl::count(const RowTable& table, std::size_t size) {
  const std::string name = table.name;
  if (table.stream == StoreStream::kClouds) {
    pending.cloud += size;
  } else if (name == "keyframe" || name == "state") {
    pending.place += size;
  } else {
    pending.map += size;
  }
}

/// Writes the row as its sender stored it, under this transaction.
void StoreReplica::Impl::put(const RowTable& table, const StoreRow& row) {
  const std::string name = table.name;
  Statement put(
      *database,
      ("REPLACE INTO " + name + (table.named ? " VALUES (?, ?, ?)" : " VALUES (?, ?, ?, ?)")).c_str());
  int column = 1;
  if (table.named) {
    put.bind(column++, row.name.key);
  } else {
    put.bind(column++, row.name.robot);
    put.bind(column++, row.name.number);
  }
  put.bind(column++, number);
  if (row.type == SQLITE_INTEGER) put.bind(column, row.integer);
  if (row.type == SQLITE_TEXT) put.bind(column, row.text);
  if (row.type == SQLITE_BLOB) put.bind(column, row.data);
  put.run();
}

void StoreReplica::Impl::apply_row(const StoreRow& row) {
  // Messages name table and key
  const RowTable& table = kRowTables[row.name.table];
  const std::string where =
      std::string(table.name) + " " +
      (table.named ? row.name.key : std::to_string(row.name.robot) + "/" + std::to_string(row.name.number));

  // Refused before anything is written
  try {
    if (table.stream != stream) throw BadBytes("it belongs to the other stream");
    if (row.removed) {
      if (table.named) throw BadBytes("rows of this table stay");
      check_name(row.name);
      changes.push_back({row.name, std::nullopt});

    } else {
      if (row.type != type_of(table, row.name.key)) throw BadBytes("its content has the wrong type");
      changes.push_back({row.name, check_row(row.name, row.data, robots)});
    }

  } catch (const BadBytes& bad) {
    throw BadBytes(where + ": " + bad.what());
  }

  // Named rows have no tombstones
  if (table.named) return put(table, row);

  // A row and its tombstone exclude each other
  const auto by_key = [&](const char* sql, const std::string& name) {
    Statement(*database, (sql + name + " AND robot = ? AND number = ?").c_str())
        .bind(1, row.name.robot)
        .bind(2, row.name.number)
        .run();
  };
  const std::string index = std::to_string(row.name.table);

  // A row that returns loses its tombstone
  if (!row.removed) {
    by_key("DELETE FROM removed WHERE place = ", index);
    return put(table, row);
  }

  // The tombstone reports the removal to other replicas
  by_key("DELETE FROM ", std::string(table.name) + " WHERE 1");
  Statement(*database, "REPLACE INTO removed VALUES (?, ?, ?, ?)")
      .bind(1, static_cast<std::int64_t>(row.name.table))
      .bind(2, row.name.robot)
      .bind(3, row.name.number)
      .bind(4, number)
      .run();
}

/// Applies the rows that were committed to the file to the decoded map.
void StoreReplica::Impl::apply_changes() {
  GrowingMap& present = own(map);
  present.robots = robots;
  for (Change& change : changes) {
    const MapRows::Key key{change.name.robot, change.name.number};
    if (change.content) {
      present.rows.put(key, std::move(*change.content));
    } else {
      present.rows.remove(kRowTables[change.name.table].name, key);
    }
  }
  if (stream == StoreStream::kMap) present.head = number;
}

StoreReplica::StoreReplica(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StoreReplica::StoreReplica(StoreReplica&& other) noexcept = default;
StoreReplica& StoreReplica::operator=(StoreReplica&& other) noexcept = default;
StoreReplica::~StoreReplica() {
  if (impl_ == nullptr) return;
  impl_->end_transaction();
  const auto left =
      guarded(impl_->file, ErrorKind::kOutput, [&] { impl_->database->run("PRAGMA journal_mode = DELETE"); });
  (void)left;  // fails while another program reads; then file and log together are complete
}

core::Result<StoreReplica> StoreReplica::open(const std::filesystem::path& file) {
  return guarded(file, ErrorKind::kOutput,
                 [&] { return StoreReplica(std::make_unique<Impl>(file, open_database(file))); });
}

const StoreHeads& StoreReplica::heads() const { return impl_->heads; }
std::size_t StoreReplica::keyframes() const { return impl_->keyframes; }
bool StoreReplica::complete() const { return impl_->complete; }
MapFollower StoreReplica::map() const { return MapFollower(impl_->map); }
const ReplicaBytes& StoreReplica::bytes() const { return impl_->bytes; }
void StoreReplica::roll_back() { impl_->end_transaction(); }

/// Transactions must arrive in order.
core::Result<void> StoreReplica::begin(StoreStream stream, std::int64_t number) {
  impl_->end_transaction();
  return impl_->guard([&] {
    if (number <= impl_->heads[stream]) throw BadBytes("transaction " + std::to_string(number) + " is old");
    impl_->open = std::make_unique<Transaction>(*impl_->database, true);
    impl_->stream = stream;
    impl_->number = number;
  });
}

/// Chunks may end within a row.
core::Result<void> StoreReplica::append(const std::uint8_t* bytes, std::size_t size) {
  return impl_->guard([&] {
    if (impl_->open == nullptr) throw BadBytes("no transaction was begun");
    Bytes& partial_row = impl_->partial_row;
    partial_row.insert(partial_row.end(), bytes, bytes + size);
    consume_rows(partial_row, [&](const StoreRow& row, std::size_t length) {
      impl_->apply_row(row);
      impl_->count(kRowTables[row.name.table], length);
    });
  });
}

/// All rows or none; counters follow the commit.
core::Result<void> StoreReplica::commit() {
  return impl_->guard([&] {
    if (impl_->open == nullptr) throw BadBytes("no transaction was begun");
    if (!impl_->partial_row.empty()) throw BadBytes("a row ends too early");
    impl_->open->commit();
    impl_->apply_changes();
    const ReplicaBytes received = impl_->pending;
    impl_->end_transaction();
    impl_->bytes.place += received.place;
    impl_->bytes.map += received.map;
    impl_->bytes.cloud += received.cloud;
    impl_->reread();
  });
}

/// Empties the replica, for a sender that starts again.
core::Result<void> StoreReplica::clear() {
  impl_->end_transaction();
  return impl_->guard([&] {
    Transaction whole(*impl_->database, true);
    for (const RowTable& table : kRowTables) {
      impl_->database->run("DELETE FROM " + std::string(table.name));
    }
    impl_->database->run("DELETE FROM removed");
    whole.commit();
    impl_->reread();
    impl_->read_map();
  });
}

}  // namespace plumbline::maps
