// SPDX-License-Identifier: BSD-3-Clause
#include "wall_raster.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::plans {

WallRaster::WallRaster(const Eigen::Vector2d& normal, double offset_m, double first_s, double last_s,
                       double floor_m)
    : normal_(normal),
      along_(-normal.y(), normal.x()),
      offset_m_(offset_m),
      first_s_(first_s),
      floor_m_(floor_m),
      columns_(std::max(1, static_cast<int>(std::ceil((last_s - first_s) / kWidth_m)) + 1)),
      surface_(static_cast<std::size_t>(columns_) * kRows, 0),
      rays_(surface_.size(), 0),
      hidden_(surface_.size(), 0) {}

int WallRaster::column_of(double s) const {
  return std::clamp(static_cast<int>(std::floor((s - first_s_) / kWidth_m)), 0, columns_ - 1);
}

void WallRaster::mark(const Eigen::Vector3d& place, std::vector<std::uint8_t>& cells) const {
  const double s = along_.dot(place.head<2>());
  const int row = static_cast<int>(std::floor((place.z() - floor_m_) / kHeight_m));
  const int column = static_cast<int>(std::floor((s - first_s_) / kWidth_m));
  if (row < 0 || row >= kRows || column < 0 || column >= columns_) return;
  cells[static_cast<std::size_t>(column) * kRows + static_cast<std::size_t>(row)] = 1;
}

void WallRaster::add_surface(const Eigen::Vector3d& place) { mark(place, surface_); }

void WallRaster::add_rays(const maps::ViewRays& rays) {
  constexpr double kBehind_m = 0.08;  // further than noise
  constexpr double kBefore_m = 0.04;  // flat things on a wall are in front of it
  constexpr double kAtWall_m = 0.4;   // things further from it hide a part from some places only

  // Signed distances tell rays that pass from rays that end before the wall
  const double origin = normal_.dot(rays.origin.head<2>()) - offset_m_;
  for (const Eigen::Vector3f& end_f : rays.ends) {
    const Eigen::Vector3d end = end_f.cast<double>();
    const double reached = normal_.dot(end.head<2>()) - offset_m_;
    const bool through =
        (origin > kBehind_m && reached < -kBehind_m) || (origin < -kBehind_m && reached > kBehind_m);
    const bool before = reached > kBefore_m && reached < kAtWall_m && origin > reached + kBefore_m;
    if (!through && !before) continue;
    mark(rays.origin + origin / (origin - reached) * (end - rays.origin), through ? rays_ : hidden_);
  }
}

double WallRaster::share(const std::vector<std::uint8_t>& cells, int column, double low_m,
                         double high_m) const {
  // At least one row
  const int low = std::clamp(static_cast<int>(std::floor(low_m / kHeight_m)), 0, kRows - 1);
  const int high = std::clamp(static_cast<int>(std::ceil(high_m / kHeight_m)), low + 1, kRows);
  int marked = 0;
  for (int row = low; row < high; ++row)
    marked += cells[static_cast<std::size_t>(column) * kRows + static_cast<std::size_t>(row)];
  return static_cast<double>(marked) / (high - low);
}

double WallRaster::top(int column, double below_m) const {
  // The highest row with surface below the limit
  const int rows = std::clamp(static_cast<int>(std::lround(below_m / kHeight_m)), 0, kRows);
  for (int row = rows - 1; row >= 0; --row) {
    if (surface_[static_cast<std::size_t>(column) * kRows + static_cast<std::size_t>(row)] != 0)
      return (row + 1) * kHeight_m;
  }
  return 0.0;
}

}  // namespace plumbline::plans
