// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clouds that wait on disk instead of in memory.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "plumbline/cloud/compact_cloud.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"

namespace plumbline::cloud {

/// A temporary file of compact clouds. It has no name: whatever ends the program, nothing stays behind. One
/// writer at a time; reading from several threads is safe while nobody writes.
class CloudSpool {
 public:
  /// Makes the file in `folder`, which must exist. Errors (kOutput).
  static core::Result<CloudSpool> create(const std::filesystem::path& folder,
                                         const CompactCloudOptions& options = {});
  CloudSpool(CloudSpool&& other) noexcept;
  CloudSpool& operator=(CloudSpool&&) = delete;
  ~CloudSpool();

  /// Appends a cloud; its number is size() before the call. Errors (kOutput): disk full.
  core::Result<void> append(const Cloud& cloud);
  /// The same for bytes of encode_cloud().
  core::Result<void> append(const std::vector<std::uint8_t>& compact);
  /// Cloud `index` as encode_cloud() left it. Errors (kOutput): the file cannot be read back.
  [[nodiscard]] core::Result<CloudPtr> read(std::size_t index) const;
  /// The bytes of cloud `index`. Errors (kOutput).
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> read_compact(std::size_t index) const;

  [[nodiscard]] std::size_t size() const { return places_.size(); }
  [[nodiscard]] std::uint64_t bytes() const { return end_; }  ///< on disk

 private:
  struct Place {
    std::uint64_t offset = 0;
    std::size_t size = 0;
  };
  CloudSpool(std::filesystem::path folder, const CompactCloudOptions& options, int descriptor);

  std::filesystem::path folder_;  ///< for messages
  CompactCloudOptions options_;
  int descriptor_ = -1;
  std::uint64_t end_ = 0;
  std::vector<Place> places_;
};

}  // namespace plumbline::cloud
