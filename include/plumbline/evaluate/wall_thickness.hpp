// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Thickness of flat walls in a cloud, from the cloud alone.
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/evaluate/surface.hpp"

namespace plumbline::evaluate {

struct WallThicknessOptions {
  double patch_m = 0.25;        ///< edge of a planar patch
  double cell_m = 0.05;         ///< edge of the cells it is measured in (more where the cloud is sparser)
  double max_spacing_m = 0.10;  ///< layers further apart are two walls
  double flatness_m = 0.02;     ///< a patch's main layer stays within this of a plane
  void declare(core::OptionTable& table);
};

/// Definition. The cloud is cut into voxels of `patch_m`; in each the main plane is found by RANSAC. Points
/// within max_spacing_m of that plane, and facing its way if the cloud has normals, are divided along the
/// plane into cells of `cell_m`. In a cell with one layer the thickness t is the RMS spread along the normal;
/// in a cell with two layers (1-D two-means; means at least 0.1 mm and four times the spread of either apart,
/// each with a tenth of the points) t = sqrt(s^2 + d^2), s the RMS spread within the layers and d their
/// separation, so that a doubled wall counts with its whole spacing, however many points each layer has. A
/// patch's thickness is the median over its cells, which passes over corners and things that stand before the
/// wall.
struct WallThickness {
  std::size_t patches = 0;
  double rms_mm = 0.0;  ///< over patches: sqrt(mean t^2)
  double mean_mm = 0.0;
  double median_mm = 0.0;
  double p90_mm = 0.0;
  double layered_percent = 0.0;  ///< share of patches where most cells have two layers
};

/// A flat piece of a cloud, about patch_m wide.
struct WallPatch {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   ///< on the main layer
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< towards where most of its points face
  double thickness_m = 0.0;
  bool layered = false;  ///< most of its cells have two layers
};

/// The patches that count, in the order of their voxels. `spacing_m`: typical distance to the nearest
/// neighbour. Points must be finite.
std::vector<WallPatch> wall_patches(const SurfaceSamples& cloud, double spacing_m,
                                    const WallThicknessOptions& options, const core::Executor& executor);

WallThickness thickness_of(const std::vector<WallPatch>& patches);

}  // namespace plumbline::evaluate
