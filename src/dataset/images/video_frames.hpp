// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames of a video by their number. The decoder is a separate part (core/part.hpp): OpenCV's brings
// FFmpeg.
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>

#include "plumbline/core/error.hpp"
#include "plumbline/core/part.hpp"

namespace plumbline::dataset {

struct VideoDecoder {
  static constexpr const char* kPart = "video";
  static constexpr std::uint64_t layout() { return core::layout_of<VideoDecoder, cv::Mat>(); }

  void* (*open)(const char* file);  ///< null when it cannot be decoded
  void (*close)(void* video);
  std::int64_t (*count)(void* video);  ///< number of frames, as the file says
  bool (*seek)(void* video, std::int64_t frame);
  bool (*skip)(void* video);
  bool (*next)(void* video, cv::Mat& image);  ///< CV_8UC3, BGR
};

/// One open video. Read best in order, or nearly so. Thread-safe.
class VideoFrames {
 public:
  explicit VideoFrames(std::string file);
  ~VideoFrames();
  VideoFrames(const VideoFrames&) = delete;
  VideoFrames& operator=(const VideoFrames&) = delete;

  /// CV_8UC3, BGR. Error (kInput): the video cannot be decoded, or ends before that frame.
  core::Result<cv::Mat> read(std::int64_t frame);
  /// Number of frames according to the file. Error (kInput): the video cannot be decoded.
  core::Result<std::int64_t> count();

 private:
  core::Result<void> open();
  bool go_to(std::int64_t frame);

  std::string file_;
  std::mutex mutex_;
  const VideoDecoder* decoder_ = nullptr;
  void* video_ = nullptr;
  std::int64_t next_ = 0;
  std::map<std::int64_t, cv::Mat> recent_;  ///< the last few, because frames are requested out of order
};

}  // namespace plumbline::dataset
