// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/chunks.hpp"

#include <libdeflate.h>

#include <algorithm>
#include <array>

namespace plumbline::dataset {

tl::expected<Bytes, std::string> read_chunk(const BinaryFile& file, const Chunk& chunk) {
  // Sizes of damaged chunks are not allocated
  if (chunk.plain_size > kMostChunkBytes || chunk.data_size > kMostChunkBytes)
    return tl::unexpected<std::string>("is too large");
  Bytes packed(static_cast<std::size_t>(chunk.data_size));
  if (!file.read(chunk.data_at, packed.data(), packed.size()))
    return tl::unexpected<std::string>("cannot be read");

  // Uncompressed data are used as they are
  Bytes plain;
  if (chunk.compression == Compression::kNone) {
    plain = std::move(packed);
  } else if (!inflate_all(chunk.compression, packed.data(), packed.size(), chunk.plain_size, plain)) {
    return tl::unexpected<std::string>("cannot be unpacked");
  }
  if (plain.size() != chunk.plain_size) return tl::unexpected<std::string>("ends too early");

  // Writers without a checksum store 0
  if (chunk.crc != 0 && libdeflate_crc32(0, plain.data(), plain.size()) != chunk.crc)
    return tl::unexpected<std::string>("does not fit its checksum");
  return plain;
}

ChunkCursor::ChunkCursor(const BinaryFile& file, const Chunk& chunk) : file_(file), chunk_(chunk) {
  if (chunk.compression == Compression::kNone || chunk.data_size > kMostChunkBytes) return;
  packed_.resize(static_cast<std::size_t>(chunk.data_size));
  if (!file.read(chunk.data_at, packed_.data(), packed_.size())) packed_.clear();
  inflater_ = make_inflater(chunk.compression, packed_.data(), packed_.size());
}

/// Decompresses up to the position to which records were skipped.
bool ChunkCursor::catch_up() {
  std::array<std::uint8_t, std::size_t{1} << 16> scratch;
  while (unpacked_ < position_) {
    const auto step =
        static_cast<std::size_t>(std::min<std::uint64_t>(scratch.size(), position_ - unpacked_));
    if (inflater_->get(scratch.data(), step) != step) return false;
    unpacked_ += step;
  }
  return true;
}

bool ChunkCursor::get(std::uint8_t* to, std::size_t count) {
  // Records must end within their chunk
  if (position_ > chunk_.plain_size || count > chunk_.plain_size - position_) return false;
  if (chunk_.compression == Compression::kNone) {
    if (!file_.read(chunk_.data_at + position_, to, count)) return false;
  } else {
    if (inflater_ == nullptr || !catch_up() || inflater_->get(to, count) != count) return false;
    unpacked_ += count;
  }
  position_ += count;
  return true;
}

}  // namespace plumbline::dataset
