// SPDX-License-Identifier: BSD-3-Clause
#include "visits/visit_changes.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "plumbline/cloud/fusion/free_space.hpp"
#include "plumbline/cloud/fusion/surfels.hpp"
#include "plumbline/cloud/sensor_pose.hpp"

namespace plumbline::pipeline {
namespace {

using cloud::Evidence;
using Cells = cloud::CellMap<std::uint8_t>;

std::uint64_t visit_cell(const Eigen::Vector3d& position) {
  return cloud::pack_cell(cloud::cell_of(position / kVisitCell_m));
}

/// All that the views of the map, or those of the visit, have seen.
struct Seen {
  std::vector<std::size_t> views;  ///< indices among all
  std::vector<cloud::DepthRaster> rasters;
  std::vector<std::uint8_t> is_depth_view;
  std::vector<geometry::Rigid3> world_from_cloud;
  std::vector<cloud::FusedPoint> points;
};

/// Reads the views a few at a time, so that memory depends on the place and not on their number.
core::Result<Seen> read_seen(const std::vector<VisitedView>& views, bool of_visit,
                             const cloud::ReadView& read, const core::Executor& executor) {
  constexpr std::size_t kAtATime = 16;
  Seen seen;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].of_visit == of_visit) seen.views.push_back(v);
  }

  seen.rasters.resize(seen.views.size());
  seen.is_depth_view.resize(seen.views.size());
  seen.world_from_cloud.resize(seen.views.size());

  cloud::VoxelMapOptions options;
  options.voxel_m = kVisitCell_m;

  cloud::VoxelMap voxels(options);
  const Eigen::AlignedBox3i everywhere(Eigen::Vector3i::Constant(-(1 << 20)),
                                       Eigen::Vector3i::Constant(1 << 20));

  for (std::size_t begin = 0; begin < seen.views.size(); begin += kAtATime) {
    const std::size_t count = std::min(kAtATime, seen.views.size() - begin);
    std::vector<std::vector<cloud::VoxelSample>> samples(count);
    std::vector<core::Result<void>> done(count);
    executor.parallel_for(count, [&](std::size_t k) {
      const std::size_t i = begin + k;
      const VisitedView& view = views[seen.views[i]];
      const auto cloud = read(seen.views[i]);
      if (!cloud) {
        done[k] = tl::unexpected<core::Error>(cloud.error());
        return;
      }

      seen.world_from_cloud[i] = view.world_from_camera * cloud::sensor_pose(**cloud);
      seen.rasters[i] = cloud::depth_raster(**cloud, view.camera);
      seen.is_depth_view[i] = cloud::is_depth_view(**cloud, view.camera) ? 1 : 0;

      // Depth views test free space only and have no normals: they add no surface.
      if (seen.is_depth_view[i] == 0)
        samples[k] = cloud::VoxelMap::measured(**cloud, seen.world_from_cloud[i], options);
    });

    // Samples enter in the order of the views, so that the result does not depend on the threads.
    for (std::size_t k = 0; k < count; ++k) {
      if (!done[k]) return tl::unexpected<core::Error>(done[k].error());
      voxels.insert(samples[k], everywhere);
    }
  }

  seen.points = voxels.points();
  return seen;
}

/// For each of these points: 1 if the visit's views decide that its surface is not there (any more).
std::vector<std::uint8_t> not_there(const std::vector<cloud::FusedPoint>& points, const Seen& visit) {
  const cloud::Surfels surfels(points, 2.0 * kVisitCell_m);
  const std::vector<std::uint8_t> goes =
      cloud::seen_through(surfels, visit.rasters, visit.is_depth_view, visit.world_from_cloud);

  std::vector<std::uint8_t> result(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (surfels.of(i) != cloud::Surfels::kNone) result[i] = goes[surfels.of(i)];
  }
  return result;
}

Eigen::Vector3d position_of(const cloud::FusedPoint& fused) {
  return fused.point.getVector3fMap().cast<double>();
}

