// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A wall from the front: where its surface was seen, where cameras looked through it, and where something in
// front hid it from them.
#include <cstdint>
#include <vector>

#include "plumbline/maps/view_rays.hpp"
#include "plumbline/plans/plan.hpp"

namespace plumbline::plans {

/// Cells of kWidth along the line and kHeight over the floor.
class WallRaster {
 public:
  static constexpr double kWidth_m = 0.02;
  static constexpr double kHeight_m = 0.05;
  static constexpr int kRows = 64;  ///< 3.2 m

  WallRaster(const Eigen::Vector2d& normal, double offset_m, double first_s, double last_s, double floor_m);

  void add_surface(const Eigen::Vector3d& place);
  void add_rays(const maps::ViewRays& rays);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int column_of(double s) const;
  [[nodiscard]] int column_at(const Eigen::Vector2d& place) const { return column_of(along_.dot(place)); }
  [[nodiscard]] double start_of(int column) const { return first_s_ + column * kWidth_m; }
  /// Share of the cells between two heights that show surface, or that rays cross.
  [[nodiscard]] double seen(int column, double low_m, double high_m) const {
    return share(surface_, column, low_m, high_m);
  }
  [[nodiscard]] double crossed(int column, double low_m, double high_m) const {
    return share(rays_, column, low_m, high_m);
  }
  /// Share of the cells behind something that stands at the wall, where rays from the front ended.
  [[nodiscard]] double hidden(int column, double low_m, double high_m) const {
    return share(hidden_, column, low_m, high_m);
  }
  /// Height over the floor of the highest surface in a column, below a height; 0: none.
  [[nodiscard]] double top(int column, double below_m = kRows * kHeight_m) const;

 private:
  void mark(const Eigen::Vector3d& place, std::vector<std::uint8_t>& cells) const;
  [[nodiscard]] double share(const std::vector<std::uint8_t>& cells, int column, double low_m,
                             double high_m) const;
  Eigen::Vector2d normal_;
  Eigen::Vector2d along_;
  double offset_m_;
  double first_s_;
  double floor_m_;
  int columns_;
  std::vector<std::uint8_t> surface_;  ///< by column, then row
  std::vector<std::uint8_t> rays_;
  std::vector<std::uint8_t> hidden_;
};

}  // namespace plumbline::plans
