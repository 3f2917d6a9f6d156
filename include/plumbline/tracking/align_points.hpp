// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Aligns matched corners, to a tenth of a pixel, with the patch of their landmark when it was first seen.
#include <optional>
#include <vector>

#include "plumbline/tracking/association.hpp"

namespace plumbline::tracking {

/// Sets `shift` and `aligned` of matches whose landmark was seen by a keyframe from nearly the same side and
/// distance (oldest first), if the images agree (features::align_patch); clears those of the others. `frame`
/// needs its levels.
void align_points(const maps::Map& map, const features::FrameFeatures& frame, const sensor::Pinhole& camera,
                  const geometry::Rigid3& camera_from_world, double scale_factor,
                  std::vector<PointMatch>& matches);

/// An image pyramid, and a guess of its pose. What it refers to must outlive it.
struct PosedImage {
  const std::vector<cv::Mat>& levels;
  const sensor::Pinhole& camera;
  const geometry::Rigid3& camera_from_world;
  double scale_factor;  ///< of the ORB pyramid
};

/// Position in an image of the corner that a keyframe saw of what lies at
/// `position`, pixels of the full image; `start`: expected position, to two pixels of the corner's octave.
/// None if the keyframe saw it too differently, or the images do not agree.
std::optional<Eigen::Vector2f> align_observation(const maps::Map& map, const maps::Observation& seen,
                                                 const Eigen::Vector3d& position, const PosedImage& image,
                                                 const Eigen::Vector2f& start);

}  // namespace plumbline::tracking
