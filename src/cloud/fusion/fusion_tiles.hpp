// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Cuts the space that views reach into boxes of bounded content.
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/fusion/exposure.hpp"

namespace plumbline::cloud {

/// Box of cells, both ends included, and the views that reach into it or its margin.
struct FusionTile {
  Eigen::AlignedBox3i cells;
  std::size_t occupied = 0;          ///< number of occupied cells without the margin
  std::vector<std::uint32_t> views;  ///< ascending

  /// Metres, the margin left out: [min, max).
  [[nodiscard]] Eigen::AlignedBox3d box(double cell_m) const {
    return {cells.min().cast<double>() * cell_m,
            (cells.max().cast<double>().array() + 1.0).matrix() * cell_m};
  }
  /// The voxels of the tile and of its margin, a cell wide.
  [[nodiscard]] Eigen::AlignedBox3i voxels(double cell_m, double voxel_m) const {
    const Eigen::AlignedBox3d around = box(cell_m);
    return {((around.min().array() - cell_m) / voxel_m).floor().cast<int>(),
            ((around.max().array() + cell_m) / voxel_m).floor().cast<int>()};
  }
};

/// k-d cuts at medians until no box holds more than `most_cells` occupied cells, with at least about four
/// boxes if there are enough cells. Boxes include the cells around their occupied ones, unless another box
/// has them. `views`: the cells of each, by cell. A view belongs to a tile if it has points in it or in one
/// of the cells around it. In a fixed order.
std::vector<FusionTile> plan_tiles(const std::vector<std::vector<ColorCell>>& views, std::size_t most_cells);

}  // namespace plumbline::cloud
