// SPDX-License-Identifier: BSD-3-Clause
#include "grids/grid.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "grids/rays.hpp"

namespace plumbline::exports {
namespace {

constexpr int kGridFewestPoints = 3;  // fewer are noise
constexpr std::uint8_t kGridFewestRays = 2;
constexpr double kGridDefault_m = 0.05;

/// The part of [0, 1] in which `from + t * step` lies in [low, high]; empty: first > second.
std::pair<double, double> span_between(double from, double step, double low, double high) {
  if (std::abs(step) < 1e-12) return from < low || from > high ? std::pair(1.0, 0.0) : std::pair(0.0, 1.0);
  double t0 = (low - from) / step;
  double t1 = (high - from) / step;
  if (t0 > t1) std::swap(t0, t1);
  return {std::max(0.0, t0), std::min(1.0, t1)};
}

/// Counts for each cell the rays that cross it.
class RayCounter {
 public:
  RayCounter(const Grid& grid, double low_m, double high_m)
      : grid_(grid), low_m_(low_m), high_m_(high_m), counts_(grid.cells.size(), 0) {}

  void add(const ViewRays& rays) {
    const double margin_m = 1.5 * grid_.resolution_m;  // before the hit, for noise and the cell itself
    for (const Eigen::Vector3f& end : rays.ends) {
      const Eigen::Vector3d way = end.cast<double>() - rays.origin;
      const double length_m = way.norm();
      if (length_m <= margin_m) continue;
      const Eigen::Vector3d seen = (1.0 - margin_m / length_m) * way;
      auto [t0, t1] = span_between(rays.origin.z(), seen.z(), low_m_, high_m_);
      for (int k = 0; k < 2; ++k) {
        const double most = grid_.resolution_m * (k == 0 ? grid_.columns : grid_.rows);
        const auto [in, out] = span_between(rays.origin[k] - grid_.origin[k], seen[k], 0.0, most);
        t0 = std::max(t0, in);
        t1 = std::min(t1, out);
      }
      if (t0 <= t1) cross(rays.origin + t0 * seen, rays.origin + t1 * seen);
    }
  }

  [[nodiscard]] bool free(std::size_t cell) const { return counts_[cell] >= kGridFewestRays; }

 private:
  /// Visits every cell between two positions (Amanatides and Woo 1987).
  void cross(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const Eigen::Vector2d a = (from.head<2>() - grid_.origin) / grid_.resolution_m;
    const Eigen::Vector2d way = (to.head<2>() - from.head<2>()) / grid_.resolution_m;
    Eigen::Vector2i cell(static_cast<int>(std::floor(a.x())), static_cast<int>(std::floor(a.y())));
    const Eigen::Vector2d b = a + way;
    const int steps = std::abs(static_cast<int>(std::floor(b.x())) - cell.x()) +
                      std::abs(static_cast<int>(std::floor(b.y())) - cell.y());

    Eigen::Vector2i towards;
    Eigen::Vector2d next, between;  // next border and distance of borders, in shares of the segment
    for (int k = 0; k < 2; ++k) {
      towards[k] = way[k] > 0.0 ? 1 : -1;
      between[k] = way[k] == 0.0 ? 1e300 : 1.0 / std::abs(way[k]);
      const double border = way[k] > 0.0 ? cell[k] + 1.0 - a[k] : a[k] - cell[k];
      next[k] = way[k] == 0.0 ? 1e300 : border * between[k];
    }

    for (int step = 0;; ++step) {
      count(cell);
      if (step == steps) return;
      const int k = next.x() < next.y() ? 0 : 1;
      cell[k] += towards[k];
      next[k] += between[k];
    }
  }

  void count(const Eigen::Vector2i& cell) {
    if (cell.x() < 0 || cell.y() < 0 || cell.x() >= grid_.columns || cell.y() >= grid_.rows) return;
    std::uint8_t& seen =
        counts_[static_cast<std::size_t>(cell.y()) * static_cast<std::size_t>(grid_.columns) +
                static_cast<std::size_t>(cell.x())];
    if (seen < kGridFewestRays) ++seen;
  }

