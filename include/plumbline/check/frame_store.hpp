// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Small pictures of some frames of a path, kept in a temporary file until the path is final.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/packed_blocks.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::check {

constexpr double kDepthUnits_per_m = 4000.0;  ///< of small pictures
constexpr int kWidth_px = 320;                ///< of small pictures; narrower ones keep their size

/// Columns and rows of a camera's small pictures.
cv::Size small_size(const sensor::Pinhole& camera);

/// One frame, at most 320 pixels wide.
struct SmallFrame {
  double stamp = 0.0;        ///< of colour, seconds
  double depth_stamp = 0.0;  ///< of depth, seconds; the camera's delay is in it
  cv::Mat gray;              ///< CV_8UC1, mean of the pixels that each one stands for
  cv::Mat depth;  ///< CV_16UC1, quarters of a millimetre along z, 0 = none (beyond 16 m, too): of one pixel,
                  ///< grid_pixel()
};

/// The pixel of the whole picture, `of` wide or high, whose depth the small one, `to` wide or high, has at
/// `at`.
inline int grid_pixel(int at, int of, int to) {
  return static_cast<int>(((2 * std::int64_t{at} + 1) * of) / (2 * std::int64_t{to}));
}

/// `camera`: of the rectified frame.
SmallFrame shrink(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera);

/// Which frames of a path are kept: anchors a third of a second apart, and the frame after every third one.
class FrameChoice {
 public:
  enum class Use { kNone, kAnchor, kNext };
  /// Stamps come in order, seconds.
  Use next(double stamp);

 private:
  double last_ = 0.0;
  double anchor_ = 0.0;
  std::size_t frames_ = 0;
  std::size_t anchors_ = 0;
  bool wants_next_ = false;
};

/// Frames, packed (less than 200 kB each) as core::PackedBlocks keeps them. read() may be called by several
/// threads at once, not beside add().
class FrameStore {
 public:
  /// `folder`: where its file without a name is made.
  explicit FrameStore(const std::filesystem::path& folder) { blocks_.open(folder); }

  /// Returns the frame's number: 0, 1, 2 ...
  std::size_t add(const SmallFrame& frame);
  /// Error (kOutput): it cannot be read back.
  [[nodiscard]] core::Result<SmallFrame> read(std::size_t number) const;
  [[nodiscard]] std::size_t size() const { return headers_.size(); }

 private:
  struct Header {
    double stamp = 0.0;
    double depth_stamp = 0.0;
    cv::Size size;
  };
  core::PackedBlocks blocks_;
  std::vector<Header> headers_;
};

}  // namespace plumbline::check
