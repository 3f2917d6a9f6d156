// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/ros1_bag.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "bag_part/chunks.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::string_view kBagVersion = "#ROSBAG V2.0\n";
constexpr std::uint32_t kMostBagHeader = 1U << 20;  // of a record's own fields
constexpr std::uint32_t kMostConnection = 1U << 24;
constexpr std::uint64_t kOutsideChunks = std::numeric_limits<std::uint64_t>::max();

enum : std::uint8_t { kOpMessage = 2, kOpBagHeader = 3, kOpChunk = 5, kOpConnection = 7 };

std::uint32_t word_at(const std::uint8_t* bytes) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

/// "name=value" fields, each behind its length of 4 bytes.
class BagFields {
 public:
  /// False when a length goes beyond the end.
  bool read(const Bytes& header) {
    for (std::size_t at = 0; at < header.size();) {
      if (header.size() - at < sizeof(std::uint32_t)) return false;
      const std::uint32_t length = word_at(header.data() + at);
      at += sizeof(std::uint32_t);
      if (length > header.size() - at) return false;
      const std::string field(reinterpret_cast<const char*>(header.data() + at), length);
      const std::size_t equals = field.find('=');
      if (equals == std::string::npos) return false;
      fields_[field.substr(0, equals)] = field.substr(equals + 1);
      at += length;
    }
    return true;
  }
  [[nodiscard]] std::string text(const char* name) const {
    const auto found = fields_.find(name);
    return found == fields_.end() ? "" : found->second;
  }
  /// The field's first bytes as a number; 0 when it is shorter.
  template <typename Number>
  [[nodiscard]] Number number(const char* name) const {
    const std::string value = text(name);
    Number number{};
    if (value.size() >= sizeof(number)) std::memcpy(&number, value.data(), sizeof(number));
    return number;
  }

 private:
  std::map<std::string, std::string> fields_;
};

struct BagRecord {
  BagFields fields;
  std::uint8_t op = 0;
  std::uint32_t data_size = 0;
};

/// Reads up to a record's data; none if it is damaged or at the end. `get` reads the next bytes.
template <typename Get>
std::optional<BagRecord> next_record(const Get& get) {
  std::array<std::uint8_t, sizeof(std::uint32_t)> word{};
  if (!get(word.data(), word.size())) return std::nullopt;
  const std::uint32_t header_size = word_at(word.data());
  if (header_size > kMostBagHeader) return std::nullopt;
  Bytes header(header_size);
  BagRecord record;
  if (!get(header.data(), header.size()) || !record.fields.read(header)) return std::nullopt;
  if (!get(word.data(), word.size())) return std::nullopt;
  record.data_size = word_at(word.data());
  record.op = record.fields.number<std::uint8_t>("op");
  return record;
}

class Ros1Bag final : public BagFile {
 public:
  Ros1Bag(BinaryFile file, std::string shown) : file_(std::move(file)), shown_(std::move(shown)) {}

  core::Result<void> scan(const Visit& visit) override;
  [[nodiscard]] core::Result<Bytes> read(const MessagePlace& place) const override;
  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return topics_; }
  [[nodiscard]] const std::vector<std::string>& notes() const override { return notes_; }

 private:
  template <typename Get>
  bool scan_inner(const BagRecord& record, const Get& get, MessagePlace place, const Visit& visit);
  bool scan_chunk(const Chunk& chunk, const Visit& visit);
  void add_connection(const BagFields& fields, const Bytes& data);
  [[nodiscard]] core::Result<ChunkCache::Records> records_of(std::uint64_t at) const;

  BinaryFile file_;
  std::string shown_;
  std::map<std::uint32_t, std::size_t> topic_of_connection_;
  std::map<std::uint64_t, Chunk> chunks_;  ///< by where their data begin
  std::vector<BagTopic> topics_;
  std::vector<std::string> notes_;
  std::size_t damaged_chunks_ = 0;
  mutable ChunkCache cache_;
};

