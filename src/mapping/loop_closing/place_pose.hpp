// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose of one image from matches with another that have depth: P3P, or two lines in space, in RANSAC.
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "plumbline/features/line_segment.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

struct PointPair {
  Eigen::Vector3d match = Eigen::Vector3d::Zero();  ///< metres, camera of the match
  Eigen::Vector2d query = Eigen::Vector2d::Zero();  ///< pixel
  double sigma = 1.0;                               ///< pixels
  double depth = 0.0;                               ///< measured in the query, metres; 0: none
};

struct LinePair {
  Eigen::Vector3d match_start = Eigen::Vector3d::Zero();  ///< metres, camera of the match
  Eigen::Vector3d match_end = Eigen::Vector3d::Zero();
  features::LineSegment query;  ///< pixels
  bool in_space = false;        ///< the query's line has depth
  Eigen::Vector3d query_start = Eigen::Vector3d::Zero();
  Eigen::Vector3d query_end = Eigen::Vector3d::Zero();
};

struct PosePairs {
  std::vector<PointPair> points;
  std::vector<LinePair> lines;
};

struct RansacPose {
  geometry::Rigid3 query_from_match;
  std::vector<int> points;  ///< inliers
  std::vector<int> lines;
};

/// The pose with which most pairs agree; none if fewer than `min_inliers` do. Samples are three points, or
/// two lines in space if there are few points. Same seed, same result.
std::optional<RansacPose> ransac_pose(const PosePairs& pairs, const sensor::Pinhole& camera, int max_rounds,
                                      int min_inliers, std::uint64_t seed);

}  // namespace plumbline::mapping
