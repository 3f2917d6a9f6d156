// SPDX-License-Identifier: BSD-3-Clause
// The plan of a map: what plans finds in its cloud and the rays of its views.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <limits>

#include "drawings/plan_sheets.hpp"
#include "grids/rays.hpp"

namespace plumbline::exports {
namespace {

/// An error with the heights of the points, from which a user can choose another cut.
core::Error no_wall_error(const MapSource& source, const cloud::CloudFile& file) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const cloud::Point& p : *file.cloud) {
    low = std::min(low, file.shift.z() + static_cast<double>(p.z));
    high = std::max(high, file.shift.z() + static_cast<double>(p.z));
  }
  const double floor_m = source.floor_m();
  const double cut_m = source.options().cut_m;
  const bool beside = floor_m + cut_m < low || floor_m + cut_m > high;
  return {core::ErrorKind::kInput,
          fmt::format(
              "{}: no wall is seen at {:g} m over the floor, which is taken to be at {:g} m; points are at "
              "heights of {:.2f} to {:.2f} m; {}choose another --cut",
              source.request().input.string(), cut_m, floor_m, low, high,
              beside && source.options().storey < 0 ? "find the floor with --storey 0, or " : "")};
}

}  // namespace

core::Result<plans::WallPlan> plan_of(MapSource& source) {
  if (auto up = source.need_upright("a plan"); !up) return tl::unexpected(up.error());
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());

  if (!(*cloud)->has_normals) {
    return core::input_error(fmt::format(
        "{}: a plan needs normals, which this cloud has not; run a filter chain with normals over it first",
        source.request().input.string()));
  }

  // Floats hold the points only less their shift, which a map with rays has not.
  plans::PlanInput of{*(*cloud)->cloud, source.floor_m() - (*cloud)->shift.z(), source.options().cut_m, {}};
  if (source.has_store()) of.views = [&](const auto& take) { return for_each_view(source, take); };
  auto plan = plans::find_walls(of, source.executor());
  if (!plan) return plan;
  if (plan->walls.empty()) return tl::unexpected(no_wall_error(source, **cloud));
  return plans::moved(std::move(*plan), Eigen::Matrix2d::Identity(), (*cloud)->shift.head<2>());
}

}  // namespace plumbline::exports
