// SPDX-License-Identifier: BSD-3-Clause
#include "grids/rays.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <optional>

#include "plumbline/cloud/sensor_pose.hpp"

namespace plumbline::exports {
namespace {

/// Every third column and row of an organised cloud (of every second pixel), else as many points.
ViewRays rays_of(const cloud::Cloud& view, const geometry::Rigid3& world_from_camera) {
  constexpr std::size_t kStep = 3;
  ViewRays rays;
  const geometry::Rigid3 world_from_depth = world_from_camera * cloud::sensor_pose(view);
  rays.origin = world_from_depth.translation;
  const bool organised = view.height > 1;
  const auto take = [&](std::size_t i) {
    const Eigen::Vector3f p = view[i].getVector3fMap();
    if (p.allFinite()) rays.ends.push_back((world_from_depth * p.cast<double>()).cast<float>());
  };
  if (!organised) {
    for (std::size_t i = 0; i < view.size(); i += kStep * kStep) take(i);
    return rays;
  }
  for (std::size_t row = 0; row < view.height; row += kStep) {
    for (std::size_t column = 0; column < view.width; column += kStep) take(row * view.width + column);
  }
  return rays;
}

}  // namespace

/// Calls `take` with the rays of each view, in the order of the views.
core::Result<void> for_each_view(const MapSource& source,
                                 const std::function<core::Result<void>(const ViewRays&)>& take) {
  const auto store = source.store("free space");
  if (!store) return tl::unexpected(store.error());

  const auto views = (*store)->views();
  if (!views) return tl::unexpected(views.error());
  if (views->size() == 0) {
    return core::input_error(
        fmt::format("{}: the map holds no clouds of its views, so that free space is not known",
                    source.request().input.string()));
  }

  // Blocks bound the memory of decoded views
  constexpr std::size_t kAtOnce = 16;
  for (std::size_t first = 0; first < views->size(); first += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, views->size() - first);
    std::vector<ViewRays> rays(count);
    std::vector<std::optional<core::Error>> wrong(count);

    // Decoding is the slow part and runs in parallel
    source.executor().parallel_for(count, [&](std::size_t k) {
      const auto cloud = views->read(first + k);
      if (!cloud) {
        wrong[k] = cloud.error();
        return;
      }
      rays[k] = rays_of(**cloud, source.world_from_map() * views->world_from_camera[first + k]);
    });

    // Views are taken in order, so that results do not depend on threads
    for (std::size_t k = 0; k < count; ++k) {
      if (wrong[k]) return tl::unexpected(*wrong[k]);
      if (auto taken = take(rays[k]); !taken) return taken;
    }

    source.progress(first + count, views->size());
  }

  return {};
}

}  // namespace plumbline::exports
