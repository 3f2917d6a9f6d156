// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closing/place_bundle.hpp"

#include <map>

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

/// The pose in question is the first, fixed ones follow. All pixels are carried to the query's camera: there
/// is one camera in a bundle.
class PairBundle {
 public:
  PairBundle(const PlaceView& query, const PlaceView& match, const std::vector<KeyframeId>& around,
             const ObservationNoise& noise, const Rigid3& camera_from_world)
      : query_(query), match_(match), noise_(noise) {
    problem.camera = query.camera;
    problem.poses.push_back({camera_from_world, false});
    for (const KeyframeId id : around) {
      poses_[id] = static_cast<int>(problem.poses.size());
      problem.poses.push_back({match.map->camera_from_world(id), true});
    }
  }
  void add(core::PointId id, int feature) {
    const maps::MapPoint& point = match_.map->point(id);
    problem.points.push_back(point.position);
    add_point(noise_.of(points_of(query_, query_.keyframe)[static_cast<std::size_t>(feature)], false), 0);
    for (const maps::Observation& o : point.observations) {
      const auto pose = poses_.find(o.keyframe);
      if (pose == poses_.end()) continue;
      auto seen = noise_.of(points_of(match_, o.keyframe)[static_cast<std::size_t>(o.feature)], o.aligned);
      seen.pixel = carried(seen.pixel);
      seen.pixel_sigma *= query_.camera.fx / match_.camera.fx;
      add_point(seen, pose->second);
    }
  }
  void add(core::LineId id, int feature) {
    const maps::MapLine& line = match_.map->line(id);
    problem.lines.push_back(geometry::line_through(line.start, line.end));
    add_line(noise_.of(lines_of(query_, query_.keyframe)[static_cast<std::size_t>(feature)]), 0);
    for (const maps::Observation& o : line.observations) {
      const auto pose = poses_.find(o.keyframe);
      if (pose == poses_.end()) continue;
      auto seen = noise_.of(lines_of(match_, o.keyframe)[static_cast<std::size_t>(o.feature)]);
      seen.start = carried(seen.start);
      seen.end = carried(seen.end);
      seen.pixel_sigma *= query_.camera.fx / match_.camera.fx;
      add_line(seen, pose->second);
    }
  }

  optimize::BundleProblem problem;

 private:
  static const std::vector<features::PointFeature>& points_of(const PlaceView& view, KeyframeId id) {
    return view.map->keyframe(id).features->points;
  }
  static const std::vector<features::LineFeature>& lines_of(const PlaceView& view, KeyframeId id) {
    return view.map->keyframe(id).features->lines;
  }
  [[nodiscard]] Eigen::Vector2d carried(const Eigen::Vector2d& pixel) const {
    return query_.camera.project(match_.camera.unproject(pixel.x(), pixel.y(), 1.0));
  }
  void add_point(optimize::BundlePointObservation seen, int pose) {
    seen.pose = pose;
    seen.point = static_cast<int>(problem.points.size()) - 1;
    problem.point_observations.push_back(seen);
  }
  void add_line(optimize::BundleLineObservation seen, int pose) {
    seen.pose = pose;
    seen.line = static_cast<int>(problem.lines.size()) - 1;
    problem.line_observations.push_back(seen);
  }

  const PlaceView& query_;
  const PlaceView& match_;
  const ObservationNoise& noise_;
  std::map<KeyframeId, int> poses_;
};

}  // namespace

Rigid3 adjust_pair(const PlaceView& query, const PlaceView& match, const std::vector<KeyframeId>& around,
                   const std::vector<tracking::PointMatch>& points,
                   const std::vector<tracking::LineMatch>& lines, const ObservationNoise& noise,
                   const Rigid3& camera_from_world) {
  PairBundle bundle(query, match, around, noise, camera_from_world);
  for (const tracking::PointMatch& m : points) bundle.add(m.point, m.feature);
  for (const tracking::LineMatch& m : lines) bundle.add(m.line, m.feature);
  const bool usable = optimize::adjust_bundle(bundle.problem, {}).usable;
  return usable ? bundle.problem.poses.front().camera_from_world : camera_from_world;
}

}  // namespace plumbline::mapping
