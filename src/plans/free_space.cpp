// SPDX-License-Identifier: BSD-3-Clause
#include "free_space.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::plans {

FreeSpace::FreeSpace(const Eigen::AlignedBox2d& box, double floor_m)
    : box_(box),
      floor_m_(floor_m),
      columns_(std::max(1, static_cast<int>(std::ceil(box.sizes().x() / kCell_m)))),
      rows_(std::max(1, static_cast<int>(std::ceil(box.sizes().y() / kCell_m)))),
      views_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0),
      last_(views_.size(), 0) {}

int FreeSpace::index(const Eigen::Vector2d& place) const {
  const int column = static_cast<int>(std::floor((place.x() - box_.min().x()) / kCell_m));
  const int row = static_cast<int>(std::floor((place.y() - box_.min().y()) / kCell_m));
  return column < 0 || column >= columns_ || row < 0 || row >= rows_ ? -1 : row * columns_ + column;
}

void FreeSpace::add(const maps::ViewRays& rays) {
  constexpr double kStep_m = 0.04;
  constexpr double kBefore_m = 0.08;  // what was hit may be nearer by noise
  constexpr double kLow_m = 0.05;
  constexpr double kHigh_m = 2.4;
  ++view_;

  // Cells up to a little before the surface
  cameras_.emplace_back(rays.origin.head<2>());
  for (const Eigen::Vector3f& end : rays.ends) {
    const Eigen::Vector3d way = end.cast<double>() - rays.origin;
    const double length = way.norm();
    for (double t = 0.0; t < length - kBefore_m; t += kStep_m) {
      const Eigen::Vector3d at = rays.origin + t / length * way;
      const double height = at.z() - floor_m_;
      const int cell = index(at.head<2>());
      if (cell < 0 || height < kLow_m || height > kHigh_m || last_[static_cast<std::size_t>(cell)] == view_)
        continue;

      // A view counts once for each cell
      last_[static_cast<std::size_t>(cell)] = view_;
      auto& count = views_[static_cast<std::size_t>(cell)];
      count = static_cast<std::uint16_t>(std::min(60000, count + 1));
    }
  }
}

double FreeSpace::share(const std::vector<Eigen::Vector2d>& outline) const {
  // Box of the cells that the outline may hold
  Eigen::AlignedBox2d around;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : outline) {
    around.extend(p);
    middle += p / static_cast<double>(outline.size());
  }

  // Convex and counter-clockwise: inside is left of all sides
  const auto holds = [&](const Eigen::Vector2d& p) {
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d side = outline[(i + 1) % outline.size()] - outline[i];
      const Eigen::Vector2d way = p - outline[i];
      if (side.x() * way.y() - side.y() * way.x() < 0.0) return false;
    }

    return true;
  };

  // Cells whose middle is inside
  const auto number = [&](const Eigen::Vector2d& p, int axis) {
    return static_cast<int>(std::floor((p[axis] - box_.min()[axis]) / kCell_m));
  };
  int all = 0, free = 0;

  for (int y = number(around.min(), 1); y <= number(around.max(), 1); ++y) {
    for (int x = number(around.min(), 0); x <= number(around.max(), 0); ++x) {
      const Eigen::Vector2d place = box_.min() + kCell_m * Eigen::Vector2d(x + 0.5, y + 0.5);
      if (!holds(place)) continue;
      ++all;
      free += is_free(index(place)) ? 1 : 0;
    }
  }

  if (all == 0) return is_free(index(middle)) ? 1.0 : 0.0;  // narrower than a cell
  return static_cast<double>(free) / all;
}

}  // namespace plumbline::plans