/// Cells where nothing of the map stays; `staying`: the others.
Cells gone_cells(const Seen& map, const Seen& visit, Cells& staying) {
  const std::vector<std::uint8_t> goes = not_there(map.points, visit);
  Cells gone;
  for (std::size_t i = 0; i < goes.size(); ++i)
    (goes[i] != 0 ? gone : staying)[visit_cell(position_of(map.points[i]))] = 1;
  for (const auto& [cell, unused] : staying) gone.erase(cell);
  return gone;
}

bool is_near(const Cells& cells, const Eigen::Vector3d& position) {
  const Eigen::Vector3i middle = cloud::cell_of(position / kVisitCell_m);
  for (int k = 0; k < 27; ++k) {
    const Eigen::Vector3i step(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    if (cells.count(cloud::pack_cell(middle + step)) != 0) return true;
  }
  return false;
}

/// Surface that at least two views of the visit show, none of which looks through it, away from all that
/// stays.
std::vector<Eigen::Vector3d> new_surface(const Seen& visit, const Cells& staying) {
  const std::vector<std::uint8_t> goes = not_there(visit.points, visit);
  std::vector<Eigen::Vector3d> positions;
  for (std::size_t i = 0; i < goes.size(); ++i) {
    const cloud::FusedPoint& point = visit.points[i];
    if (goes[i] == 0 && point.observations > 1 && !is_near(staying, position_of(point)))
      positions.push_back(position_of(point));
  }
  return positions;
}

/// Depth of what stands newly before a view of the map, by cell of its raster; infinite: nothing does.
std::vector<float> hidden_beyond(const cloud::DepthRaster& raster, const geometry::Rigid3& world_from_cloud,
                                 const std::vector<Eigen::Vector3d>& surface) {
  std::vector<float> beyond;
  const cloud::DepthLimits limits(raster);
  const geometry::Rigid3 cloud_from_world = world_from_cloud.inverse();

  for (const Eigen::Vector3d& position : surface) {
    const Eigen::Vector3d p = cloud_from_world * position;

    // New surface contradicts this view only where the view measured free space.
    if (limits.evidence(p.cast<float>()) != Evidence::kFree) continue;

    if (beyond.empty()) beyond.assign(raster.nearest.size(), std::numeric_limits<float>::infinity());

    const Eigen::Vector2d pixel = raster.camera.project(p);

    const int column = static_cast<int>(pixel.x()) / cloud::DepthRaster::kCell_px;
    const int row = static_cast<int>(pixel.y()) / cloud::DepthRaster::kCell_px;

    // The points of a surface have gaps between them, so the cells around are covered as well.
    for (int k = 0; k < 9; ++k) {
      const int x = column + k % 3 - 1, y = row + k / 3 - 1;
      if (x < 0 || y < 0 || x >= raster.width || y >= raster.height) continue;
      float& depth = beyond[static_cast<std::size_t>(y * raster.width + x)];
      depth = std::min(depth, static_cast<float>(p.z()));
    }
  }

  return beyond;
}

/// Points of a view of the map that go; empty: none.
std::vector<std::uint8_t> removed_points(const cloud::Cloud& cloud, const geometry::Rigid3& world_from_cloud,
                                         const cloud::DepthRaster& raster, const std::vector<float>& beyond,
                                         const VisitChanges& changes) {
  std::vector<std::uint8_t> removed(cloud.size(), 0);
  bool any = false;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const cloud::Point& point = cloud[i];
    if (!(std::isfinite(point.z) && point.z > 0.0F)) continue;
    const Eigen::Vector3d p = point.getVector3fMap().cast<double>();

    bool goes = changes.is_gone(world_from_cloud * p);

    // Rays to points behind new surface pass through it: if they stayed, their free space would remove the
    // new surface in later fusions.
    const Eigen::Vector2d pixel = raster.camera.project(p);
    if (!goes && !beyond.empty() && raster.camera.contains(pixel, -0.49)) {
      const int column = static_cast<int>(pixel.x() + 0.5) / cloud::DepthRaster::kCell_px;
      const int row = static_cast<int>(pixel.y() + 0.5) / cloud::DepthRaster::kCell_px;
      goes = point.z > beyond[static_cast<std::size_t>(row * raster.width + column)];
    }

    removed[i] = goes ? 1 : 0;

    any = any || goes;
  }
  if (!any) removed.clear();
  return removed;
}

