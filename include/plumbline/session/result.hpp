// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The result of a run. All positions are metres in one frame: z up, 0 on the floor, x along the walls, if
// these were found.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline {

/// The trust in a result; numbers without a value are not known.
struct Verdict {
  std::string sentence;  ///< "Shape ± 8 mm (95 %: 15 mm), lengths 0.4 %; scale unchecked."
  bool trustworthy = false;
  std::string reason;                  ///< why not; empty: it may be trusted
  std::optional<double> expected_m;    ///< error of the shape to expect
  std::optional<double> p95_m;         ///< its 95th percentile
  std::optional<double> lengths;       ///< relative error of lengths
  std::vector<std::string> unchecked;  ///< what nothing tells: "scale"
  double tracked = 0.0;                ///< share of the frames that show something, 0 to 1
  double lost_s = 0.0;                 ///< seconds without a pose although something was seen
};

struct Keyframe {
  std::string robot;        ///< its name
  std::int32_t number = 0;  ///< as in keyframes.csv; each robot has its own
  double stamp = 0.0;       ///< seconds
  geometry::Rigid3 world_from_camera;
  /// Covariance of the position (m) and of small turns about the world's axes (rad), relative to the first
  /// keyframe; none: not known.
  std::optional<geometry::Matrix6d> covariance;
  std::string no_covariance;  ///< why there is none
};

/// A result folder, read when it is asked. Cheap to copy; const calls may come from several threads.
class Result {
 public:
  /// That of an earlier run. Errors (kInput): it is not one. `kept` goes with the last copy of the result.
  static core::Result<Result> open(const std::filesystem::path& folder, std::shared_ptr<void> kept = nullptr);

  [[nodiscard]] const std::filesystem::path& folder() const;
  [[nodiscard]] const Verdict& verdict() const;
  /// Robots with a path of their own, by name; one that is alone has the name "".
  [[nodiscard]] std::vector<std::string> robots() const;

  /// The merged cloud, with colours, normals and confidence. Errors (kInput): the run wrote none.
  [[nodiscard]] core::Result<cloud::CloudFile> cloud() const;
  /// world_from_camera of the tracked frames of a robot; "": the only one. Errors (kInput): no such robot.
  [[nodiscard]] core::Result<geometry::Trajectory> path(const std::string& robot = {}) const;
  /// The camera as the run used it at last. Errors as of path().
  [[nodiscard]] core::Result<sensor::Camera> camera(const std::string& robot = {}) const;
  /// By robot and number. Errors (kInput): the run kept no map.db (store.enabled=off).
  [[nodiscard]] core::Result<std::vector<Keyframe>> keyframes() const;
  /// CV_8UC3 (BGR), rectified: from the recording if that is still in its place, else as map.db has it, which
  /// is 160 pixels wide for recordings. Errors (kInput): neither has it.
  [[nodiscard]] core::Result<cv::Mat> picture(const Keyframe& keyframe) const;

 private:
  struct Impl;
  explicit Result(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace plumbline
