// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/mcap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "bag_part/mcap_records.hpp"
#include "bag_part/packed_message.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::uint64_t kNoChunk = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint64_t kMostRecordBytes = std::uint64_t{1} << 24;  // of schemas, channels and metadata

/// "sensor_msgs/msg/Image" as "sensor_msgs/Image".
std::string short_type(const std::string& type) {
  const std::size_t msg = type.find("/msg/");
  return msg == std::string::npos ? type : type.substr(0, msg) + type.substr(msg + 4);
}

class McapFile final : public BagFile {
 public:
  McapFile(BinaryFile file, std::string shown) : file_(std::move(file)), shown_(std::move(shown)) {}

  core::Result<void> scan(const Visit& visit) override;
  [[nodiscard]] core::Result<Bytes> read(const MessagePlace& place) const override;
  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return topics_; }
  [[nodiscard]] const std::vector<std::string>& notes() const override { return notes_; }
  [[nodiscard]] std::string camera_yaml() const override { return camera_yaml_; }

 private:
  void scan_record(McapOpcode opcode, std::uint64_t at, std::uint64_t size, const Visit& visit);
  void scan_chunk(std::uint64_t at, std::uint64_t size, const Visit& visit);
  bool scan_records(ChunkCursor& records, const Chunk& chunk, std::uint64_t at, const Visit& visit);
  template <typename Get>
  bool scan_message(const Get& get, MessagePlace place, const Visit& visit);
  void add_definition(McapOpcode opcode, const Bytes& content);
  void add_channel(McapFields& fields);
  [[nodiscard]] core::Result<ChunkCache::Records> chunk_at(std::uint64_t at) const;

  BinaryFile file_;
  std::string shown_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::size_t> topic_of_channel_;
  std::vector<BagTopic> topics_;
  std::vector<std::string> notes_;
  std::string camera_yaml_;
  std::size_t damaged_chunks_ = 0;
  std::uint64_t first_damaged_ = 0;
  std::string why_damaged_;
  mutable ChunkCache chunks_;
};

core::Result<void> McapFile::scan(const Visit& visit) {
  // Record by record: a cut file has no index
  std::uint64_t at = kMcapMagic.size();
  bool ended = false;
  while (!ended) {
    std::array<std::uint8_t, kRecordHead> head{};
    if (!file_.read(at, head.data(), head.size())) break;

    const auto opcode = static_cast<McapOpcode>(head[0]);
    const auto size = McapFields(head.data() + 1, head.size() - 1).number<std::uint64_t>();
    at += kRecordHead;

    // A cut file ends within a record
    if (head[0] == 0 || size > file_.size() - at) {
      at -= kRecordHead;
      break;
    }

    ended = opcode == McapOpcode::kDataEnd || opcode == McapOpcode::kFooter;
    if (!ended) scan_record(opcode, at, size, visit);
    at += size;
  }

  // Messages before the damage are used
  if (!ended) {
    notes_.push_back(fmt::format("{}: is cut off or damaged at byte {} of {}; what is before is used", shown_,
                                 at, file_.size()));
  }

  // The first damaged chunk is described
  if (damaged_chunks_ > 0) {
    notes_.push_back(
        fmt::format("{}: {} chunks are damaged and their messages lost; the first, at byte {}, {}", shown_,
                    damaged_chunks_, first_damaged_, why_damaged_));
  }

  return {};
}

void McapFile::scan_record(McapOpcode opcode, std::uint64_t at, std::uint64_t size, const Visit& visit) {
  // Messages are in chunks or stand alone
  if (opcode == McapOpcode::kChunk) {
    scan_chunk(at, size, visit);
  } else if (opcode == McapOpcode::kMessage) {
    if (size < kMessageHead || size - kMessageHead > kMostMessageBytes) return;

    std::uint64_t next = at;
    const auto get = [&](std::uint8_t* to, std::size_t count) {
      const bool there = file_.read(next, to, count);
      next += count;
      return there;
    };

    // This message is outside any chunk
    scan_message(get, {at + kMessageHead, kNoChunk, static_cast<std::uint32_t>(size - kMessageHead), 0},
                 visit);
  } else if (opcode == McapOpcode::kSchema || opcode == McapOpcode::kChannel ||
             opcode == McapOpcode::kMetadata) {
    // Sizes of damaged records are not allocated
    if (size > kMostRecordBytes) return;
    Bytes content(static_cast<std::size_t>(size));
    if (file_.read(at, content.data(), content.size())) add_definition(opcode, content);
  }
}

