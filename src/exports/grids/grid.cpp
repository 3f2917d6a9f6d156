// SPDX-License-Identifier: BSD-3-Clause
#include "grids/grid.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace plumbline::exports {
namespace {

constexpr double kGridDefault_m = 0.05;
constexpr int kMostParts = 64;  // of a column, one bit for each

/// The part of [0, 1] in which `from + t * step` lies in [low, high]; empty: first > second.
std::pair<double, double> span_between(double from, double step, double low, double high) {
  if (std::abs(step) < 1e-12) return from < low || from > high ? std::pair(1.0, 0.0) : std::pair(0.0, 1.0);
  double t0 = (low - from) / step;
  double t1 = (high - from) / step;
  if (t0 > t1) std::swap(t0, t1);
  return {std::max(0.0, t0), std::min(1.0, t1)};
}

/// Number of the cell at a place, if it is one of the grid's.
std::optional<std::size_t> cell_at(const Grid& grid, const Eigen::Vector2i& at) {
  if (at.x() < 0 || at.y() < 0 || at.x() >= grid.columns || at.y() >= grid.rows) return std::nullopt;
  return static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(grid.columns) +
         static_cast<std::size_t>(at.x());
}
Eigen::Vector2i column_and_row(const Grid& grid, const Eigen::Vector2d& place) {
  return ((place - grid.origin) / grid.resolution_m).array().floor().cast<int>();
}

/// The parts of each cell's column, between the two heights, that rays cross.
class CrossedColumns {
 public:
  CrossedColumns(const Grid& grid, const GridHeights& heights)
      : grid_(grid), heights_(heights), crossed_(grid.cells.size(), 0) {
    constexpr double kThinnest_m = 0.025;
    part_m_ = std::max(kThinnest_m, (heights.high_m - heights.low_m) / kMostParts);
  }

  /// Adds the rays of a view, each up to a little before its end.
  void add(const ViewRays& rays) {
    const double margin_m = 1.5 * grid_.resolution_m;  // before the hit, for noise and the cell itself
    for (const Eigen::Vector3f& end : rays.ends) {
      const Eigen::Vector3d way = end.cast<double>() - rays.origin;
      const double length_m = way.norm();
      if (length_m <= margin_m) continue;
      const Eigen::Vector3d seen = (1.0 - margin_m / length_m) * way;
      auto [t0, t1] = span_between(rays.origin.z(), seen.z(), heights_.low_m, heights_.high_m);
      for (int k = 0; k < 2; ++k) {
        const double most = grid_.resolution_m * (k == 0 ? grid_.columns : grid_.rows);
        const auto [in, out] = span_between(rays.origin[k] - grid_.origin[k], seen[k], 0.0, most);
        t0 = std::max(t0, in);
        t1 = std::min(t1, out);
      }
      if (t0 <= t1) cross(rays.origin + t0 * seen, rays.origin + t1 * seen);
    }
  }

  /// True if the column was seen to be empty up to a height: nothing in it, not even a plate that cameras
  /// only looked along: no three parts above each other stayed unseen.
  [[nodiscard]] bool empty_up_to(std::size_t cell, double z) const {
    if (z <= heights_.low_m) return true;
    const std::uint64_t unseen = ~crossed_[cell] & bits(0, part_at(std::min(z, heights_.high_m) - 1e-9));
    return (unseen & (unseen >> 1U) & (unseen >> 2U)) == 0;
  }

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

    double entered = 0.0;
    for (int step = 0;; ++step) {
      const double left = std::min(1.0, next.minCoeff());
      mark(cell, from.z() + entered * (to.z() - from.z()), from.z() + left * (to.z() - from.z()));
      if (step == steps) return;
      const int k = next.x() < next.y() ? 0 : 1;
      cell[k] += towards[k];
      next[k] += between[k];
      entered = left;
    }
  }

  /// Marks the parts of a cell's column between two heights.
  void mark(const Eigen::Vector2i& cell, double z0, double z1) {
    const auto index = cell_at(grid_, cell);
    if (!index) return;
    crossed_[*index] |= bits(part_at(std::min(z0, z1)), part_at(std::max(z0, z1)));
  }
  [[nodiscard]] int part_at(double z) const {
    return std::clamp(static_cast<int>((z - heights_.low_m) / part_m_), 0, kMostParts - 1);
  }
  [[nodiscard]] static std::uint64_t bits(int first, int last) {
    return (~std::uint64_t{0} << static_cast<unsigned>(first)) &
           (~std::uint64_t{0} >> static_cast<unsigned>(kMostParts - 1 - last));
  }

  const Grid& grid_;
  GridHeights heights_;
  double part_m_;
  std::vector<std::uint64_t> crossed_;
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

  // Whole multiples of the cell size, with a margin
  const Eigen::Array2d low = (box.min().array() / resolution_m).floor() - 2.0;
  const Eigen::Array2d high = (box.max().array() / resolution_m).floor() + 3.0;
  if ((high - low).prod() > kMostCells) {
    return core::usage_error(fmt::format(
        "--resolution: {:.0f} million cells of {} m are too many; choose larger cells, or a --box",
        (high - low).prod() / 1e6, resolution_m));
  }

  // Unknown until points or rays show more
  grid.origin = low * resolution_m;
  grid.columns = static_cast<int>(high.x() - low.x());
  grid.rows = static_cast<int>(high.y() - low.y());
  grid.cells.assign(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows),
                    GridCell::kUnknown);
  return grid;
}

