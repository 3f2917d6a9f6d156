// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Relative pose of two keyframes from their surfaces: samples of one are aligned, point to plane, with the
// depth image of the other (docs/method/mapping.md), and its grey values with the other's image, for local
// bundle adjustment.
#include <opencv2/core/mat.hpp>
#include <optional>

#include "plumbline/features/photometric.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

struct SurfaceEdgeOptions {
  double min_overlap = 0.25;  ///< share of a's samples that b's depth must confirm
  double max_depth_m = 6.0;   ///< of b
  double hold_m = 0.01;       ///< standard deviation of the start, see align_surface_edge
};

/// Image evidence of two keyframes besides their surfaces; unused if one of them is null.
struct EdgeImages {
  const features::PhotometricSamples* of_a = nullptr;
  const features::PhotometricImage* of_b = nullptr;
};

/// Aligns `a` with `b`, starting at `b_from_a`. `depth_of_b`: b's depth image (CV_32FC1, metres);
/// `depth_from_camera` transforms from b's colour camera to its depth camera. The start is held to `hold_m`
/// metres, and rotation to the same motion at the middle of the common view: along directions that the
/// surfaces leave free, such as a wall's length, the alignment would otherwise slide by decimetres on noise
/// alone, and an edge that has slid is wrong in the held directions, too. The edge itself is freed of this
/// hold, so that only the surfaces count in the directions that they constrain. None if they overlap by less
/// than min_overlap.
std::optional<maps::SurfaceEdge> align_surface_edge(
    const maps::Keyframe& a, core::KeyframeId b, const cv::Mat& depth_of_b, const geometry::Rigid3& b_from_a,
    const geometry::Rigid3& depth_from_camera, const sensor::Pinhole& camera,
    const SurfaceEdgeOptions& options, const EdgeImages& images = {});

}  // namespace plumbline::mapping
