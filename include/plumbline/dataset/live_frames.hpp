// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames that come one by one, of a camera or of another program, as a recording that grows.
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "plumbline/dataset/live_frame_source.hpp"

namespace plumbline::dataset {

struct LiveCamera;

struct LiveFramesOptions {
  std::string name = "live";
  std::size_t most_waiting_bytes = kMostWaitingBytes;
};

/// One pair of images from a camera.
struct LiveFrame {
  double stamp = 0.0;                 ///< stamp of colour, seconds
  std::optional<double> depth_stamp;  ///< as the camera stamps it, without its depth_delay_s; none: `stamp`
  /// CV_8UC3 (BGR) or CV_8UC1, of the camera's size.
  cv::Mat color;
  /// CV_16UC1 in units of 1 / depth_scale metres, or CV_32FC1 in metres, which are rounded to such units; 0
  /// and values that are not finite mean no measurement. Of the depth camera's size.
  cv::Mat depth;
  std::optional<geometry::Rigid3> odometry;  ///< world_from_camera by the recorder's own odometry
};

/// A frame of a recording, as the camera gave it: LiveFrames of source.camera() makes the same frame from it.
/// Errors (kInput): cannot be read, or the source has no stored images.
core::Result<LiveFrame> stored_frame(const FrameSource& source, std::size_t index);

/// Thread-safe: one thread pushes, others read a recording() of them.
class LiveFrames {
 public:
  explicit LiveFrames(const sensor::Camera& camera, LiveFramesOptions options = {});
  /// Images as the camera took them; they are undistorted and registered when read. They are copied. Errors
  /// (kInput): an image of another kind or size, depth that is NaN everywhere, a stamp that is not after the
  /// last one, or after close(); too many frames wait (wait_for_room).
  core::Result<void> push(const LiveFrame& frame);
  /// No more frames will come.
  void close();
  /// Abandons the run, because its result is not needed: it ends with an error as soon as it can.
  void abandon();

  /// Number of frames that have arrived and are not being worked on yet.
  [[nodiscard]] std::size_t waiting() const;
  /// Waits until fewer than `most` frames wait, and fewer bytes than most_waiting_bytes, at most this long;
  /// false on timeout.
  [[nodiscard]] bool wait_for_room(std::size_t most, double seconds) const;

  /// The frames as a live source, which outlives this.
  [[nodiscard]] std::unique_ptr<LiveFrameSource> recording() const;

 private:
  sensor::Camera camera_;
  std::shared_ptr<LiveCamera> live_;
};

}  // namespace plumbline::dataset
