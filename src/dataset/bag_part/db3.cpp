// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/db3.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <utility>

#include "bag_part/packed_message.hpp"

namespace plumbline::dataset {
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
struct CloseBlob {
  void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

std::string text_in(sqlite3_stmt* row, int column) {
  const unsigned char* text = sqlite3_column_text(row, column);
  return text == nullptr ? "" : reinterpret_cast<const char*>(text);
}

/// "sensor_msgs/msg/Image" as "sensor_msgs/Image".
std::string plain_type(const std::string& type) {
  const std::size_t msg = type.find("/msg/");
  return msg == std::string::npos ? type : type.substr(0, msg) + type.substr(msg + 4);
}

/// File name as a URI, so that `mode` can be given; '?', '#' and '%' are escaped.
std::string uri_of(const std::filesystem::path& file, const char* mode) {
  std::string uri = "file:";
  for (const char c : file.string()) {
    if (c == '?' || c == '#' || c == '%') {
      uri += fmt::format("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      uri += c;
    }
  }
  return uri + "?" + mode;
}

class Db3File final : public BagFile {
 public:
  Db3File(Database database, std::string shown) : database_(std::move(database)), shown_(std::move(shown)) {}

  core::Result<void> prepare();
  void add_note(std::string note) { notes_.push_back(std::move(note)); }
  core::Result<void> scan(const Visit& visit) override;
  [[nodiscard]] core::Result<Bytes> read(const MessagePlace& place) const override;
  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return topics_; }
  [[nodiscard]] const std::vector<std::string>& notes() const override { return notes_; }

 private:
  [[nodiscard]] Statement statement(const char* sql) const {
    sqlite3_stmt* prepared = nullptr;
    sqlite3_prepare_v2(database_.get(), sql, -1, &prepared, nullptr);
    return Statement(prepared);
  }
  [[nodiscard]] Bytes head_of(std::unique_ptr<sqlite3_blob, CloseBlob>& blob, std::int64_t row,
                              std::uint32_t size) const;

  Database database_;
  std::string shown_;
  std::map<std::int64_t, std::size_t> topic_of_id_;
  std::vector<BagTopic> topics_;
  std::vector<std::string> notes_;
  mutable std::mutex mutex_;  ///< one statement is stepped at a time
  Statement read_;
};

/// Only inspects tables and executes nothing of them, such as views and triggers of a foreign file.
core::Result<void> Db3File::prepare() {
  sqlite3* const db = database_.get();
  sqlite3_db_config(db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_limit(db, SQLITE_LIMIT_LENGTH, static_cast<int>(kMostMessageBytes));

  // Topics are numbered in the order of ids
  const Statement topics = statement("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
  if (topics != nullptr) {
    while (sqlite3_step(topics.get()) == SQLITE_ROW) {
      topic_of_id_[sqlite3_column_int64(topics.get(), 0)] = topics_.size();
      topics_.push_back(
          {text_in(topics.get(), 1), plain_type(text_in(topics.get(), 2)), text_in(topics.get(), 3)});
    }
  }

  // One statement for all messages
  read_ = statement("SELECT data FROM messages WHERE id = ?");
  if (topics != nullptr && read_ != nullptr) return {};
  return core::input_error(fmt::format("{}: is not a rosbag2 bag, or is damaged at its beginning: {}", shown_,
                                       sqlite3_errmsg(db)));
}

/// The first bytes of a message; of the pages of a large one only the first is read.
Bytes Db3File::head_of(std::unique_ptr<sqlite3_blob, CloseBlob>& blob, std::int64_t row,
                       std::uint32_t size) const {
  if (blob == nullptr || sqlite3_blob_reopen(blob.get(), row) != SQLITE_OK) {
    sqlite3_blob* opened = nullptr;
    const int done = sqlite3_blob_open(database_.get(), "main", "messages", "data", row, 0, &opened);
    blob.reset(opened);
    if (done != SQLITE_OK) return {};
  }
  Bytes head(std::min<std::size_t>(size, kHeadBytes));
  if (sqlite3_blob_read(blob.get(), head.data(), static_cast<int>(head.size()), 0) != SQLITE_OK) return {};
  if (!is_zstd(head.data(), head.size())) return head;
  Bytes packed(size);
  if (sqlite3_blob_read(blob.get(), packed.data(), static_cast<int>(packed.size()), 0) != SQLITE_OK)
    return {};
  return unpacked_head(packed);
}

core::Result<void> Db3File::scan(const Visit& visit) {
  const Statement rows = statement("SELECT id, topic_id, timestamp, length(data) FROM messages ORDER BY id");
  std::unique_ptr<sqlite3_blob, CloseBlob> blob;
  std::size_t seen = 0;

  // Rows up to the first damaged page
  int step = SQLITE_ERROR;
  while (rows != nullptr && (step = sqlite3_step(rows.get())) == SQLITE_ROW) {
    const std::int64_t row = sqlite3_column_int64(rows.get(), 0);
    const auto topic = topic_of_id_.find(sqlite3_column_int64(rows.get(), 1));
    const std::int64_t size = sqlite3_column_int64(rows.get(), 3);

    // Unknown topics and damaged sizes are skipped
    if (topic == topic_of_id_.end() || size < 0 || size > static_cast<std::int64_t>(kMostMessageBytes))
      continue;

    BagEntry entry;
    entry.topic = topic->second;
    entry.log_ns = sqlite3_column_int64(rows.get(), 2);
    entry.place.at = static_cast<std::uint64_t>(row);
    entry.place.size = static_cast<std::uint32_t>(size);

    // The message's stamp is in its head
    const Bytes head = head_of(blob, row, entry.place.size);
    entry.head = head.data();
    entry.head_size = head.size();
    ++seen;
    visit(entry);
  }

  // Messages before the damage are used
  if (step == SQLITE_DONE) return {};
  notes_.push_back(fmt::format("{}: is cut off or damaged after {} messages ({}); what is before is used",
                               shown_, seen, sqlite3_errmsg(database_.get())));
  return {};
}

core::Result<Bytes> Db3File::read(const MessagePlace& place) const {
  // One statement serves all threads
  const std::lock_guard lock(mutex_);
  sqlite3_stmt* const row = read_.get();
  sqlite3_reset(row);
  sqlite3_bind_int64(row, 1, static_cast<std::int64_t>(place.at));
  Bytes bytes;
  if (sqlite3_step(row) == SQLITE_ROW) {
    const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(row, 0));
    const int size = sqlite3_column_bytes(row, 0);
    if (data != nullptr && size > 0) bytes.assign(data, data + size);
  }
  sqlite3_reset(row);
  if (bytes.empty() || !unpack_message(bytes))
    return core::input_error(fmt::format("{}: message {} is damaged", shown_, place.at));
  return bytes;
}

/// For reading only; null if it cannot be opened.
Database open_database(const std::filesystem::path& file, const char* mode) {
  sqlite3* opened = nullptr;
  const int done = sqlite3_open_v2(uri_of(file, mode).c_str(), &opened,
                                   SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  Database database(opened);
  if (done != SQLITE_OK) database.reset();
  return database;
}

}  // namespace

OpenedBag open_db3(const std::filesystem::path& file, const std::string& shown) {
  // A journal can only be read if files may be made in its folder; otherwise it is ignored.
  core::Error first;
  std::error_code ignored;
  const bool journal = std::filesystem::exists(file.string() + "-wal", ignored);
  for (const bool alone : {false, true}) {
    Database database = open_database(file, alone ? "mode=ro&immutable=1" : "mode=ro");
    if (database == nullptr) continue;
    auto bag = std::make_unique<Db3File>(std::move(database), shown);
    const auto prepared = bag->prepare();
    if (prepared && alone && journal)
      bag->add_note(shown + "-wal cannot be used here; copy both to a folder of your own");
    if (prepared) return bag;
    if (first.message.empty()) first = prepared.error();
  }
  if (first.message.empty()) return core::input_error(shown + ": cannot be read");
  return tl::unexpected(first);
}

}  // namespace plumbline::dataset