/// Measured surface in each cell.
struct MeasuredCells {
  std::vector<bool> obstacle;
  std::vector<bool> floor;
};

/// Cells that contain points at the height of obstacles, or of the floor.
MeasuredCells measured_cells(const Grid& grid, const cloud::CloudFile& file, const GridHeights& heights) {
  MeasuredCells cells{std::vector<bool>(grid.cells.size(), false),
                      std::vector<bool>(grid.cells.size(), false)};
  for (const cloud::Point& p : *file.cloud) {
    const Eigen::Vector3d at = p.getVector3fMap().cast<double>() + file.shift;
    const auto cell = cell_at(grid, column_and_row(grid, at.head<2>()));
    if (!cell) continue;
    if (heights.is_obstacle(at.z())) cells.obstacle[*cell] = true;
    if (heights.is_floor(at.z())) cells.floor[*cell] = true;
  }
  return cells;
}

/// Marks the floor at the ends of a view's rays.
void add_floor(const Grid& grid, const ViewRays& rays, const GridHeights& heights, std::vector<bool>& floor) {
  for (const Eigen::Vector3f& end : rays.ends) {
    if (!heights.is_floor(static_cast<double>(end.z()))) continue;
    if (const auto cell = cell_at(grid, column_and_row(grid, end.head<2>().cast<double>())))
      floor[*cell] = true;
  }
}

/// Frees the cells around each camera where a body that carried it had room to stand.
void free_where_carried(const std::vector<ExportPose>& path, const GridHeights& heights, Grid& grid) {
  constexpr double kBody_m = 0.2;         // radius
  constexpr double kHighestHand_m = 2.2;  // over the floor
  const int reach = static_cast<int>(std::ceil(kBody_m / grid.resolution_m));
  std::vector<std::pair<std::size_t, double>> around;  // cells and their distance

  // Cameras that a body can have carried
  for (const ExportPose& pose : path) {
    const Eigen::Vector3d& camera = pose.world_from_camera.translation;
    if (camera.z() < heights.floor_m || camera.z() > heights.floor_m + kHighestHand_m) continue;

    // Cells below the body
    around.clear();
    const Eigen::Vector2i middle = column_and_row(grid, camera.head<2>());
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const double distance_m = std::hypot(x, y) * grid.resolution_m;
        const auto cell = cell_at(grid, middle + Eigen::Vector2i(x, y));
        if (cell && distance_m <= kBody_m) around.emplace_back(*cell, distance_m);
      }
    }

    // Free up to the nearest obstacle
    double room_m = std::numeric_limits<double>::infinity();  // to the nearest obstacle
    for (const auto& [cell, distance_m] : around) {
      if (grid.cells[cell] == GridCell::kOccupied) room_m = std::min(room_m, distance_m);
    }
    for (const auto& [cell, distance_m] : around) {
      if (distance_m < room_m) grid.cells[cell] = GridCell::kFree;
    }
  }
}

}  // namespace

/// Decides on cells: obstacles from points, free space from rays and the cameras' path.
core::Result<void> set_cells(const cloud::CloudFile& cloud, const std::vector<ExportPose>& path,
                             const ForEachView& views, const GridHeights& heights, Grid& grid) {
  constexpr double kTableTop_m = 1.0;  // highest plate over floor that was seen
  MeasuredCells measured = measured_cells(grid, cloud, heights);
  CrossedColumns crossed(grid, heights);

  // Rays cross free space and end on the floor
  auto seen = views([&](const ViewRays& view) -> core::Result<void> {
    crossed.add(view);
    add_floor(grid, view, heights, measured.floor);
    return {};
  });
  if (!seen) return seen;

  // Over a visible floor, columns must be empty only up to the height of tables
  const double top_m = std::min(heights.high_m, heights.floor_m + kTableTop_m);
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    if (measured.obstacle[i]) {
      grid.cells[i] = GridCell::kOccupied;
    } else if (crossed.empty_up_to(i, measured.floor[i] ? top_m : heights.high_m)) {
      grid.cells[i] = GridCell::kFree;
    }
  }

  // A body has stood there
  free_where_carried(path, heights, grid);
  return {};
}

/// The grid of the selected part of the map.
core::Result<Grid> make_grid(MapSource& source) {
  if (auto up = source.need_upright("a grid"); !up) return tl::unexpected(up.error());
  const ExportOptions& options = source.options();
  if (options.heights[0] >= options.heights[1])
    return core::usage_error("--heights: takes two heights over the floor, the lower first");

  // Points, and the path if there is one
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());

  const auto poses = source.poses(false);  // without poses the points alone bound the grid
  const std::vector<ExportPose> path = poses ? *poses : std::vector<ExportPose>{};
  auto grid = grid_over(**cloud, path, options.resolution_m > 0.0 ? options.resolution_m : kGridDefault_m);
  if (!grid) return grid;

  // Heights are given over the floor
  const double floor_m = source.floor_m();
  const auto set = set_cells(
      **cloud, path, [&](const auto& take) { return for_each_view(source, take); },
      {floor_m, floor_m + options.heights[0], floor_m + options.heights[1]}, *grid);
  if (!set) return tl::unexpected(set.error());
  return grid;
}

}  // namespace plumbline::exports
