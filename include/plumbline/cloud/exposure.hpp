// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Colours evened out between views: the camera's exposure and white balance change from view to view, the
// surfaces' colours do not (after Brown and Lowe, IJCV 74, 2007, section 6).
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/cloud/view_points.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::cloud {

/// Mean colour that one view saw of a cube of space.
struct ColorCell {
  std::uint64_t cell = 0;
  Eigen::Vector3f color{0, 0, 0};  ///< red, green, blue, 0-255
  float points = 0.0F;
};

/// Mean place and colour of a view's points within a small cube of its camera's space: what of a view is
/// worth keeping until its pose is known.
struct ColorSpot {
  Eigen::Vector3f point{0, 0, 0};  ///< metres, camera frame
  Eigen::Vector3f color{0, 0, 0};  ///< red, green, blue, 0-255
  float points = 0.0F;             ///< that count for the colour
};

/// Spots of 5 cm of a view's cloud, in the order in which its points come to them; dark and saturated points
/// do not count for colours.
std::vector<ColorSpot> color_spots(const ViewPoints& points);
std::vector<ColorSpot> color_spots(const Cloud& camera_cloud);

/// Cubes of `cell_m` that a view's spots lie in, by cell. A point lies within 9 cm of its spot.
std::vector<ColorCell> color_cells(const std::vector<ColorSpot>& spots,
                                   const geometry::Rigid3& world_from_camera, double cell_m);

/// Factors of red, green and blue for every view that make the views agree on shared cubes, their geometric
/// mean 1: robust least squares over logarithms, drawn towards 1 where little is shared, within 0.5 to 2.
/// Views without anything shared get 1. The same for any number of threads.
std::vector<Eigen::Vector3f> color_gains(const std::vector<std::vector<ColorCell>>& views,
                                         const core::Executor& executor);

/// Multiplies the colours in place.
void apply_gain(ViewPoints& points, const Eigen::Vector3f& gain);

}  // namespace plumbline::cloud
