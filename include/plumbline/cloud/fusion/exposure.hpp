// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Colours evened out between views: the camera's exposure and white balance change from view to view, the
// surfaces' colours do not (after Brown and Lowe, IJCV 74, 2007, section 6).
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::cloud {

/// Mean colour that one view saw of a cube of space.
struct ColorCell {
  std::uint64_t cell = 0;          ///< pack_cell()
  Eigen::Vector3f color{0, 0, 0};  ///< red, green, blue, 0-255
  float points = 0.0F;             ///< number averaged; dark and saturated points are left out
};

/// Mean colours of a view in cubes of `cell_m`, sorted by cell.
std::vector<ColorCell> color_cells(const Cloud& camera_cloud, const geometry::Rigid3& world_from_camera,
                                   double cell_m);

/// Factors of red, green and blue for every view that make the views agree on shared cubes: robust least
/// squares over logarithms, with geometric mean 1, drawn towards 1 where little is shared, limited to 0.5 to
/// 2. Views that share nothing get 1.
std::vector<Eigen::Vector3f> color_gains(const std::vector<std::vector<ColorCell>>& views);

/// Multiplies the colours in place.
void apply_gain(Cloud& cloud, const Eigen::Vector3f& gain);

}  // namespace plumbline::cloud