void McapFile::scan_chunk(std::uint64_t at, std::uint64_t size, const Visit& visit) {
  const auto chunk = read_chunk_head(file_, at, size);
  std::string wrong;
  if (!chunk) {
    wrong = "has a damaged head";
  } else if (!chunk->unknown.empty()) {
    wrong = fmt::format("is compressed by '{}' (known: zstd, lz4)", chunk->unknown);
  } else if (chunk->plain_size > kMostChunkBytes) {
    wrong = "is too large";
  } else {
    ChunkCursor records(file_, *chunk);

    // Records before the damage are visited
    if (!scan_records(records, *chunk, at, visit)) wrong = "cannot be unpacked or does not hold records";
  }

  // The first damaged chunk stands for all
  if (wrong.empty()) return;
  if (damaged_chunks_++ > 0) return;
  first_damaged_ = at - kRecordHead;
  why_damaged_ = wrong;
}

/// True if the whole chunk holds records; those before the first damaged one are visited.
bool McapFile::scan_records(ChunkCursor& records, const Chunk& chunk, std::uint64_t at, const Visit& visit) {
  while (records.position() < chunk.plain_size) {
    std::array<std::uint8_t, kRecordHead> head{};
    if (!records.get(head.data(), head.size())) return false;
    const auto opcode = static_cast<McapOpcode>(head[0]);
    const auto size = McapFields(head.data() + 1, head.size() - 1).number<std::uint64_t>();
    const std::uint64_t begin = records.position();

    // A record must end within its chunk
    if (size > chunk.plain_size - begin) return false;

    // Messages are unpacked only up to their stamps
    if (opcode == McapOpcode::kMessage) {
      if (size < kMessageHead || size - kMessageHead > kMostMessageBytes) return false;
      const auto get = [&records](std::uint8_t* to, std::size_t count) { return records.get(to, count); };
      const auto payload = static_cast<std::uint32_t>(size - kMessageHead);
      if (!scan_message(get, {at, begin + kMessageHead, payload, 0}, visit)) return false;
    } else if (opcode == McapOpcode::kSchema || opcode == McapOpcode::kChannel) {
      if (size > kMostRecordBytes) return false;

      // Definitions are unpacked completely
      Bytes content(static_cast<std::size_t>(size));
      if (!records.get(content.data(), content.size())) return false;
      add_definition(opcode, content);
    }
    records.skip(begin + size - records.position());
  }
  return true;
}

/// `get` reads the message's bytes from its head on.
template <typename Get>
bool McapFile::scan_message(const Get& get, MessagePlace place, const Visit& visit) {
  std::array<std::uint8_t, kMessageHead> fixed{};
  std::array<std::uint8_t, kHeadBytes> head{};
  BagEntry entry;
  entry.place = place;
  entry.head = head.data();
  entry.head_size = std::min<std::size_t>(place.size, kHeadBytes);
  if (!get(fixed.data(), fixed.size()) || !get(head.data(), entry.head_size)) return false;

  // The channel tells the topic
  McapFields fields(fixed.data(), fixed.size());
  const auto topic = topic_of_channel_.find(fields.number<std::uint16_t>());
  fields.skip(sizeof(std::uint32_t));  // sequence number
  entry.log_ns = fields.number<std::int64_t>();
  if (topic == topic_of_channel_.end()) return true;
  entry.topic = topic->second;

  // Messages may be compressed one by one
  Bytes unpacked;
  if (is_zstd(head.data(), entry.head_size)) {
    Bytes packed(head.data(), head.data() + entry.head_size);
    packed.resize(place.size);
    if (!get(packed.data() + entry.head_size, packed.size() - entry.head_size)) return false;
    unpacked = unpacked_head(packed);
    entry.head = unpacked.data();
    entry.head_size = unpacked.size();
  }

  visit(entry);
  return true;
}

