// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Records of MCAP files (mcap.dev/spec): an opcode, a length of 8 bytes, and fields one after another.
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>

#include "bag_part/chunks.hpp"

namespace plumbline::dataset {

constexpr std::array<std::uint8_t, 8> kMcapMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
constexpr std::size_t kRecordHead = 9;    ///< opcode and length
constexpr std::size_t kMessageHead = 22;  ///< channel, sequence, log time, publish time

enum class McapOpcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// Fields of a record, one after another; after the first that is not all there every one is 0 or empty.
class McapFields {
 public:
  McapFields(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  /// 0 if the record ends before it.
  template <typename Number>
  Number number() {
    Number value{};
    if (!has(sizeof(Number))) return value;
    std::memcpy(&value, data_ + at_, sizeof(Number));
    at_ += sizeof(Number);
    return value;
  }
  std::string text() {
    const auto length = number<std::uint32_t>();
    if (!has(length)) return "";
    std::string value(reinterpret_cast<const char*>(data_ + at_), length);
    at_ += length;
    return value;
  }
  void skip(std::uint64_t count) {
    if (has(count)) at_ += static_cast<std::size_t>(count);
  }
  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::size_t position() const { return at_; }
  [[nodiscard]] std::size_t left() const { return size_ - at_; }

 private:
  bool has(std::uint64_t count) {
    good_ = good_ && count <= size_ - at_;
    return good_;
  }

  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
  bool good_ = true;
};

/// Head of the chunk record whose fields begin at `at` and take `size` bytes; none if it is damaged.
std::optional<Chunk> read_chunk_head(const BinaryFile& file, std::uint64_t at, std::uint64_t size);

}  // namespace plumbline::dataset
