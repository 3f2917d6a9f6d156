// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/mcap_records.hpp"

#include <algorithm>

namespace plumbline::dataset {

std::optional<Chunk> read_chunk_head(const BinaryFile& file, std::uint64_t at, std::uint64_t size) {
  constexpr std::size_t kMostHead = 64;  // fits the name of a compression of up to 24 letters
  std::array<std::uint8_t, kMostHead> head{};
  const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(size, kMostHead));
  if (!file.read(at, head.data(), count)) return std::nullopt;

  // Fields in the order of the format
  McapFields fields(head.data(), count);
  Chunk chunk;
  fields.skip(2 * sizeof(std::uint64_t));  // first and last time
  chunk.plain_size = fields.number<std::uint64_t>();
  chunk.crc = fields.number<std::uint32_t>();
  const std::string compression = fields.text();
  chunk.data_size = fields.number<std::uint64_t>();
  chunk.data_at = at + fields.position();
  if (!fields.good() || chunk.data_size > size - fields.position()) return std::nullopt;

  // Unknown compressions are reported by name
  if (compression == "zstd") {
    chunk.compression = Compression::kZstd;
  } else if (compression == "lz4") {
    chunk.compression = Compression::kLz4;
  } else if (!compression.empty() && compression != "none") {
    chunk.unknown = compression;
  }

  // Uncompressed chunks have equal sizes
  const bool stored_plain = chunk.compression == Compression::kNone && chunk.unknown.empty();
  if (stored_plain && chunk.plain_size != chunk.data_size) return std::nullopt;
  return chunk;
}

}  // namespace plumbline::dataset
