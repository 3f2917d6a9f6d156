// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "plumbline/geometry/line_triangulation.hpp"
#include "plumbline/mapping/local_mapping/landmark_triangulation.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::LineView;

/// Feature `feature` of keyframe `keyframe`, with its measurement.
struct Candidate {
  maps::Observation observation;
  LineView view;
};

bool measured(const features::LineFeature& f, double max_measured_m) {
  return f.line3 && std::max(f.line3->start.z(), f.line3->end.z()) <= max_measured_m;
}

LineView view_of(const maps::Map& map, const maps::Observation& o, const sensor::Pinhole& camera) {
  constexpr double kSigma_px = 0.6;
  const features::LineSegment& s =
      map.keyframe(o.keyframe).features->lines[static_cast<std::size_t>(o.feature)].segment;
  const auto normalised = [&](const Eigen::Vector2f& p) -> Eigen::Vector2d {
    return camera.unproject(static_cast<double>(p.x()), static_cast<double>(p.y()), 1.0).head<2>();
  };
  return {map.camera_from_world(o.keyframe), normalised(s.start), normalised(s.end), kSigma_px / camera.fx};
}

/// The line of `other` that looks like line `feature` of `keyframe`: of the same direction after the roll
/// between the images is undone, and clearly the most alike; -1: none.
int partner(const maps::Map& map, const maps::Observation& line, KeyframeId other, double max_measured_m,
            const TriangulationOptions& options) {
  const features::LineFeature& f =
      map.keyframe(line.keyframe).features->lines[static_cast<std::size_t>(line.feature)];

  // A camera that has rolled about its optical axis sees every line turned by the same angle.
  const Eigen::Matrix3d turn =
      map.camera_from_world(other).rotation * map.camera_from_world(line.keyframe).rotation.transpose();
  const Eigen::Rotation2Df roll(static_cast<float>(std::atan2(turn(1, 0), turn(0, 0))));
  const Eigen::Vector2f direction = roll * f.segment.direction();

  const auto min_cosine = static_cast<float>(std::cos(options.max_angle_rad));
  const auto& lines = map.keyframe(other).features->lines;
  int best = -1;
  int best_distance = 257;
  int second_distance = 257;

  for (std::size_t j = 0; j < lines.size(); ++j) {
    if (direction.dot(lines[j].segment.direction()) < min_cosine) continue;
    const int distance = features::hamming(f.descriptor, lines[j].descriptor);
    if (distance >= best_distance) {
      second_distance = std::min(second_distance, distance);
      continue;
    }

    second_distance = best_distance;
    best_distance = distance;
    best = static_cast<int>(j);
  }

  if (best_distance > options.max_line_hamming || !(best_distance < options.ratio * second_distance))
    return -1;

  // A partner that has a landmark or depth is refused only now: left out of the comparison, it would
  // make room for the second best.
  const bool taken =
      map.line_of(other, best).valid() || measured(lines[static_cast<std::size_t>(best)], max_measured_m);
  return taken ? -1 : best;
}

/// All candidates, or all but one: which of them are images of one line, and of which.
geometry::TriangulatedLine agree(std::vector<Candidate>& candidates, const TriangulationOptions& options) {
  geometry::LineTriangulationOptions how;
  how.min_angle_rad = options.min_line_angle_rad;
  how.max_depth_m = options.max_depth_m;
  how.max_relative_sigma = options.max_relative_sigma;

  const auto attempt = [&](std::size_t without) {
    std::vector<LineView> views;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (i != without) views.push_back(candidates[i].view);
    }
    return geometry::triangulate_line(views, how);
  };

  // One wrong match spoils the intersection of all planes, so each partner in turn is left out; the
  // first candidate is the line itself.
  geometry::TriangulatedLine line = attempt(candidates.size());
  const auto enough = static_cast<std::size_t>(options.min_line_views);
  for (std::size_t i = 1; !line.ok() && i < candidates.size() && candidates.size() > enough; ++i) {
    line = attempt(i);
    if (!line.ok()) continue;
    candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(i));
    break;
  }

  return line;
}

}  // namespace

std::vector<core::LineId> triangulate_lines(maps::Map& map, KeyframeId keyframe,
                                            const std::vector<KeyframeId>& neighbours, double max_measured_m,
                                            const sensor::Pinhole& camera,
                                            const TriangulationOptions& options) {
  std::vector<core::LineId> made;
  const auto& lines = map.keyframe(keyframe).features->lines;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const maps::Observation own{keyframe, static_cast<int>(i)};
    if (map.line_of(keyframe, own.feature).valid() || measured(lines[i], max_measured_m)) continue;

    std::vector<Candidate> candidates{{own, view_of(map, own, camera)}};
    for (KeyframeId other : neighbours) {
      const int j = partner(map, own, other, max_measured_m, options);
      if (j >= 0) candidates.push_back({{other, j}, view_of(map, {other, j}, camera)});
    }

    // Two interpretation planes always intersect; only a third view can reveal a wrong match.
    if (static_cast<int>(candidates.size()) < options.min_line_views) continue;
    const geometry::TriangulatedLine line = agree(candidates, options);
    if (!line.ok()) continue;

    maps::MapLine landmark;
    landmark.start = line.start;
    landmark.end = line.end;
    landmark.descriptor = lines[i].descriptor;
    landmark.visible = 1;
    landmark.found = 1;

    const core::LineId id = map.add_line(keyframe.robot, landmark);
    for (const Candidate& c : candidates) map.observe(id, c.observation.keyframe, c.observation.feature);
    made.push_back(id);
  }

  return made;
}

}  // namespace plumbline::mapping