Chunk chunk_of(const BagRecord& record, std::uint64_t at) {
  Chunk chunk;
  chunk.plain_size = record.fields.number<std::uint32_t>("size");
  chunk.data_at = at;
  chunk.data_size = record.data_size;

  // Unknown compressions are reported by name
  const std::string compression = record.fields.text("compression");
  if (compression == "bz2") {
    chunk.compression = Compression::kBzip2;
  } else if (compression == "lz4") {
    chunk.compression = Compression::kLz4;
  } else if (compression == "none") {
    chunk.plain_size = chunk.data_size;
  } else {
    chunk.unknown = compression;
  }
  return chunk;
}

core::Result<void> Ros1Bag::scan(const Visit& visit) {
  std::uint64_t at = kBagVersion.size();
  const auto get = [&](std::uint8_t* to, std::size_t count) {
    if (!file_.read(at, to, count)) return false;
    at += count;
    return true;
  };

  // Records up to the first that is cut off
  std::uint64_t begin = at;
  bool whole = true;
  while (whole && (begin = at) < file_.size()) {
    const auto record = next_record(get);
    whole = record && record->data_size <= file_.size() - at;
    if (!whole) break;

    const std::uint64_t data = at;
    if (record->op == kOpBagHeader && !record->fields.text("encryptor").empty())
      return core::input_error(shown_ + ": is encrypted; decrypt it with rosbag first");
    if (record->op == kOpChunk) {
      const Chunk chunk = chunk_of(*record, data);
      const bool good = scan_chunk(chunk, visit);

      if (!good && damaged_chunks_++ == 0) {
        notes_.push_back(fmt::format(
            "{}: the chunk at byte {} is damaged ({}); its other messages are lost", shown_, begin,
            chunk.unknown.empty() ? "cannot be unpacked or holds no records"
                                  : "is compressed by '" + chunk.unknown + "' (known: none, bz2, lz4)"));
      }
    } else {
      // In a bag that was not closed the records of the last chunk are not enclosed in it.
      const auto in_file = [&, next = data](std::uint8_t* to, std::size_t count) mutable {
        if (!file_.read(next, to, count)) return false;
        next += count;
        return true;
      };

      scan_inner(*record, in_file, {data, kOutsideChunks, record->data_size, 0}, visit);
    }

    at = data + record->data_size;
  }

  // Records before the damage are used
  if (!whole) {
    notes_.push_back(fmt::format("{}: is cut off or damaged at byte {} of {}; what is before is used", shown_,
                                 begin, file_.size()));
  }

  if (damaged_chunks_ > 1)
    notes_.push_back(fmt::format("{}: {} chunks are damaged", shown_, damaged_chunks_));
  return {};
}

/// Visits a record that is in a chunk, or would be; false if it is damaged.
template <typename Get>
bool Ros1Bag::scan_inner(const BagRecord& record, const Get& get_data, MessagePlace place,
                         const Visit& visit) {
  Get get = get_data;

  // Connections define the topics
  if (record.op == kOpConnection) {
    if (record.data_size > kMostConnection) return false;
    Bytes data(record.data_size);
    if (!get(data.data(), data.size())) return false;
    add_connection(record.fields, data);
    return true;
  }

  if (record.op != kOpMessage) return true;
  if (record.data_size > kMostMessageBytes) return false;

  // The message's stamp is in its head
  std::array<std::uint8_t, kHeadBytes> head{};
  BagEntry entry;
  entry.place = place;
  entry.head = head.data();
  entry.head_size = std::min<std::size_t>(record.data_size, kHeadBytes);
  if (!get(head.data(), entry.head_size)) return false;

  const auto topic = topic_of_connection_.find(record.fields.number<std::uint32_t>("conn"));
  if (topic == topic_of_connection_.end()) return true;
  entry.topic = topic->second;

  // Seconds and nanoseconds share a number
  const auto time = record.fields.number<std::uint64_t>("time");  // seconds, nanoseconds
  entry.log_ns =
      static_cast<std::int64_t>(time & 0xFFFFFFFFU) * 1'000'000'000 + static_cast<std::int64_t>(time >> 32);
  visit(entry);
  return true;
}