void McapFile::add_definition(McapOpcode opcode, const Bytes& content) {
  McapFields fields(content.data(), content.size());

  // Channels refer to schemas before them
  if (opcode == McapOpcode::kSchema) {
    const auto id = fields.number<std::uint16_t>();
    const std::string name = fields.text();
    if (fields.good()) schemas_[id] = short_type(name);
  } else if (opcode == McapOpcode::kChannel) {
    add_channel(fields);
  } else if (fields.text() == "plumbline") {
    fields.skip(sizeof(std::uint32_t));  // bytes of the map
    while (fields.good() && fields.left() > 0) {
      const std::string key = fields.text();
      const std::string value = fields.text();
      if (fields.good() && key == "camera.yaml") camera_yaml_ = value;
    }
  }
}

void McapFile::add_channel(McapFields& fields) {
  const auto id = fields.number<std::uint16_t>();
  const auto schema = fields.number<std::uint16_t>();
  BagTopic topic;
  topic.name = fields.text();
  topic.encoding = fields.text();
  if (!fields.good()) return;
  const auto type = schemas_.find(schema);
  if (type != schemas_.end()) topic.type = type->second;

  // Several channels may be one topic
  const auto same = [&topic](const BagTopic& other) {
    return std::tie(topic.name, topic.type, topic.encoding) ==
           std::tie(other.name, other.type, other.encoding);
  };
  const auto known = std::find_if(topics_.begin(), topics_.end(), same);
  topic_of_channel_[id] = static_cast<std::size_t>(known - topics_.begin());
  if (known == topics_.end()) topics_.push_back(std::move(topic));
}

core::Result<ChunkCache::Records> McapFile::chunk_at(std::uint64_t at) const {
  // Neighbouring messages share a chunk
  if (auto known = chunks_.find(at)) return known;
  const auto head = read_chunk_head(file_, at, file_.size() - std::min(at, file_.size()));
  tl::expected<Bytes, std::string> plain = tl::unexpected<std::string>("has a damaged head");
  if (head) plain = read_chunk(file_, *head);
  if (!plain) {
    return core::input_error(
        fmt::format("{}: the chunk at byte {} {}", shown_, at - kRecordHead, plain.error()));
  }
  auto chunk = std::make_shared<const Bytes>(std::move(*plain));
  chunks_.add(at, chunk);
  return chunk;
}

core::Result<Bytes> McapFile::read(const MessagePlace& place) const {
  Bytes bytes;

  // Files without chunks hold plain messages
  if (place.offset == kNoChunk) {
    bytes.resize(place.size);
    if (!file_.read(place.at, bytes.data(), bytes.size()))
      return core::input_error(fmt::format("{}: the message at byte {} cannot be read", shown_, place.at));
  } else {
    const auto chunk = chunk_at(place.at);
    if (!chunk) return tl::unexpected(chunk.error());

    const Bytes& plain = **chunk;
    if (place.offset > plain.size() || place.size > plain.size() - place.offset) {
      return core::input_error(
          fmt::format("{}: the chunk at byte {} has changed while it was used", shown_, place.at));
    }

    const auto begin = plain.begin() + static_cast<std::ptrdiff_t>(place.offset);
    bytes.assign(begin, begin + place.size);
  }

  // Messages may be compressed one by one
  if (!unpack_message(bytes)) {
    return core::input_error(fmt::format("{}: the message at byte {} cannot be unpacked", shown_, place.at));
  }

  return bytes;
}

}  // namespace

bool is_mcap(const std::filesystem::path& file) {
  const auto opened = BinaryFile::open(file);
  std::array<std::uint8_t, kMcapMagic.size()> magic{};
  return opened && opened->read(0, magic.data(), magic.size()) && magic == kMcapMagic;
}

OpenedBag open_mcap(const std::filesystem::path& file, const std::string& shown) {
  auto opened = BinaryFile::open(file);
  if (!opened) return tl::unexpected(opened.error());

  // MCAP is known by its first bytes
  std::array<std::uint8_t, kMcapMagic.size()> magic{};
  if (!opened->read(0, magic.data(), magic.size()) || magic != kMcapMagic)
    return core::input_error(shown + ": is no MCAP file");
  return std::make_unique<McapFile>(std::move(*opened), shown);
}

}  // namespace plumbline::dataset
