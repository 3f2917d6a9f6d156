// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/adjustment/map_bundle.hpp"

#include "plumbline/geometry/plucker.hpp"

namespace plumbline::mapping {

void put_back_landmarks(const MapBundle& bundle, maps::Map& map) {
  for (std::size_t i = 0; i < bundle.points.size(); ++i) {
    if (map.find(bundle.points[i]) != nullptr)
      map.point(bundle.points[i]).position = bundle.problem.points[i];
  }
  for (std::size_t i = 0; i < bundle.lines.size(); ++i) {
    if (map.find(bundle.lines[i]) == nullptr) continue;
    maps::MapLine& line = map.line(bundle.lines[i]);
    line.start = geometry::nearest_point(bundle.problem.lines[i], line.start);
    line.end = geometry::nearest_point(bundle.problem.lines[i], line.end);
  }
}

void drop_outliers(const MapBundle& bundle, maps::Map& map) {
  // The map may have changed while the bundle ran: an observation is removed only if the
  // feature still sees the same landmark.
  const auto drop = [&](auto id, auto seen_now, core::KeyframeId keyframe) {
    if (seen_now != id) return;
    map.unobserve(id, keyframe);
    if (map.find(id)->observations.empty()) map.remove(id);
  };

  for (std::size_t i = 0; i < bundle.point_seen.size(); ++i) {
    const maps::Observation& seen = bundle.point_seen[i];
    const optimize::BundlePointObservation& o = bundle.problem.point_observations[i];
    if (o.outlier)
      drop(bundle.points[static_cast<std::size_t>(o.point)], map.point_of(seen.keyframe, seen.feature),
           seen.keyframe);
  }

  for (std::size_t i = 0; i < bundle.line_seen.size(); ++i) {
    const maps::Observation& seen = bundle.line_seen[i];
    const optimize::BundleLineObservation& o = bundle.problem.line_observations[i];
    if (o.outlier)
      drop(bundle.lines[static_cast<std::size_t>(o.line)], map.line_of(seen.keyframe, seen.feature),
           seen.keyframe);
  }
}

}  // namespace plumbline::mapping
