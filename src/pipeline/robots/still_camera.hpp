// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Tells a camera that stands still before a scene in which nothing moves, so that an hour of it adds nothing
// to a map.
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::pipeline {

class StillCamera {
 public:
  /// To be called for every frame in turn. True once neither the camera nor the depth of the scene has
  /// changed for longer than kFrames. `depth`: metres, 0 where nothing was measured.
  bool stands_still(const geometry::Rigid3& camera_from_world, const cv::Mat& depth);
  /// The frame has no pose: nothing is known of its motion.
  void lose() { frames_ = 0; }

 private:
  /// Long enough for clouds and free-space views at their default rates (every tenth and third frame).
  static constexpr int kFrames = 30;

  geometry::Rigid3 camera_from_world_;  ///< of the first frame that stands still
  std::vector<float> nearest_;          ///< depths of its cells, metres
  int frames_ = 0;                      ///< in a row that show what the first one did
};

}  // namespace plumbline::pipeline
