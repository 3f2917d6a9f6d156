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
  int planes = 3;        ///< number of planes to measure, the largest ones
  double slab_m = 0.04;  ///< points within this distance of a plane belong to it
  void declare(core::OptionTable& table);
};

/// One plane through many patches (wall_thickness.hpp). A double wall increases `thickness` where both layers
/// lie behind one another, and `straightness_mm` where one layer continues in the other.
struct WallPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< towards the side that the points face
  double offset_m = 0.0;                              ///< normal . p of its points
  double area_m2 = 0.0;                               ///< total area of its patches
  WallThickness thickness;                            ///< over its patches
  double straightness_mm = 0.0;  ///< RMS distance of its patches' main layers from the plane
  double slab_rms_mm = 0.0;      ///< RMS distance of all points in the slab: handles, frames and all
  std::size_t points = 0;        ///< in the slab
};

/// Every patch proposes its plane; the one that most patches share (within slab_m, normals within 10 degrees)
/// is fitted to them by least squares, until its patches stay the same; then the next one among the remaining
/// patches. Largest first; fewer if the cloud has no more. `cloud`: the points in which the patches were
/// found, all finite. The slab holds points within slab_m that, if the cloud has normals, face the same way
/// as the plane within 30 degrees.
std::vector<WallPlane> wall_planes(const SurfaceSamples& cloud, std::vector<WallPatch> patches,
                                   double patch_m, const WallPlanesOptions& options);

}  // namespace plumbline::evaluate
