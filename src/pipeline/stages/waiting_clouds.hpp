// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clouds of a run until their final poses are known.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "plumbline/cloud/cloud_spool.hpp"
#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

/// They wait in a temporary file, those of finished maps where they are stored already. One writer at a time;
/// reading from several threads is safe while nobody writes.
class WaitingClouds {
 public:
  /// Errors (kOutput): no file can be made in the result's folder.
  static core::Result<WaitingClouds> create(const RunContext& context);

  /// The cloud that came with frame `frame`, bytes of cloud::encode_cloud; those of finished maps are where
  /// they are, and it may be null. Its place is size() before the call. Errors (kOutput): disk full.
  core::Result<void> append(const std::vector<std::uint8_t>* compact, std::size_t frame);
  /// As encode_cloud() left it. Errors (kOutput, kInput): it cannot be read back.
  [[nodiscard]] core::Result<cloud::CloudPtr> read(std::size_t place) const;

  [[nodiscard]] std::size_t size() const { return spool_ ? spool_->size() : frames_.size(); }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }  ///< of those in the temporary file

 private:
  explicit WaitingClouds(const StoredMaps* maps) : maps_(maps) {}

  const StoredMaps* maps_ = nullptr;  ///< or else
  std::optional<cloud::CloudSpool> spool_;
  std::vector<std::size_t> frames_;  ///< of the stored clouds, by place
  std::uint64_t bytes_ = 0;
};

}  // namespace plumbline::pipeline
