// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The part of the map that the camera can be expected to see.
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::tracking {

/// A surface sample in world coordinates.
struct WorldSurface {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double sigma = 0.01;
};

struct LocalMapOptions {
  int keyframes = 12;         ///< number of keyframes whose landmarks are tracked
  int surface_keyframes = 4;  ///< number of keyframes whose surfaces are used
  double voxel_m = 0.03;      ///< surface samples of all these are fused within
  double overlap_angle_rad = 0.6;
  double max_surface_depth_m = 6.0;  ///< the mapper's option surface.max_depth
  void declare(core::OptionTable& table);
};

struct LocalMap {
  core::KeyframeId reference;
  std::vector<core::KeyframeId> keyframes;  ///< the reference first
  std::vector<core::PointId> points;        ///< sorted, unique
  std::vector<core::LineId> lines;
  std::vector<WorldSurface> surface;  ///< interleaved, so that any prefix is spread over all keyframes
  double max_surface_depth_m = 6.0;   ///< depth beyond it is not aligned with `surface`
};

/// Keyframes that share landmarks with `reference`, filled up with the latest ones that face the same way
/// (without texture, nothing else shows that they overlap); their landmarks and surfaces.
LocalMap build_local_map(const maps::Map& map, core::KeyframeId reference, const LocalMapOptions& options);

}  // namespace plumbline::tracking
