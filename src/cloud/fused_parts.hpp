// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Fused clouds cut down and put together, with all that is known of their points.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "plumbline/cloud/voxel_map.hpp"

namespace plumbline::cloud {

/// The points that `keep` says, columns and all.
template <typename Keep>
FusedCloud chosen(const FusedCloud& points, const Keep& keep) {
  FusedCloud result;
  result.cloud = std::make_shared<Cloud>();
  for (std::size_t i = 0; i < points.cloud->size(); ++i) {
    if (!keep(i)) continue;
    result.cloud->points.push_back((*points.cloud)[i]);
    result.columns.observations.push_back(points.columns.observations[i]);
    result.columns.confidence.push_back(points.columns.confidence[i]);
    result.spread_m.push_back(points.spread_m[i]);
    result.weight.push_back(points.weight[i]);
    result.noise_m.push_back(points.noise_m[i]);
    if (points.robot_lead.empty()) continue;
    result.columns.robot.push_back(points.columns.robot[i]);
    result.robot_lead.push_back(points.robot_lead[i]);
  }
  return result;
}

/// All parts one after the other. Room is taken once and each part given back when it is copied: what has
/// been joined and what has not is never in memory twice.
inline FusedCloud joined(std::vector<FusedCloud>&& parts) {
  FusedCloud all;
  all.cloud = std::make_shared<Cloud>();
  std::size_t count = 0;
  for (const FusedCloud& part : parts) count += part.cloud->size();
  const auto join = [&](const auto& column_of) {
    auto& whole = column_of(all);
    whole.reserve(count);
    for (FusedCloud& part : parts) {
      auto& column = column_of(part);
      whole.insert(whole.end(), column.begin(), column.end());
      column = {};
    }
  };
  join([](FusedCloud & f) -> auto& { return f.columns.observations; });
  join([](FusedCloud & f) -> auto& { return f.columns.confidence; });
  join([](FusedCloud & f) -> auto& { return f.columns.robot; });
  join([](FusedCloud & f) -> auto& { return f.robot_lead; });
  join([](FusedCloud & f) -> auto& { return f.spread_m; });
  join([](FusedCloud & f) -> auto& { return f.weight; });
  join([](FusedCloud & f) -> auto& { return f.noise_m; });
  join([](FusedCloud & f) -> auto& { return f.cloud->points; });
  all.cloud->width = static_cast<std::uint32_t>(count);
  all.cloud->height = 1;
  all.cloud->is_dense = true;
  return all;
}

}  // namespace plumbline::cloud
