// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Maps frames as they come, of a camera or of any other source.
#include <cstddef>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/pipeline/live_pose.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/session/options.hpp"
#include "plumbline/session/result.hpp"

namespace plumbline {

/// One pair of images from a camera.
struct Frame {
  double stamp = 0.0;                 ///< of colour, seconds
  std::optional<double> depth_stamp;  ///< as the camera stamps it, without its depth_delay_s; none: `stamp`
  cv::Mat color;                      ///< CV_8UC3 (BGR) or CV_8UC1, of the camera's size
  /// CV_16UC1 in units of 1 / depth_scale metres, or CV_32FC1 in metres; 0 and values that are not finite
  /// mean no measurement. Of the depth camera's size.
  cv::Mat depth;
  std::optional<geometry::Rigid3> odometry;  ///< world_from_camera by the source's own odometry
};

using Tracked = pipeline::LivePose;  ///< pose and state of a frame, as soon as it is tracked

/// Push frames from one thread; all else may be called from any. The result has the bytes of `plumbline map`
/// of the same frames, but for names.
class Mapper {
 public:
  /// `output` empty: a temporary folder, as of map(). Errors: kUsage (camera, queue), kOutput. Those of
  /// pipeline and output folder come from push() and finish().
  static core::Result<Mapper> start(const sensor::Camera& camera, const std::filesystem::path& output = {},
                                    const MapperOptions& options = {});
  Mapper(Mapper&& other) noexcept;
  Mapper& operator=(Mapper&& other) noexcept;
  ~Mapper();  ///< cancels a run that is not finished

  /// The frame's number; none: it was dropped, as the queue is full (MapperOptions::drop_late). The images
  /// are copied. Errors (kInput): an image of another kind or size than the camera's, depth that is NaN
  /// everywhere, a stamp that is not later than the last one's; the frame is then left out, and others can be
  /// pushed. If the run has ended: why.
  core::Result<std::optional<std::size_t>> push(const Frame& frame);
  /// Waits until push() would not wait, at most this long; false on timeout.
  [[nodiscard]] bool wait_for_room(double seconds) const;
  /// The tracker's result for a frame; none if it has not come within this time.
  [[nodiscard]] std::optional<Tracked> pose(std::size_t number, double seconds = 0.0) const;

  [[nodiscard]] std::size_t waiting() const;  ///< frames that were pushed and are not read yet
  [[nodiscard]] std::size_t dropped() const;  ///< frames that push() has dropped

  /// No more frames will come: the run finishes in the background.
  void close();
  /// Waits until the run has ended, at most this long; false on timeout.
  [[nodiscard]] bool wait(double seconds) const;
  /// Closes, waits for the end and opens the result; a second call gives the same one. Errors as of map().
  core::Result<Result> finish();
  /// Ends the run; nothing is written.
  void cancel();

 private:
  struct Impl;
  explicit Mapper(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace plumbline
