// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/mcap_writer.hpp"

#include <libdeflate.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "bag_part/cdr.hpp"
#include "bag_part/mcap_records.hpp"
#include "bag_part/message_definitions.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;  // about one image: frames are read alone
constexpr int kZstdLevel = 1;

/// The fields of a record.
class RecordFields {
 public:
  template <typename Number>
  RecordFields& number(Number value) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof(Number));
    return *this;
  }
  RecordFields& text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size()));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    return *this;
  }
  RecordFields& bytes(const Bytes& value) {
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    return *this;
  }
  /// A list of any kind: its bytes' number, then they.
  RecordFields& list(const RecordFields& entries) {
    number(static_cast<std::uint32_t>(entries.bytes_.size()));
    return bytes(entries.bytes_);
  }
  [[nodiscard]] const Bytes& all() const { return bytes_; }

 private:
  Bytes bytes_;
};

Bytes record(McapOpcode opcode, const RecordFields& fields) {
  RecordFields whole;
  whole.number(static_cast<std::uint8_t>(opcode));
  whole.number(static_cast<std::uint64_t>(fields.all().size()));
  whole.bytes(fields.all());
  return whole.all();
}

struct MessageSpot {
  std::int64_t log_ns = 0;
  std::uint64_t offset = 0;
};

struct WrittenChunk {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
  std::uint64_t at = 0;
  std::uint64_t record_size = 0;
  std::map<std::uint16_t, std::uint64_t> index_at;  ///< position of each channel's message index
  std::uint64_t index_size = 0;
  std::uint64_t packed_size = 0;
  std::uint64_t plain_size = 0;
};

class McapWriter final : public BagWriter {
 public:
  McapWriter(const std::filesystem::path& file, const std::string& made_by) : file_(file) {
    put(Bytes(kMcapMagic.begin(), kMcapMagic.end()));
    put(record(McapOpcode::kHeader,
               RecordFields().text("ros2").text(made_by + " " + std::string(core::version()))));
  }

  void write(const std::string& topic, const ImageMessage& message) override {
    add(topic, "sensor_msgs/msg/Image", message.header.stamp_ns, encode_cdr(message));
  }
  void write(const std::string& topic, const CompressedImageMessage& message) override {
    add(topic, "sensor_msgs/msg/CompressedImage", message.header.stamp_ns, encode_cdr(message));
  }
  void write(const std::string& topic, const CameraInfoMessage& message) override {
    add(topic, "sensor_msgs/msg/CameraInfo", message.header.stamp_ns, encode_cdr(message));
  }
  void write(const std::string& topic, const std::vector<TransformMessage>& transforms,
             std::int64_t stamp_ns) override {
    add(topic, "tf2_msgs/msg/TFMessage", stamp_ns, encode_cdr(transforms, stamp_ns));
  }
  void write_bytes(const std::string& topic, const std::string& type, std::int64_t log_ns,
                   const Bytes& cdr) override {
    add(topic, type, log_ns, cdr);
  }
  void write_camera_yaml(const std::string& text) override {
    flush();
    metadata_at_ = at_;
    put(record(McapOpcode::kMetadata,
               RecordFields().text("plumbline").list(RecordFields().text("camera.yaml").text(text))));
    metadata_size_ = at_ - metadata_at_;
  }
  core::Result<void> finish() override;

 private:
  void put(const Bytes& bytes) {
    file_.write(bytes.data(), bytes.size());
    at_ += bytes.size();
  }
  void add(const std::string& topic, const std::string& type, std::int64_t log_ns, const Bytes& message);
  std::uint16_t channel_of(const std::string& topic, const std::string& type);
  void flush();
  void put_indices(WrittenChunk& chunk);
  [[nodiscard]] Bytes chunk_index(const WrittenChunk& chunk) const;
  [[nodiscard]] Bytes statistics() const;

  core::OutputFile file_;
  std::uint64_t at_ = 0;
  std::map<std::string, std::uint16_t> schemas_;
  std::map<std::string, std::uint16_t> channels_;
  Bytes definitions_;  ///< all schema and channel records, for the summary
  std::map<std::uint16_t, std::uint64_t> counts_;

  Bytes records_;  ///< records of the chunk that is being filled
  std::map<std::uint16_t, std::vector<MessageSpot>> spots_;
  std::int64_t chunk_first_ns_ = 0;
  std::int64_t chunk_last_ns_ = 0;
  std::vector<WrittenChunk> chunks_;
  std::uint64_t metadata_at_ = 0;
  std::uint64_t metadata_size_ = 0;
};

std::uint16_t McapWriter::channel_of(const std::string& topic, const std::string& type) {
  if (const auto known = channels_.find(topic); known != channels_.end()) return known->second;

  // The summary repeats all definitions
  const auto append = [this](const Bytes& definition) {
    records_.insert(records_.end(), definition.begin(), definition.end());
    definitions_.insert(definitions_.end(), definition.begin(), definition.end());
  };

  // Topics of one type share a schema
  if (schemas_.count(type) == 0) {
    const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
    schemas_[type] = id;
    append(record(McapOpcode::kSchema,
                  RecordFields().number(id).text(type).text("ros2msg").text(message_definition(type))));
  }

  // Channels are numbered by their first messages
  const auto id = static_cast<std::uint16_t>(channels_.size());
  channels_[topic] = id;
  append(
      record(McapOpcode::kChannel,
             RecordFields().number(id).number(schemas_[type]).text(topic).text("cdr").list(RecordFields())));
  return id;
}

