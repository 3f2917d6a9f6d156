// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Any recording, published as a camera would.
#include <cstddef>
#include <functional>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/message_stream.hpp"

namespace plumbline::dataset {

struct PlayOptions {
  double pace_hz = 0.0;  ///< frames a second; 0: by their stamps
  bool loop = false;     ///< start again after the last frame; stamps continue
  double wait_s = 10.0;  ///< longest wait for a subscriber before the first frame
  core::StopToken stop;
  std::function<void(std::size_t done, std::size_t total)> progress;  ///< may be empty
};

struct PlaySummary {
  std::size_t published = 0;   ///< frames
  std::size_t unreadable = 0;  ///< frames left out
  double late_s = 0.0;         ///< delay of the latest frame behind its due time
};

/// Publishes the frames of `source`: colour as raw images (JPEG as it is) below /camera/color, depth below
/// /camera/aligned_depth_to_color, or below /camera/depth with /tf_static where it has another camera;
/// 16UC1 where it is in millimetres, else 32FC1 in metres; CameraInfo of both. Stamps are the recording's.
/// Errors: kInput (no frame can be read), those of the sink.
core::Result<PlaySummary> play_recording(const FrameSource& source, MessageSink& sink,
                                         const PlayOptions& options, core::Log& log);

}  // namespace plumbline::dataset
