// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "plumbline/features/line_match.hpp"
#include "plumbline/tracking/association.hpp"

namespace plumbline::tracking {
namespace {

/// Projects a 3D segment, cut off at the near plane; false if it is not in the image.
bool project_segment(const maps::MapLine& line, const geometry::Rigid3& camera_from_world,
                     const sensor::Pinhole& camera, features::LineSegment& segment) {
  constexpr double kNear = 0.1;  // metres
  Eigen::Vector3d a = camera_from_world * line.start;
  Eigen::Vector3d b = camera_from_world * line.end;
  if (a.z() < kNear && b.z() < kNear) return false;
  if (a.z() < kNear) a += (b - a) * ((kNear - a.z()) / (b.z() - a.z()));
  if (b.z() < kNear) b += (a - b) * ((kNear - b.z()) / (a.z() - b.z()));

  segment.start = camera.project(a).cast<float>();
  segment.end = camera.project(b).cast<float>();
  const Eigen::Vector2f low = segment.start.cwiseMin(segment.end);
  const Eigen::Vector2f high = segment.start.cwiseMax(segment.end);
  return high.x() > 0.0F && high.y() > 0.0F && low.x() < static_cast<float>(camera.width) &&
         low.y() < static_cast<float>(camera.height) && segment.length() > 10.0F;
}

/// Geometry of a line feature of the frame, computed once for all landmarks.
struct LineCandidate {
  Eigen::Vector2f direction;
  Eigen::Vector2f middle;
  float length = 0.0F;
};

// Direction, middle and length of each line, computed once.
std::vector<LineCandidate> candidates_of(const features::FrameFeatures& frame) {
  std::vector<LineCandidate> candidates;
  candidates.reserve(frame.lines.size());
  for (const features::LineFeature& line : frame.lines) {
    candidates.push_back({line.segment.direction(), line.segment.middle(), line.segment.length()});
  }
  return candidates;
}

}  // namespace

std::vector<LineMatch> match_lines(const maps::Map& map, const std::vector<core::LineId>& lines,
                                   const PosedFrame& posed, double radius, const AssociationOptions& options,
                                   std::vector<core::LineId>* visible) {
  const features::FrameFeatures& frame = posed.features;
  const auto min_cosine = static_cast<float>(std::cos(options.max_line_angle_rad));
  const std::vector<LineCandidate> candidates = candidates_of(frame);
  std::vector<LineMatch> by_feature(frame.lines.size());

  for (core::LineId id : lines) {
    const maps::MapLine* line = map.find(id);
    features::LineSegment predicted;
    if (line == nullptr || !project_segment(*line, posed.camera_from_world, posed.camera, predicted))
      continue;

    if (visible != nullptr) visible->push_back(id);
    LineMatch best{id, -1, options.max_line_hamming + 1};
    const Eigen::Vector2f d = predicted.direction();
    const float length = predicted.length();

    // Similar in place, direction, length and descriptor
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (d.dot(candidates[i].direction) < min_cosine) continue;
      const Eigen::Vector2f r = candidates[i].middle - predicted.start;
      if (std::abs(d.x() * r.y() - d.y() * r.x()) > static_cast<float>(radius)) continue;
      const auto [shorter, longer] = std::minmax(length, candidates[i].length);
      if (shorter < static_cast<float>(options.min_line_ratio) * longer) continue;
      const features::LineFeature& candidate = frame.lines[i];
      if (features::overlap(predicted, candidate.segment) < 0.4) continue;
      const int distance = features::hamming(line->descriptor, candidate.descriptor);
      if (distance < best.distance) best = {id, static_cast<int>(i), distance};
    }

    // Each feature keeps its best landmark
    if (best.feature < 0) continue;
    LineMatch& slot = by_feature[static_cast<std::size_t>(best.feature)];
    if (slot.feature < 0 || best.distance < slot.distance) slot = best;
  }

  std::vector<LineMatch> matches;
  for (const LineMatch& m : by_feature) {
    if (m.feature >= 0) matches.push_back(m);
  }

  return matches;
}

}  // namespace plumbline::tracking