void McapWriter::add(const std::string& topic, const std::string& type, std::int64_t log_ns,
                     const Bytes& message) {
  const std::uint16_t channel = channel_of(topic, type);

  // The chunk's time span and index
  const bool first = spots_.empty();
  chunk_first_ns_ = first ? log_ns : std::min(chunk_first_ns_, log_ns);
  chunk_last_ns_ = first ? log_ns : std::max(chunk_last_ns_, log_ns);
  spots_[channel].push_back({log_ns, records_.size()});

  // The writer has one clock: both times are equal
  const auto sequence = static_cast<std::uint32_t>(counts_[channel]++);
  const Bytes written =
      record(McapOpcode::kMessage,
             RecordFields().number(channel).number(sequence).number(log_ns).number(log_ns).bytes(message));
  records_.insert(records_.end(), written.begin(), written.end());
  if (records_.size() >= kChunkBytes) flush();
}

void McapWriter::flush() {
  if (records_.empty()) return;
  Bytes packed(ZSTD_compressBound(records_.size()));
  packed.resize(ZSTD_compress(packed.data(), packed.size(), records_.data(), records_.size(), kZstdLevel));

  WrittenChunk chunk;
  chunk.first_ns = chunk_first_ns_;
  chunk.last_ns = chunk_last_ns_;
  chunk.at = at_;
  chunk.packed_size = packed.size();
  chunk.plain_size = records_.size();

  // The checksum is that of the plain records
  put(record(McapOpcode::kChunk, RecordFields()
                                     .number(chunk.first_ns)
                                     .number(chunk.last_ns)
                                     .number(chunk.plain_size)
                                     .number(libdeflate_crc32(0, records_.data(), records_.size()))
                                     .text("zstd")
                                     .number(chunk.packed_size)
                                     .bytes(packed)));

  // Indices of messages follow their chunk
  chunk.record_size = at_ - chunk.at;
  put_indices(chunk);
  chunks_.push_back(std::move(chunk));
  records_.clear();
  spots_.clear();
}

void McapWriter::put_indices(WrittenChunk& chunk) {
  const std::uint64_t begin = at_;
  for (auto& [channel, spots] : spots_) {
    // Readers search messages by time
    std::stable_sort(spots.begin(), spots.end(),
                     [](const MessageSpot& a, const MessageSpot& b) { return a.log_ns < b.log_ns; });
    RecordFields entries;
    for (const MessageSpot& spot : spots) entries.number(spot.log_ns).number(spot.offset);
    chunk.index_at[channel] = at_;
    put(record(McapOpcode::kMessageIndex, RecordFields().number(channel).list(entries)));
  }
  chunk.index_size = at_ - begin;
}

/// Readers find a chunk by its time span, without unpacking it.
Bytes McapWriter::chunk_index(const WrittenChunk& chunk) const {
  RecordFields indices;
  for (const auto& [channel, at] : chunk.index_at) indices.number(channel).number(at);
  return record(McapOpcode::kChunkIndex, RecordFields()
                                             .number(chunk.first_ns)
                                             .number(chunk.last_ns)
                                             .number(chunk.at)
                                             .number(chunk.record_size)
                                             .list(indices)
                                             .number(chunk.index_size)
                                             .text("zstd")
                                             .number(chunk.packed_size)
                                             .number(chunk.plain_size));
}

Bytes McapWriter::statistics() const {
  std::uint64_t messages = 0;
  RecordFields counts;
  for (const auto& [channel, count] : counts_) {
    counts.number(channel).number(count);
    messages += count;
  }

  // A bag without messages has the span 0 to 0
  std::int64_t first = chunks_.empty() ? 0 : std::numeric_limits<std::int64_t>::max();
  std::int64_t last = 0;
  for (const WrittenChunk& chunk : chunks_) {
    first = std::min(first, chunk.first_ns);
    last = std::max(last, chunk.last_ns);
  }

  return record(McapOpcode::kStatistics, RecordFields()
                                             .number(messages)
                                             .number(static_cast<std::uint16_t>(schemas_.size()))
                                             .number(static_cast<std::uint32_t>(channels_.size()))
                                             .number(std::uint32_t{0})  // attachments
                                             .number(static_cast<std::uint32_t>(metadata_size_ > 0 ? 1 : 0))
                                             .number(static_cast<std::uint32_t>(chunks_.size()))
                                             .number(first)
                                             .number(last)
                                             .list(counts));
}

core::Result<void> McapWriter::finish() {
  constexpr std::uint32_t kNoCrc = 0;
  constexpr auto kMetadataIndex = static_cast<McapOpcode>(0x0D);
  flush();
  put(record(McapOpcode::kDataEnd, RecordFields().number(kNoCrc)));

  // Readers begin with the summary
  const std::uint64_t summary = at_;
  put(definitions_);
  put(statistics());
  for (const WrittenChunk& chunk : chunks_) put(chunk_index(chunk));
  if (metadata_size_ > 0) {
    put(record(kMetadataIndex, RecordFields().number(metadata_at_).number(metadata_size_).text("plumbline")));
  }

  // The footer tells where the summary begins
  put(record(McapOpcode::kFooter, RecordFields().number(summary).number(std::uint64_t{0}).number(kNoCrc)));
  put(Bytes(kMcapMagic.begin(), kMcapMagic.end()));
  return file_.commit();
}

}  // namespace

std::unique_ptr<BagWriter> create_mcap(const std::filesystem::path& file, const std::string& made_by) {
  return std::make_unique<McapWriter>(file, made_by);
}

}  // namespace plumbline::dataset
