// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose from appearance alone: descriptors against keyframes, then P3P in RANSAC; or, without any feature, the
// small image against those of the keyframes.
#include <cstdint>
#include <optional>
#include <vector>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::tracking {

struct Relocalisation {
  core::KeyframeId keyframe;  ///< most similar keyframe
  geometry::Rigid3 camera_from_world;
  int inliers = 0;
};

/// Tries the keyframes `candidates` in turn (the most promising first) and returns the one with most inliers,
/// if any has at least `min_inliers`. Deterministic.
std::optional<Relocalisation> relocalise(const maps::Map& map,
                                         const std::vector<core::KeyframeId>& candidates,
                                         const features::FrameFeatures& features,
                                         const sensor::Pinhole& camera, int min_inliers);

/// A keyframe and its similarity to the whole image: normalised correlation of the thumbnails, best over
/// shifts of up to a fifth of the image (compare Klein & Murray, ECCV 2008).
struct LookAlike {
  core::KeyframeId keyframe;
  double correlation = 0.0;
};

/// Up to `count` of `candidates` that are similar to the image, most similar first. None for an image without
/// contrast.
std::vector<LookAlike> look_alikes(const maps::Map& map, const std::vector<core::KeyframeId>& candidates,
                                   const features::FrameFeatures& features, int count);

/// Pose from aligning the thumbnail with a keyframe's. Thumbnails of different places can be similar:
/// landmarks and surfaces must confirm the pose.
geometry::Rigid3 align_look_alike(const maps::Map& map, core::KeyframeId keyframe,
                                  const features::FrameFeatures& features, const sensor::Pinhole& camera);

}  // namespace plumbline::tracking
