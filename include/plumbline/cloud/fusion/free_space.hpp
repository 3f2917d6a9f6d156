// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Evidence of views against points that are not on their surfaces: the space between a camera and a surface
// is free.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/fusion/surfels.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::cloud {

/// A small depth image of a view: the nearest measured depth within cells of 4 x 4 pixels.
struct DepthRaster {
  static constexpr int kCell_px = 4;
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> nearest;  ///< millimetres, 0: none
  float furthest_m = 0.0F;             ///< largest depth of all cells
  sensor::Pinhole camera;              ///< camera that took the view
};

/// From a view's cloud, camera frame.
DepthRaster depth_raster(const Cloud& camera_cloud, const sensor::Pinhole& camera);

/// Depth view of a frame, for testing free space only: the nearest depth of each cell of a raster, as an
/// organised cloud (metres, camera frame) without normals and colours; cells without a
/// measurement within [min_depth_m, max_depth_m] are NaN.
CloudPtr depth_view(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera, double min_depth_m,
                    double max_depth_m);

/// True if a view of `camera` is a depth view, which tests free space and adds no points.
bool is_depth_view(const Cloud& camera_cloud, const sensor::Pinhole& camera);

/// Evidence of one view about a point.
enum class Evidence { kNone, kSurface, kFree, kHidden };

/// The nearest and the furthest depth around each cell of a raster, which must outlive this; for testing many
/// points against a view.
class DepthLimits {
 public:
  explicit DepthLimits(const DepthRaster& raster);
  /// `point`: metres, frame of the camera, which took the view. Free: all cells around (3 x 3, at least 7
  /// measured) lie further away than the sensor's noise and 3 cm explain. kNone outside of the image or
  /// where too little was measured.
  [[nodiscard]] Evidence evidence(const Eigen::Vector3f& point) const;

 private:
  const DepthRaster& raster_;
  std::vector<std::uint16_t> nearest_, furthest_;  ///< millimetres, 0: none
};

/// For every surfel whether it must be removed: if at least half as many views look through it as see a
/// surface there, and at least two unless only one view sees it. A person walking towards the camera hides
/// the place behind: surfels that some view looks through, or that three times as many views cannot see as
/// see them (three at least), are removed too if at least half of the certain surfels within 10 cm are.
/// `is_depth_view`: by view; depth views are tested only for surfels that clouds alone do not decide: some
/// cloud looks through, or fewer than four see a surface.
std::vector<std::uint8_t> seen_through(const Surfels& surfels, const std::vector<DepthRaster>& rasters,
                                       const std::vector<std::uint8_t>& is_depth_view,
                                       const std::vector<geometry::Rigid3>& world_from_camera);

}  // namespace plumbline::cloud
