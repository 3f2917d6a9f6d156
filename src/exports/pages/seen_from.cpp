// SPDX-License-Identifier: BSD-3-Clause
#include "pages/seen_from.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>

#include "plumbline/cloud/sensor_pose.hpp"

namespace plumbline::exports {
namespace {

constexpr double kSightCell_m = 0.08;
constexpr std::size_t kSightStep = 4;  // every so many pixels of an image, along and across

/// Cells of the world by their numbers, 21 bits each.
std::uint64_t cell_of(const Eigen::Vector3d& place) {
  std::uint64_t key = 0;
  for (int k = 0; k < 3; ++k) {
    const auto cell = static_cast<std::uint64_t>(
        static_cast<std::int64_t>(std::floor(place[k] / kSightCell_m)) + (1 << 20));
    key = key << 21U | (cell & 0x1fffffULL);
  }
  return key;
}

struct CellSight {
  std::uint64_t cell = 0;
  float cost = 0.0F;  ///< the distance, more where the surface is seen aslant
};

/// The best view of each cell in which a keyframe's cloud has points, sorted by cell.
std::vector<CellSight> sights_of(const cloud::Cloud& view, const geometry::Rigid3& world_from_camera) {
  // Clouds without rows are read as one row
  std::vector<CellSight> sights;
  const geometry::Rigid3 world_from_depth = world_from_camera * cloud::sensor_pose(view);
  const std::size_t width = view.height > 1 ? view.width : view.size();
  const std::size_t rows = view.height > 1 ? view.height : 1;

  // The cost grows with distance and with the angle of view
  for (std::size_t row = 0; row < rows; row += kSightStep) {
    for (std::size_t column = 0; column < width; column += kSightStep) {
      const cloud::Point& point = view[row * width + column];
      const Eigen::Vector3f p = point.getVector3fMap();
      if (!p.allFinite()) continue;

      // An unknown normal counts as seen at 60 degrees
      const float distance = p.norm();
      const float facing = std::abs(p.dot(point.getNormalVector3fMap())) / std::max(distance, 1e-3F);
      const float aslant = std::isfinite(facing) ? std::max(facing, 0.2F) : 0.5F;
      sights.push_back({cell_of(world_from_depth * p.cast<double>()), distance / aslant});
    }
  }

  // The lowest cost of each cell
  std::sort(sights.begin(), sights.end(), [](const CellSight& a, const CellSight& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.cost < b.cost;
  });
  sights.erase(std::unique(sights.begin(), sights.end(),
                           [](const CellSight& a, const CellSight& b) { return a.cell == b.cell; }),
               sights.end());
  return sights;
}

struct Best {
  float cost = std::numeric_limits<float>::max();
  float keyframe = 0.0F;
};
using BestByCell = std::unordered_map<std::uint64_t, Best>;

/// The keyframe with the lowest cost for each cell.
core::Result<BestByCell> best_by_cell(const MapSource& source, const maps::StoredViews& views,
                                      const std::vector<std::pair<std::size_t, std::size_t>>& chosen) {
  constexpr std::size_t kAtOnce = 16;
  BestByCell best;

  // Blocks bound the memory of decoded views
  for (std::size_t first = 0; first < chosen.size(); first += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, chosen.size() - first);
    std::vector<std::vector<CellSight>> sights(count);
    std::vector<std::optional<core::Error>> wrong(count);

    // Decoding runs in parallel
    source.executor().parallel_for(count, [&](std::size_t k) {
      const std::size_t view = chosen[first + k].first;
      const auto cloud = views.read(view);
      if (!cloud) {
        wrong[k] = cloud.error();
        return;
      }
      sights[k] = sights_of(**cloud, source.world_from_map() * views.world_from_camera[view]);
    });

    // Merged in order: of equal costs the first one stays
    for (std::size_t k = 0; k < count; ++k) {
      if (wrong[k]) return tl::unexpected(*wrong[k]);
      for (const CellSight& sight : sights[k]) {
        Best& there = best[sight.cell];
        if (sight.cost < there.cost) there = {sight.cost, static_cast<float>(chosen[first + k].second)};
      }
    }
    source.progress(first + count, chosen.size());
  }
  return best;
}

}  // namespace

/// The number of the keyframe that saw each point best; NaN if none did.
core::Result<std::vector<float>> best_views(const MapSource& source, const cloud::CloudFile& file,
                                            const std::map<core::KeyframeId, std::size_t>& numbers) {
  if (!source.has_store() || numbers.empty()) return std::vector<float>();
  const auto store = source.store("views");
  const auto views = (*store)->views();
  if (!views) return tl::unexpected(views.error());

  // Views of keyframes that the page shows
  std::vector<std::pair<std::size_t, std::size_t>> chosen;  // view, number of its keyframe
  for (std::size_t view = 0; view < views->size(); ++view) {
    const auto number = numbers.find(views->keyframes[view]);
    if (number != numbers.end()) chosen.emplace_back(view, number->second);
  }
  if (chosen.empty()) return std::vector<float>();
  const auto best = best_by_cell(source, *views, chosen);
  if (!best) return tl::unexpected(best.error());

  // By the point's cell
  std::vector<float> values;
  values.reserve(file.cloud->size());
  for (const cloud::Point& point : *file.cloud) {
    const auto found = best->find(cell_of(point.getVector3fMap().cast<double>() + file.shift));
    values.push_back(found == best->end() ? std::numeric_limits<float>::quiet_NaN() : found->second.keyframe);
  }
  return values;
}

}  // namespace plumbline::exports
