// SPDX-License-Identifier: BSD-3-Clause
#include "seen_space.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>

#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/maps/stored_run.hpp"

namespace plumbline::changes {

core::Result<std::optional<SeenSpace>> SeenSpace::open(const std::filesystem::path& input,
                                                       const geometry::Rigid3& world_from_map,
                                                       const core::Executor& executor) {
  // A result without stored views knows no free space
  const auto place = maps::find_map(input);
  if (!place || place->store.empty()) return std::optional<SeenSpace>();
  const auto run = maps::StoredRun::open_main(*place);
  if (!run) return tl::unexpected<core::Error>(run.error());
  const auto views = run->views();
  if (!views) return tl::unexpected<core::Error>(views.error());
  if (views->size() == 0) return std::optional<SeenSpace>();

  // Depth and pose of every keyframe
  SeenSpace space;
  const std::size_t count = views->size();
  space.rasters_.resize(count);
  space.camera_from_world_.resize(count);
  std::vector<std::optional<core::Error>> wrong(count);

  // Errors are kept by view, so that the first one is reported
  executor.parallel_for(count, [&](std::size_t v) {
    const auto cloud = views->read(v);
    if (!cloud) {
      wrong[v] = cloud.error();
      return;
    }

    const auto camera = maps::camera_of(run->stored().header.robots, views->robots[v]).color;
    space.rasters_[v] = cloud::depth_raster(**cloud, camera);
    space.camera_from_world_[v] =
        (world_from_map * views->world_from_camera[v] * cloud::sensor_pose(**cloud)).inverse();
  });

  // The first and last stamps date the map
  for (const auto& error : wrong) {
    if (error) return tl::unexpected<core::Error>(*error);
  }
  const auto [first, last] = std::minmax_element(views->stamps.begin(), views->stamps.end());
  space.first_stamp_s_ = *first;
  space.last_stamp_s_ = *last;
  return std::optional<SeenSpace>(std::move(space));
}

std::vector<std::uint8_t> SeenSpace::looked_through(const std::vector<Eigen::Vector3f>& points,
                                                    const core::Executor& executor) const {
  // Free space and surfaces are counted by point
  struct Votes {
    std::uint16_t free = 0, surface = 0;
  };
  constexpr std::size_t kBlock = 4096;
  std::vector<Votes> votes(points.size());
  std::vector<cloud::DepthLimits> limits;
  limits.reserve(rasters_.size());
  for (const cloud::DepthRaster& raster : rasters_) limits.emplace_back(raster);

  // Every view votes on every point of the block
  executor.parallel_for((points.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    const std::size_t last = std::min(points.size(), (block + 1) * kBlock);

    for (std::size_t v = 0; v < limits.size(); ++v) {
      const Eigen::Matrix3f turn = camera_from_world_[v].rotation.cast<float>();
      const Eigen::Vector3f shift = camera_from_world_[v].translation.cast<float>();
      for (std::size_t i = block * kBlock; i < last; ++i) {
        const cloud::Evidence evidence = limits[v].evidence(turn * points[i] + shift);
        if (evidence == cloud::Evidence::kFree) ++votes[i].free;
        if (evidence == cloud::Evidence::kSurface) ++votes[i].surface;
      }
    }
  });

  // A single view may err: it needs a clear majority
  std::vector<std::uint8_t> result(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    result[i] =
        votes[i].free > 0 && 2 * votes[i].free >= votes[i].surface + (votes[i].free == 1 ? 2 : 0) ? 1 : 0;
  return result;
}

}  // namespace plumbline::changes
