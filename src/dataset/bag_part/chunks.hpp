// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Chunks: the messages of a bag in compressed blocks, in MCAP as in ROS 1's bags.
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "bag_part/binary_file.hpp"
#include "bag_part/compression.hpp"

namespace plumbline::dataset {

struct Chunk {
  std::uint64_t plain_size = 0;  ///< size of the uncompressed records
  std::uint32_t crc = 0;         ///< checksum of the uncompressed records; 0: none stored
  Compression compression = Compression::kNone;
  std::string unknown;  ///< name of a compression that is not supported, else empty
  std::uint64_t data_at = 0;
  std::uint64_t data_size = 0;
};

/// Chunks larger than this are refused: one has to be in memory at a time.
constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 29;

/// The records of a chunk, checked against its CRC, or what is wrong with them.
tl::expected<Bytes, std::string> read_chunk(const BinaryFile& file, const Chunk& chunk);

/// The bytes of a chunk's records one after another; a compressed one is only unpacked as far as needed.
class ChunkCursor {
 public:
  ChunkCursor(const BinaryFile& file, const Chunk& chunk);
  /// False when they are not all there.
  bool get(std::uint8_t* to, std::size_t count);
  /// Nothing is read for it before the next get().
  void skip(std::uint64_t count) { position_ += count; }
  [[nodiscard]] std::uint64_t position() const { return position_; }

 private:
  bool catch_up();

  const BinaryFile& file_;
  const Chunk& chunk_;
  Bytes packed_;
  std::unique_ptr<Inflater> inflater_;
  std::uint64_t position_ = 0;
  std::uint64_t unpacked_ = 0;
};

/// The last chunks that were unpacked, by position in the file: successive frames are in the same chunk or in
/// adjacent ones.
/// Thread-safe.
class ChunkCache {
 public:
  using Records = std::shared_ptr<const Bytes>;

  Records find(std::uint64_t at) {
    const std::lock_guard lock(mutex_);
    for (const auto& [where, chunk] : chunks_) {
      if (where == at) return chunk;
    }
    return nullptr;
  }
  void add(std::uint64_t at, Records chunk) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 25;
    const std::lock_guard lock(mutex_);
    bytes_ += chunk->size();
    chunks_.emplace_front(at, std::move(chunk));

    // The newest chunk stays, whatever its size
    while (bytes_ > kMostBytes && chunks_.size() > 1) {
      bytes_ -= chunks_.back().second->size();
      chunks_.pop_back();
    }
  }

 private:
  std::mutex mutex_;
  std::list<std::pair<std::uint64_t, Records>> chunks_;
  std::size_t bytes_ = 0;
};

}  // namespace plumbline::dataset
