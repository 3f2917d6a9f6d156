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
#include "plumbline/core/executor.hpp"

namespace plumbline::cloud {

/// Leaves the points that `keep` says, columns and all.
template <typename Keep>
void leave(FusedCloud& points, const Keep& keep) {
  std::size_t count = 0;
  const bool robots = !points.robot_lead.empty();
  for (std::size_t i = 0; i < points.cloud->size(); ++i) {
    if (!keep(i)) continue;
    if (i != count) {
      points.cloud->points[count] = points.cloud->points[i];
      points.columns.observations[count] = points.columns.observations[i];
      points.columns.confidence[count] = points.columns.confidence[i];
      points.spread_m[count] = points.spread_m[i];
      points.weight[count] = points.weight[i];
      points.noise_m[count] = points.noise_m[i];
      if (robots) {
        points.columns.robot[count] = points.columns.robot[i];
        points.robot_lead[count] = points.robot_lead[i];
      }
    }
    ++count;
  }
  points.cloud->points.resize(count);
  points.columns.observations.resize(count);
  points.columns.confidence.resize(count);
  points.spread_m.resize(count);
  points.weight.resize(count);
  points.noise_m.resize(count);
  if (!robots) return;
  points.columns.robot.resize(count);
  points.robot_lead.resize(count);
}

/// All parts one after the other: cloud, observations, confidence and robots. Columns are put together side
/// by side, each part given back when it is copied.
inline FusedCloud joined(std::vector<FusedCloud>&& parts, const core::Executor& executor) {
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
  // Points are most of it: half of them each; what else is known of them goes with one half.
  for (FusedCloud& part : parts) {
    part.spread_m = part.weight = part.noise_m = {};
    part.robot_lead = {};
  }
  executor.parallel_for(2, [&](std::size_t k) {
    if (k == 0) return join([](FusedCloud & f) -> auto& { return f.cloud->points; });
    join([](FusedCloud & f) -> auto& { return f.columns.observations; });
    join([](FusedCloud & f) -> auto& { return f.columns.confidence; });
    join([](FusedCloud & f) -> auto& { return f.columns.robot; });
  });
  all.cloud->width = static_cast<std::uint32_t>(count);
  all.cloud->height = 1;
  all.cloud->is_dense = true;
  return all;
}

}  // namespace plumbline::cloud
