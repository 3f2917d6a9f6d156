// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Points sorted into the cubes of a grid.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace plumbline::evaluate {

class VoxelBuckets {
 public:
  VoxelBuckets(const std::vector<Eigen::Vector3f>& points, double edge_m);

  /// Voxels that hold points, ordered by x, y, z.
  [[nodiscard]] std::size_t size() const { return cells_.size(); }
  [[nodiscard]] std::vector<std::uint32_t> points_of(std::size_t voxel) const;

  /// Calls visit(point) for the points of the voxel and its 26 neighbours, in a fixed order.
  template <typename Visit>
  void for_neighborhood(std::size_t voxel, const Visit& visit) const {
    const Cell& middle = cells_[voxel];
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        for (std::int64_t dz = -1; dz <= 1; ++dz) {
          const Cell* cell = find({middle.key[0] + dx, middle.key[1] + dy, middle.key[2] + dz});
          if (cell == nullptr) continue;
          for (std::uint32_t i = cell->first; i < cell->last; ++i) visit(order_[i]);
        }
      }
    }
  }

 private:
  using Key = std::array<std::int64_t, 3>;
  struct Cell {
    Key key;
    std::uint32_t first;
    std::uint32_t last;
  };
  [[nodiscard]] const Cell* find(const Key& key) const;

  std::vector<std::uint32_t> order_;
  std::vector<Cell> cells_;
};

}  // namespace plumbline::evaluate
