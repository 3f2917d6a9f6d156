// SPDX-License-Identifier: BSD-3-Clause
#include "report_fit.hpp"

#include <cmath>
#include <vector>

#include "plumbline/core/numbers.hpp"
#include "plumbline/optimize/pose_terms.hpp"
#include "report_table.hpp"

namespace plumbline::report {
namespace {

FamilyFit summarise(const std::vector<double>& distances) {
  if (distances.empty()) return {};
  return {distances.size(), core::quantile(distances, 0.5), core::quantile(distances, 0.9)};
}

}  // namespace

MapFit fit_of(const maps::Map& map, const sensor::Pinhole& camera,
              const std::map<std::int32_t, sensor::Pinhole>& cameras) {
  const auto camera_of = [&](core::KeyframeId id) -> const sensor::Pinhole& {
    const auto own = cameras.find(id.robot);
    return own == cameras.end() ? camera : own->second;
  };

  // Points that several keyframes observed.
  std::vector<double> points, depths, lines;
  for (const core::PointId id : map.point_ids()) {
    const maps::MapPoint& point = map.point(id);
    if (point.observations.size() < 2) continue;  // fits its only observation exactly

    // Residuals of the adjustment, without weights.
    for (const maps::Observation& o : point.observations) {
      const auto& corner = map.keyframe(o.keyframe).features->points[static_cast<std::size_t>(o.feature)];
      optimize::PointTerm term;  // sigmas of 1: residuals in pixels and metres
      term.world = point.position;
      term.pixel = corner.pixel.cast<double>();
      term.depth = static_cast<double>(corner.depth);

      Eigen::Vector3d r;
      const int rows = optimize::point_residual(term, map.camera_from_world(o.keyframe),
                                                camera_of(o.keyframe), r, nullptr);
      if (rows >= 2) points.push_back(r.head<2>().norm());
      if (rows == 3) depths.push_back(1e3 * std::abs(r.z()));
    }
  }

  for (const core::LineId id : map.line_ids()) {
    const maps::MapLine& line = map.line(id);
    if (line.observations.size() < 2) continue;

    // Lines in the same way.
    for (const maps::Observation& o : line.observations) {
      const auto& segment =
          map.keyframe(o.keyframe).features->lines[static_cast<std::size_t>(o.feature)].segment;
      const sensor::Pinhole& c = camera_of(o.keyframe);
      optimize::LineTerm term;
      term.world = geometry::line_through(line.start, line.end);
      term.start = segment.start.cast<double>();
      term.end = segment.end.cast<double>();

      // Distances of both ends from the line.
      Eigen::Vector2d r;
      const auto projection = geometry::line_projection(c.fx, c.fy, c.cx, c.cy);
      if (!optimize::line_residual(term, map.camera_from_world(o.keyframe), projection, r, nullptr)) continue;
      lines.push_back(std::abs(r.x()));
      lines.push_back(std::abs(r.y()));
    }
  }

  return {summarise(points), summarise(depths), summarise(lines)};
}

}  // namespace plumbline::report
