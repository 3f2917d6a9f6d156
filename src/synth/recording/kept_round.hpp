// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames of a round of a camera's path, packed in memory for the rounds that follow. Private to the module.
#include <algorithm>
#include <array>
#include <mutex>
#include <optional>
#include <vector>

#include "plumbline/core/packing.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::synth {

/// Safe to call from any thread. Frames that do not fit into kMostBytes are not kept: they are rendered
/// again.
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

    // Unpacking needs no lock.
    if (packed[0].bytes.empty()) return std::nullopt;
    dataset::StoredPair pair;
    pair.color.pixels = packed[0].image();
    pair.depth.pixels = packed[1].image();
    return pair;
  }

  void keep(std::size_t index, const dataset::StoredPair& pair) {
    // Packing needs no lock.
    Packed packed{PackedImage(pair.color.pixels), PackedImage(pair.depth.pixels)};
    const std::size_t size = packed[0].bytes.size() + packed[1].bytes.size();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!frames_[index][0].bytes.empty() || bytes_ + size > kMostBytes) return;
    bytes_ += size;
    frames_[index] = std::move(packed);
  }

 private:
  struct PackedImage {
    PackedImage() = default;
    explicit PackedImage(const cv::Mat& image) : size(image.size()), type(image.type()) {
      const cv::Mat whole = image.isContinuous() ? image : image.clone();
      bytes = core::pack(core::Bytes(whole.data, whole.data + whole.total() * whole.elemSize()));
    }
    [[nodiscard]] cv::Mat image() const {
      cv::Mat image(size, type);
      const core::Bytes whole = core::unpack(bytes.data(), bytes.size());
      std::copy(whole.begin(), whole.end(), image.data);
      return image;
    }
    cv::Size size;
    int type = 0;
    core::Bytes bytes;  ///< empty: not kept
  };
  using Packed = std::array<PackedImage, 2>;  ///< colour, depth

  mutable std::mutex mutex_;
  std::vector<Packed> frames_;
  std::size_t bytes_ = 0;
};

}  // namespace plumbline::synth
