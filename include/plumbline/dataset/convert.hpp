// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Any recording that can be read, as a TUM folder or as an MCAP file.
#include <cstddef>
#include <filesystem>
#include <functional>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/body_readings.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

struct ConvertOptions {
  bool replace = false;  ///< an earlier copy
  /// Written to MCAP files as /imu (sensor_msgs/Imu), /odom (nav_msgs/Odometry) and /tf_static.
  const BodyReadings* body = nullptr;
  std::function<bool()> stop;  ///< called before each frame: true ends the copy there; may be empty
  std::function<void(std::size_t)> progress;  ///< frames written so far; may be empty
};

struct ConvertSummary {
  std::size_t written = 0;     ///< frames
  std::size_t unreadable = 0;  ///< frames left out
  bool stopped = false;
};

/// Writes the frames of `source` to `out`: an MCAP file where it ends in ".mcap" (colour as raw images, JPEG
/// as it is; depth as 16UC1 millimetres or 32FC1 metres; CameraInfo, /tf_static, chunks of zstd, and the
/// whole camera file in a metadata record), else a TUM folder (images as they are stored, float depth as
/// float TIFF, camera.yaml, groundtruth.txt if there is truth). Mapping the copy gives the bytes of the
/// original. A frame with an image that cannot be read, is of another size or kind than the camera's, or is
/// behind a link out of the recording's folder is left out and counted; warnings name the first five. Memory
/// does not grow with the recording; `out` appears when all is written. Errors: kUsage
/// (`out` exists and was not written by this function, or has an ending of files that are not
/// written), kInput (no frame can be copied), kOutput.
core::Result<ConvertSummary> convert_recording(const FrameSource& source, const std::filesystem::path& out,
                                               const ConvertOptions& options, core::Log& log);

}  // namespace plumbline::dataset
