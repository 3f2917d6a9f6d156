// SPDX-License-Identifier: BSD-3-Clause
#include "robot_columns.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace plumbline::pipeline {
namespace {

using Cell = std::uint64_t;

Cell cell_of(const Eigen::Vector3f& p, float edge) {
  constexpr std::int64_t kHalf = 1 << 20;
  Cell cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto index = static_cast<std::int64_t>(std::floor(p[axis] / edge)) + kHalf;
    cell = cell << 21 | static_cast<Cell>(std::clamp<std::int64_t>(index, 0, 2 * kHalf - 1));
  }
  return cell;
}

/// Numbers for the cells that hold points, in the order of their first one.
class Cells {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  Cells(const cloud::Cloud& points, float edge) : table_(kFirstTable, kNone) {
    for (const cloud::Point& p : points.points) add(cell_of(p.getVector3fMap(), edge));
  }
  [[nodiscard]] std::size_t size() const { return keys_.size(); }
  [[nodiscard]] std::uint32_t find(Cell cell) const { return table_[slot(cell)]; }

 private:
  static constexpr std::size_t kFirstTable = 1024;

  /// Neighbours along z share a line of the table.
  [[nodiscard]] std::size_t home(Cell cell) const {
    constexpr Cell kInLine = 7;
    return static_cast<std::size_t>(
        ((cell & ~kInLine) * 0x9E3779B97F4A7C15ULL >> 36 << 3 | (cell & kInLine)) & (table_.size() - 1));
  }
  /// Of the cell, or where it belongs.
  [[nodiscard]] std::size_t slot(Cell cell) const {
    std::size_t at = home(cell);
    while (table_[at] != kNone && keys_[table_[at]] != cell) at = (at + 1) & (table_.size() - 1);
    return at;
  }
  void add(Cell cell) {
    if (!keys_.empty() && keys_.back() == cell) return;
    std::uint32_t& number = table_[slot(cell)];
    if (number != kNone) return;
    number = static_cast<std::uint32_t>(keys_.size());
    keys_.push_back(cell);
    if (2 * keys_.size() <= table_.size()) return;
    table_.assign(2 * table_.size(), kNone);
    for (std::size_t i = 0; i < keys_.size(); ++i) table_[slot(keys_[i])] = static_cast<std::uint32_t>(i);
  }

  std::vector<Cell> keys_;
  std::vector<std::uint32_t> table_;  ///< open addressing, linear probing: number of a cell
};

/// How often each robot measured in each cell.
class Counts {
 public:
  Counts(const Cells& cells, const std::vector<std::int32_t>& robots) : cells_(cells), robots_(robots) {
    std::sort(robots_.begin(), robots_.end());
    robots_.erase(std::unique(robots_.begin(), robots_.end()), robots_.end());
    counts_ = std::vector<std::atomic<std::uint32_t>>(cells.size() * robots_.size());
  }
  /// May be called for several views at a time: sums of whole numbers have no order.
  void add(const cloud::Cloud& view, const geometry::Rigid3& world_from_camera, std::int32_t robot,
           float edge) {
    const auto column =
        static_cast<std::size_t>(std::lower_bound(robots_.begin(), robots_.end(), robot) - robots_.begin());
    const Eigen::Matrix3f rotation = world_from_camera.rotation.cast<float>();
    const Eigen::Vector3f translation = world_from_camera.translation.cast<float>();
    // Neighbours in a picture mostly share their cell.
    Cell last = 0;
    std::uint32_t points = 0;
    const auto note = [&] {
      const std::uint32_t number = points > 0 ? cells_.find(last) : Cells::kNone;
      if (number == Cells::kNone) return;
      counts_[number * robots_.size() + column].fetch_add(points, std::memory_order_relaxed);
    };
    for (const cloud::Point& p : view.points) {
      if (!std::isfinite(p.z)) continue;
      const Cell cell = cell_of(rotation * p.getVector3fMap() + translation, edge);
      if (cell != last) {
        note();
        last = cell;
        points = 0;
      }
      ++points;
    }
    note();
  }
  /// Who measured most there; the lower number where several did; -1: nobody.
  [[nodiscard]] std::int32_t most(Cell cell) const {
    const std::uint32_t number = cells_.find(cell);
    if (number == Cells::kNone) return -1;
    std::int32_t robot = -1;
    std::uint32_t points = 0;
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      const std::uint32_t count = counts_[number * robots_.size() + r].load(std::memory_order_relaxed);
      if (count <= points) continue;
      points = count;
      robot = robots_[r];
    }
    return robot;
  }

 private:
  const Cells& cells_;
  std::vector<std::int32_t> robots_;  ///< ascending
  std::vector<std::atomic<std::uint32_t>> counts_;
};

}  // namespace

core::Result<std::vector<std::uint8_t>> robots_of_points(
    const cloud::Cloud& fused, const std::vector<geometry::Rigid3>& world_from_camera,
    const std::vector<std::int32_t>& robots, const cloud::ReadView& read, double voxel_m,
    const core::Executor& executor) {
  // Points were moved a little onto their planes: cells of twice the size, and neighbours where one is empty.
  const auto edge = static_cast<float>(2.0 * voxel_m);
  const Cells cells(fused, edge);
  Counts counts(cells, robots);
  std::vector<core::Result<void>> done(world_from_camera.size());
  executor.parallel_for(world_from_camera.size(), [&](std::size_t v) {
    const auto view = read(v);
    if (view) {
      counts.add(**view, world_from_camera[v], robots[v], edge);
    } else {
      done[v] = tl::unexpected<core::Error>(view.error());
    }
  });
  for (const auto& result : done) {
    if (!result) return tl::unexpected<core::Error>(result.error());
  }
  std::vector<std::uint8_t> result(fused.size());
  constexpr std::size_t kAtATime = 1U << 16U;
  executor.parallel_for((fused.size() + kAtATime - 1) / kAtATime, [&](std::size_t part) {
    const std::size_t end = std::min(fused.size(), (part + 1) * kAtATime);
    for (std::size_t i = part * kAtATime; i < end; ++i) {
      const Eigen::Vector3f p = fused[i].getVector3fMap();
      std::int32_t robot = counts.most(cell_of(p, edge));
      for (int side = 0; side < 6 && robot < 0; ++side) {
        Eigen::Vector3f offset = Eigen::Vector3f::Zero();
        offset[side / 2] = side % 2 == 0 ? edge : -edge;
        robot = counts.most(cell_of(p + offset, edge));
      }
      constexpr std::int32_t kMostRobots = 254;
      result[i] = static_cast<std::uint8_t>(std::clamp(robot, 0, kMostRobots));
    }
  });
  return result;
}

}  // namespace plumbline::pipeline
