// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Space that cameras looked through, seen from above.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "plumbline/maps/view_rays.hpp"

namespace plumbline::plans {

/// Cells seen from above, each with the number of views that looked through it at the height of a room.
class FreeSpace {
 public:
  static constexpr double kCell_m = 0.05;

  /// `box`: the cells that are counted; `floor_m`: height of the floor in the rays' frame.
  FreeSpace(const Eigen::AlignedBox2d& box, double floor_m);

  void add(const maps::ViewRays& rays);

  /// Share of a convex outline, counter-clockwise, that at least two views looked through.
  [[nodiscard]] double share(const std::vector<Eigen::Vector2d>& outline) const;
  /// Places where cameras were.
  [[nodiscard]] const std::vector<Eigen::Vector2d>& cameras() const { return cameras_; }

 private:
  [[nodiscard]] int index(const Eigen::Vector2d& place) const;
  [[nodiscard]] bool is_free(int cell) const {
    return cell >= 0 && views_[static_cast<std::size_t>(cell)] >= 2;
  }

  Eigen::AlignedBox2d box_;
  double floor_m_;
  int columns_;
  int rows_;
  std::int32_t view_ = 0;
  std::vector<std::uint16_t> views_;
  std::vector<std::int32_t> last_;  ///< view that counted last
  std::vector<Eigen::Vector2d> cameras_;
};

}  // namespace plumbline::plans