  const Grid& grid_;
  double low_m_;
  double high_m_;
  std::vector<std::uint8_t> counts_;
};

/// Grid of unknown cells over all points and the cameras' path with a margin of two cells: a robot starts
/// where it recorded, which may lie beyond all points.
core::Result<Grid> grid_over(const cloud::CloudFile& file, const std::vector<ExportPose>& path,
                             double resolution_m) {
  constexpr double kMostCells = 268435456.0;
  Eigen::AlignedBox2d box;
  for (const cloud::Point& p : *file.cloud)
    box.extend((p.getVector3fMap().cast<double>() + file.shift).head<2>().eval());
  for (const ExportPose& pose : path) box.extend(pose.world_from_camera.translation.head<2>().eval());

  Grid grid;
  grid.resolution_m = resolution_m;

  const Eigen::Array2d low = (box.min().array() / resolution_m).floor() - 2.0;
  const Eigen::Array2d high = (box.max().array() / resolution_m).floor() + 3.0;
  if ((high - low).prod() > kMostCells) {
    return core::usage_error(fmt::format(
        "--resolution: {:.0f} million cells of {} m are too many; choose larger cells, or a --box",
        (high - low).prod() / 1e6, resolution_m));
  }

  grid.origin = low * resolution_m;
  grid.columns = static_cast<int>(high.x() - low.x());
  grid.rows = static_cast<int>(high.y() - low.y());
  grid.cells.assign(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows),
                    GridCell::kUnknown);
  return grid;
}

/// Number of points in each cell between two heights.
std::vector<int> points_in_cells(const Grid& grid, const cloud::CloudFile& file, double low_m,
                                 double high_m) {
  std::vector<int> counts(grid.cells.size(), 0);
  for (const cloud::Point& p : *file.cloud) {
    const Eigen::Vector3d at = p.getVector3fMap().cast<double>() + file.shift;
    if (at.z() < low_m || at.z() > high_m) continue;
    const Eigen::Array2d cell = ((at.head<2>() - grid.origin) / grid.resolution_m).array().floor();
    ++counts[static_cast<std::size_t>(cell.y()) * static_cast<std::size_t>(grid.columns) +
             static_cast<std::size_t>(cell.x())];
  }
  return counts;
}

}  // namespace

core::Result<Grid> make_grid(MapSource& source) {
  if (auto up = source.need_upright("a grid"); !up) return tl::unexpected(up.error());
  const ExportOptions& options = source.options();
  if (options.heights[0] >= options.heights[1])
    return core::usage_error("--heights: takes two heights over the floor, the lower first");

  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());

  const auto path = source.poses(false);  // without poses the points alone bound the grid
  auto grid = grid_over(**cloud, path ? *path : std::vector<ExportPose>{},
                        options.resolution_m > 0.0 ? options.resolution_m : kGridDefault_m);
  if (!grid) return grid;

  const double low_m = source.floor_m() + options.heights[0];
  const double high_m = source.floor_m() + options.heights[1];
  RayCounter rays(*grid, low_m, high_m);
  auto seen = for_each_view(source, [&](const ViewRays& view) -> core::Result<void> {
    rays.add(view);
    return {};
  });
  if (!seen) return tl::unexpected(seen.error());

  const std::vector<int> points = points_in_cells(*grid, **cloud, low_m, high_m);
  for (std::size_t i = 0; i < grid->cells.size(); ++i) {
    if (points[i] >= kGridFewestPoints) {
      grid->cells[i] = GridCell::kOccupied;
    } else if (rays.free(i)) {
      grid->cells[i] = GridCell::kFree;
    }
  }

  return grid;
}

}  // namespace plumbline::exports
