// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The largest planes of a cloud - walls, floor, fronts of cupboards - and how single and straight they are.
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/evaluate/surface.hpp"
#include "plumbline/evaluate/wall_thickness.hpp"

namespace plumbline::evaluate {

struct WallPlanesOptions {
  int planes = 3;        ///< the largest so many are measured
  double slab_m = 0.04;  ///< points within this distance of a plane belong to it
  void declare(core::OptionTable& table);
};

/// One plane through many patches (wall_thickness.hpp). A wall that is doubled shows in `thickness` where
/// both layers lie one behind the other and in `straightness_mm` where one goes over into the other.
struct WallPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< towards where the points face
  double offset_m = 0.0;                              ///< normal . p of its points
  double area_m2 = 0.0;                               ///< of its patches
  WallThickness thickness;                            ///< over its patches
  double straightness_mm = 0.0;  ///< RMS distance of its patches' main layers from the plane
  double slab_rms_mm = 0.0;      ///< RMS distance of all points in the slab: handles, frames and all
  std::size_t points = 0;        ///< in the slab
};

/// Every patch proposes its plane; the one that most patches share (within slab_m, normals within 10 degrees)
/// is fitted to them by least squares, until they stay the same; then the next one among the patches that are
/// left. Largest first; fewer when the cloud has no more. `points`: those the patches were found in, finite.
/// In the slab are points within slab_m that face the plane's way within 30 degrees, if the cloud has
/// normals.
std::vector<WallPlane> wall_planes(const SurfaceSamples& cloud, std::vector<WallPatch> patches,
                                   double patch_m, const WallPlanesOptions& options);

}  // namespace plumbline::evaluate