bool Ros1Bag::scan_chunk(const Chunk& chunk, const Visit& visit) {
  if (!chunk.unknown.empty() || chunk.plain_size > kMostChunkBytes) return false;
  chunks_[chunk.data_at] = chunk;
  ChunkCursor cursor(file_, chunk);
  const auto get = [&cursor](std::uint8_t* to, std::size_t count) { return cursor.get(to, count); };

  // Places are counted in the unpacked chunk
  while (cursor.position() < chunk.plain_size) {
    const auto record = next_record(get);
    const std::uint64_t begin = cursor.position();
    if (!record || begin > chunk.plain_size || record->data_size > chunk.plain_size - begin) return false;
    if (!scan_inner(*record, get, {chunk.data_at, begin, record->data_size, 0}, visit)) return false;
    cursor.skip(begin + record->data_size - cursor.position());
  }
  return true;
}

void Ros1Bag::add_connection(const BagFields& fields, const Bytes& data) {
  BagFields about;
  if (!about.read(data)) return;
  BagTopic topic{fields.text("topic"), about.text("type"), "ros1"};

  // Several connections may be one topic
  const auto same = [&topic](const BagTopic& other) {
    return std::tie(topic.name, topic.type) == std::tie(other.name, other.type);
  };
  const auto known = std::find_if(topics_.begin(), topics_.end(), same);
  topic_of_connection_[fields.number<std::uint32_t>("conn")] =
      static_cast<std::size_t>(known - topics_.begin());
  if (known == topics_.end()) topics_.push_back(std::move(topic));
}

core::Result<ChunkCache::Records> Ros1Bag::records_of(std::uint64_t at) const {
  // Neighbouring messages share a chunk
  if (auto known = cache_.find(at)) return known;
  const auto chunk = chunks_.find(at);
  tl::expected<Bytes, std::string> plain = tl::unexpected<std::string>("is not known");
  if (chunk != chunks_.end()) plain = read_chunk(file_, chunk->second);
  if (!plain)
    return core::input_error(fmt::format("{}: the chunk with data at byte {} {}", shown_, at, plain.error()));
  auto records = std::make_shared<const Bytes>(std::move(*plain));
  cache_.add(at, records);
  return records;
}

core::Result<Bytes> Ros1Bag::read(const MessagePlace& place) const {
  Bytes bytes;

  // Messages outside chunks are not compressed
  if (place.offset == kOutsideChunks) {
    bytes.resize(place.size);
    if (file_.read(place.at, bytes.data(), bytes.size())) return bytes;
    return core::input_error(fmt::format("{}: the message at byte {} cannot be read", shown_, place.at));
  }
  const auto records = records_of(place.at);
  if (!records) return tl::unexpected(records.error());

  // The file may have changed since its survey
  const Bytes& plain = **records;
  if (place.offset > plain.size() || place.size > plain.size() - place.offset)
    return core::input_error(fmt::format("{}: the chunk with data at byte {} is damaged", shown_, place.at));
  const auto begin = plain.begin() + static_cast<std::ptrdiff_t>(place.offset);
  bytes.assign(begin, begin + place.size);
  return bytes;
}

}  // namespace

OpenedBag open_ros1_bag(const std::filesystem::path& file, const std::string& shown) {
  auto opened = BinaryFile::open(file);
  if (!opened) return tl::unexpected(opened.error());

  // ROS 1 names the version in the first line
  std::array<char, kBagVersion.size()> version{};
  if (!opened->read(0, version.data(), version.size()) ||
      std::string_view(version.data(), version.size()) != kBagVersion) {
    return core::input_error(fmt::format(
        "{}: is not a bag of format 2.0, which ROS 1 has written since 2010; convert it with rosbag fix",
        shown));
  }
  return std::make_unique<Ros1Bag>(std::move(*opened), shown);
}

}  // namespace plumbline::dataset
