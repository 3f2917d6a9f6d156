// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames of a round of a camera's path, packed in memory for the rounds that follow. Private to the module.
#include <array>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <vector>

#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/image_io.hpp"

namespace plumbline::synth {

/// Any thread may ask. Frames that do not fit into kMostBytes are not kept: they are rendered again.
class KeptRound {
 public:
  static constexpr std::size_t kMostBytes = std::size_t{1} << 30U;
  explicit KeptRound(std::size_t frames) : frames_(frames) {}

  [[nodiscard]] std::optional<dataset::StoredPair> find(std::size_t index) const {
    Packed packed;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      packed = frames_[index];
    }
    if (packed[0].empty()) return std::nullopt;
    dataset::StoredPair pair;
    pair.color.pixels = cv::imdecode(packed[0], cv::IMREAD_UNCHANGED);
    pair.depth.pixels = cv::imdecode(packed[1], cv::IMREAD_UNCHANGED);
    return pair;
  }

  void keep(std::size_t index, const dataset::StoredPair& pair) {
    auto color = dataset::encode_png(pair.color.pixels, 1), depth = dataset::encode_png(pair.depth.pixels, 1);
    if (!color || !depth) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!frames_[index][0].empty() || bytes_ + color->size() + depth->size() > kMostBytes) return;
    bytes_ += color->size() + depth->size();
    frames_[index] = {std::move(*color), std::move(*depth)};
  }

 private:
  using Packed = std::array<std::vector<std::uint8_t>, 2>;  ///< PNG: colour, depth; empty: not kept
  mutable std::mutex mutex_;
  std::vector<Packed> frames_;
  std::size_t bytes_ = 0;
};

}  // namespace plumbline::synth
