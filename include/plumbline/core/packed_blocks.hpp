// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Packed bytes that a run puts aside: in a file that vanishes with the process.
#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "plumbline/core/packing.hpp"

namespace plumbline::core {

/// Blocks packed by zstd, by number: 0, 1, 2 ... Those that the file cannot take, for there is none or its
/// disk is full, stay in memory. get() may be called by several threads at once, not beside add().
class PackedBlocks {
 public:
  PackedBlocks() = default;
  PackedBlocks(PackedBlocks&& other) noexcept;
  PackedBlocks& operator=(PackedBlocks&&) = delete;
  PackedBlocks(const PackedBlocks&) = delete;
  PackedBlocks& operator=(const PackedBlocks&) = delete;
  ~PackedBlocks();

  /// A file without a name in `folder`, once.
  void open(const std::filesystem::path& folder);
  /// Returns the block's number.
  std::size_t add(const Bytes& block);
  /// None if the file cannot be read. Throws BadBytes: it was damaged.
  [[nodiscard]] std::optional<Bytes> get(std::size_t number) const;
  [[nodiscard]] std::size_t count() const { return places_.size(); }
  /// Packed, in the file or in memory.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  struct Place {
    off_t offset = 0;
    std::size_t size = 0;
    Bytes packed;  ///< empty: in the file
  };
  [[nodiscard]] bool write(const Place& place) const;

  int file_ = -1;
  off_t end_ = 0;
  std::size_t bytes_ = 0;
  std::vector<Place> places_;
};

}  // namespace plumbline::core
