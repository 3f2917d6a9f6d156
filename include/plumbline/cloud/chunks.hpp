// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A long array that grows without moving what it holds: no copies, and no room taken for what never comes.
#include <cstddef>
#include <vector>

namespace plumbline::cloud {

template <typename T, std::size_t kChunk = 4096>
class Chunks {
 public:
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t capacity() const { return chunks_.size() * kChunk; }
  T& operator[](std::size_t i) { return chunks_[i / kChunk][i % kChunk]; }
  const T& operator[](std::size_t i) const { return chunks_[i / kChunk][i % kChunk]; }
  /// A new element at the end.
  T& add() {
    const std::size_t chunk = size_ / kChunk;
    if (chunk == chunks_.size()) {
      chunks_.emplace_back();
      chunks_.back().reserve(kChunk);
    }
    ++size_;
    chunks_[chunk].emplace_back();
    return chunks_[chunk].back();
  }
  /// Memory is kept for what comes next.
  void clear() {
    for (std::vector<T>& chunk : chunks_) chunk.clear();
    size_ = 0;
  }

 private:
  std::vector<std::vector<T>> chunks_;
  std::size_t size_ = 0;
};

}  // namespace plumbline::cloud
