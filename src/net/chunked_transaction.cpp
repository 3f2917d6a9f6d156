// SPDX-License-Identifier: BSD-3-Clause
#include "chunked_transaction.hpp"

#include <algorithm>
#include <utility>

#include "plumbline/core/hash.hpp"

namespace plumbline::net {
namespace {

constexpr std::size_t kChunkBytes = 256U << 10U;  // carried by a bad link in a few seconds

std::uint64_t hash_of(const std::uint8_t* bytes, std::size_t size) {
  core::Hash hash;
  hash.bytes(bytes, size);
  return hash.value();
}

}  // namespace

ChunkedTransaction::ChunkedTransaction(maps::StoreStream stream, std::int64_t after,
                                       maps::StoreTransaction transaction)
    : stream_(stream),
      after_(after),
      transaction_(std::move(transaction)),
      checksum_(hash_of(transaction_.rows.data(), transaction_.rows.size())),
      count_(static_cast<std::uint32_t>((transaction_.rows.size() + kChunkBytes - 1) / kChunkBytes)) {}

/// The chunk with its place in the transaction and two hashes.
Chunk ChunkedTransaction::chunk(std::uint32_t index) const {
  Chunk chunk;
  chunk.stream = static_cast<std::uint8_t>(stream_);
  chunk.after = after_;
  chunk.number = transaction_.number;
  chunk.checksum = checksum_;
  chunk.index = index;
  chunk.count = count_;

  const std::vector<std::uint8_t>& rows = transaction_.rows;
  const std::size_t begin = std::min(rows.size(), index * kChunkBytes);
  const std::size_t size = std::min(kChunkBytes, rows.size() - begin);
  chunk.bytes.assign(rows.data() + begin, rows.data() + begin + size);
  chunk.hash = hash_of(chunk.bytes.data(), chunk.bytes.size());
  return chunk;
}

}  // namespace plumbline::net
