// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose from nothing but what the picture looks like: descriptors against keyframes, then P3P in RANSAC.
#include <cstdint>
#include <optional>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::tracking {

struct Relocalisation {
  core::KeyframeId keyframe;  ///< that the frame looks like
  geometry::Rigid3 camera_from_world;
  int inliers = 0;
};

/// Tries the keyframes `candidates` in turn (the most promising first) and returns the one with most inliers,
/// if any has at least `min_inliers`. Deterministic.
std::optional<Relocalisation> relocalise(const maps::Map& map,
                                         const std::vector<core::KeyframeId>& candidates,
                                         const features::FrameFeatures& features,
                                         const sensor::Pinhole& camera, int min_inliers);

}  // namespace plumbline::tracking
