// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The views of a whole run as one cloud with thin, single walls.
//
// Views are fused in a voxel map tile by tile, so that memory depends on the tile and not on the run; within
// a tile the points of flat pieces of surface are projected onto their common plane (surfels.hpp), points
// that other views look through are removed (free_space.hpp), and colours are balanced between views
// (exposure.hpp).
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "plumbline/cloud/fusion/voxel_map.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::cloud {

struct DenseFusionOptions {
  VoxelMapOptions voxels;
  int min_observations = 1;      ///< smallest number of views of a voxel that is kept
  bool plane_projection = true;  ///< points of flat pieces of surface lie on their plane
  bool free_space = true;        ///< remove points that other views look through
  bool exposure = true;          ///< colours are evened out between views
  int min_support = 6;     ///< points with fewer like them within about 3 blocks are isolated; 0: none is
  double tile_mb = 100.0;  ///< memory that one tile may take; tiles of three times that are filled together

  void declare(core::OptionTable& table);
};

struct FusionReport {
  std::size_t tiles = 0;
  std::size_t seen_through = 0;  ///< points removed since views look through them
  std::size_t isolated = 0;      ///< points removed as isolated
  double least_gain = 1.0;       ///< smallest colour gain of a view
  double most_gain = 1.0;
};

/// Gives the cloud of view `i`, in its camera frame, for the caller to change; may be called for several
/// views at a time.
using ReadView = std::function<core::Result<CloudPtr>(std::size_t)>;

/// Name of the column that says how exactly a point is known along its normal: standard deviation, metres.
inline constexpr const char* kSigmaColumn = "sigma";

/// The views of a whole run; all vectors have one entry per view. A cloud holds the pose of its sensor
/// relative to the camera (sensor_pose).
struct FusionViews {
  std::vector<geometry::Rigid3> world_from_camera;
  std::vector<sensor::Pinhole> cameras;  ///< camera of each cloud
  std::vector<std::uint8_t> robots;  ///< robot of each view, 0-254; empty: one robot, and no columns.robot
  ReadView read;
  /// Covariances of (rho, phi) in Exp(rho, phi) camera_from_world, metres and radians; empty: not known, and
  /// no column of kSigmaColumn. NaN: not known of this view; what only such views measured has NaN there.
  std::vector<geometry::Matrix6d> covariances = {};
};

/// Fuses the views. Reads each once to plan and once for all tiles that are filled together. Points come tile
/// by tile, in a fixed order; the same for any number of threads. For several robots, columns.robot is the
/// one that measured each point most. The column kSigmaColumn holds the noise of the poses, as if all views
/// of a place erred alike, and that of depth, as if it averaged over views but not within one. Errors are
/// those of `read`. `report` may be null.
core::Result<FusedCloud> fuse_views(const FusionViews& views, const DenseFusionOptions& options,
                                    const core::Executor& executor, FusionReport* report = nullptr);

/// A cloud and its columns again in larger voxels, weighted by confidence when that is known.
FusedCloud coarser(const Cloud& cloud, const CloudColumns& columns, double voxel_m);

}  // namespace plumbline::cloud