/// Numbers of the new cells that a cloud shows, and their share of all its cells.
std::pair<std::vector<std::uint32_t>, double> shown(const cloud::Cloud& cloud,
                                                    const geometry::Rigid3& world_from_cloud,
                                                    const cloud::CellMap<std::uint32_t>& numbers) {
  Cells all;
  std::vector<std::uint32_t> result;
  for (const cloud::Point& point : cloud.points) {
    if (!std::isfinite(point.z)) continue;
    const std::uint64_t cell = visit_cell(world_from_cloud * point.getVector3fMap().cast<double>());
    if (!all.insert({cell, 1}).second) continue;

    const auto found = numbers.find(cell);
    if (found != numbers.end()) result.push_back(found->second);
  }
  std::sort(result.begin(), result.end());
  return {result, all.empty() ? 0.0 : static_cast<double>(result.size()) / static_cast<double>(all.size())};
}

}  // namespace

bool VisitChanges::is_gone(const Eigen::Vector3d& position) const {
  return gone.count(visit_cell(position)) != 0;
}

core::Result<VisitChanges> find_changes(const std::vector<VisitedView>& views, const cloud::ReadView& read,
                                        const core::Executor& executor) {
  const auto map = read_seen(views, false, read, executor);
  if (!map) return tl::unexpected<core::Error>(map.error());

  const auto visit = read_seen(views, true, read, executor);

  if (!visit) return tl::unexpected<core::Error>(visit.error());

  VisitChanges changes;
  Cells staying;
  changes.gone = gone_cells(*map, *visit, staying);

  // New surface must lie away from all that stays, so what is gone is decided first.
  const std::vector<Eigen::Vector3d> surface = new_surface(*visit, staying);
  cloud::CellMap<std::uint32_t> numbers;

  for (const Eigen::Vector3d& position : surface)
    numbers.insert({visit_cell(position), static_cast<std::uint32_t>(numbers.size())});
  changes.new_cells = numbers.size();

  changes.removed.resize(views.size());
  changes.shows.resize(views.size());
  changes.share_new.resize(views.size(), 0.0);
  std::vector<core::Result<void>> done(views.size());

  // Clouds are read a second time instead of being kept, as those of a large map exceed the memory.
  const auto each = [&](const Seen& seen, std::size_t i) {
    const std::size_t v = seen.views[i];
    const auto cloud = read(v);

    if (!cloud) {
      done[v] = tl::unexpected<core::Error>(cloud.error());
    } else if (!views[v].of_visit) {
      changes.removed[v] =
          removed_points(**cloud, seen.world_from_cloud[i], seen.rasters[i],
                         hidden_beyond(seen.rasters[i], seen.world_from_cloud[i], surface), changes);
    } else if (seen.is_depth_view[i] == 0) {
      std::tie(changes.shows[v], changes.share_new[v]) = shown(**cloud, seen.world_from_cloud[i], numbers);
    }
  };

  executor.parallel_for(map->views.size(), [&](std::size_t i) { each(*map, i); });
  executor.parallel_for(visit->views.size(), [&](std::size_t i) { each(*visit, i); });

  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!done[v]) return tl::unexpected<core::Error>(done[v].error());
    changes.gone_points += static_cast<std::size_t>(
        std::count(changes.removed[v].begin(), changes.removed[v].end(), std::uint8_t{1}));
  }

  return changes;
}

}  // namespace plumbline::pipeline
