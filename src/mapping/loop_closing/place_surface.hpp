// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Surface evidence about a supposed place: samples that are confirmed, or seen through.
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

/// Votes of one keyframe's surface samples on the depth that another one measured.
struct SurfaceVotes {
  int confirmed = 0;
  int contradicted = 0;  ///< the other camera saw something clearly behind the sample
  int hidden = 0;        ///< behind the other camera's surface: no evidence
  SurfaceVotes& operator+=(const SurfaceVotes& o);
  [[nodiscard]] double overlap() const;        ///< confirmed, of all in view
  [[nodiscard]] double contradiction() const;  ///< contradicted, of those not hidden
};

/// `samples` of a keyframe against the small depth image (FrameFeatures::thumbnail_depth) of another one.
/// Whatever lies between the depths of neighbouring small pixels is confirmed, so that borders and slopes do
/// not count against.
SurfaceVotes vote_surface(const std::vector<maps::SurfaceSample>& samples,
                          const geometry::Rigid3& other_from_own, const cv::Mat& other_depth,
                          const sensor::Pinhole& other_camera);

/// Surfaces of keyframes in the camera frame of `anchor`.
std::vector<maps::SurfaceSample> gather_surface(const maps::Map& map,
                                                const std::vector<core::KeyframeId>& keyframes,
                                                core::KeyframeId anchor);

}  // namespace plumbline::mapping
