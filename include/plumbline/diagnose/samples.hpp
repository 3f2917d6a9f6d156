// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames of a recording that are kept while it is read, so that mistakes made with it can be recognised at
// the end.
#include <cstddef>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::diagnose {

/// A frame, reduced to 320 pixels across.
struct Sample {
  std::size_t index = 0;  ///< in the recording
  double stamp = 0.0;     ///< of colour, seconds
  cv::Mat gray;           ///< CV_8UC1, of the frame's own size
  cv::Mat depth;          ///< CV_32FC1, metres, every n-th pixel; 0: no measurement
};

/// Each frame's picture and inverse depth in a few pixels: what moves, without what it is.
struct Thumbnail {
  std::size_t index = 0;
  double stamp = 0.0;        ///< of colour, seconds
  double depth_stamp = 0.0;  ///< seconds
  cv::Mat gray;              ///< CV_32FC1
  cv::Mat inverse;           ///< CV_32FC1, 1/m; mean of the measured pixels, 0: none
};

/// Frames of one recording: eight groups evenly spaced, each of frames 0, 1, 7 and 20 after its first, and
/// thumbnails of up to five stretches of 120 frames. About 20 MB. add() may be called from several threads
/// and in any order.
class Samples {
 public:
  /// `frames`: number of frames of the recording; 0: not known (live). Then groups follow each other by 300
  /// frames.
  Samples(const sensor::Pinhole& camera, std::size_t frames);
  void add(const sensor::RgbdFrame& frame);

  [[nodiscard]] const sensor::Pinhole& camera() const { return camera_; }  ///< of the pictures
  [[nodiscard]] const sensor::Pinhole& depth_camera() const { return depth_camera_; }
  [[nodiscard]] std::vector<Sample> samples() const;        ///< by index
  [[nodiscard]] std::vector<Thumbnail> thumbnails() const;  ///< by index
  /// Numbers of the frames that are kept as samples, sorted; to read no others.
  [[nodiscard]] std::vector<std::size_t> wanted() const;

 private:
  [[nodiscard]] bool wants_sample(std::size_t index) const;
  [[nodiscard]] bool wants_thumbnail(std::size_t index) const;
  sensor::Pinhole camera_;
  sensor::Pinhole depth_camera_;
  int step_ = 1;
  std::size_t frames_ = 0;
  mutable std::mutex mutex_;  ///< of what follows
  std::vector<Sample> samples_;
  std::vector<Thumbnail> thumbnails_;
};

}  // namespace plumbline::diagnose
