// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/local_bundle.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

constexpr int kMaxHeld = 20;

/// The keyframe, those that share most with it, and those its surface is aligned with.
std::vector<KeyframeId> window_of(const maps::Map& map, KeyframeId keyframe, int wanted) {
  std::vector<KeyframeId> window{keyframe};
  const auto append = [&](KeyframeId id) {
    if (static_cast<int>(window.size()) < wanted &&
        std::find(window.begin(), window.end(), id) == window.end()) {
      window.push_back(id);
    }
  };
  for (const maps::SurfaceEdge& edge : map.edges_of(keyframe)) append(edge.a == keyframe ? edge.b : edge.a);
  for (const auto& [id, shared] : map.covisible(keyframe, 20)) append(id);
  return window;
}

class Builder {
 public:
  Builder(const maps::Map& map, const sensor::Pinhole& camera, const LocalBundleOptions& options)
      : map_(map), options_(options) {
    bundle_.problem.camera = camera;
  }

  int add_pose(KeyframeId id, bool fixed) {
    const auto [found, inserted] = index_.try_emplace(id, static_cast<int>(bundle_.keyframes.size()));
    if (inserted) {
      bundle_.keyframes.push_back(id);
      bundle_.problem.poses.push_back({map_.camera_from_world(id), fixed});
    }
    return found->second;
  }
  [[nodiscard]] bool calm(KeyframeId id) const {
    return map_.keyframe(id).turn_rate <= options_.max_turn_rate;
  }
  [[nodiscard]] bool has(KeyframeId id) const { return index_.count(id) != 0; }

  /// The landmarks of the window; keyframes outside that see them are held.
  void add_landmarks(const std::vector<KeyframeId>& window) {
    std::vector<core::PointId> points;
    std::vector<core::LineId> lines;
    for (KeyframeId id : window) {
      for (core::PointId p : map_.points_of(id)) {
        if (p.valid() && map_.point(p).observations.size() >= 2) points.push_back(p);
      }
      for (core::LineId l : map_.lines_of(id)) {
        if (l.valid() && map_.line(l).observations.size() >= 2) lines.push_back(l);
      }
    }
    sort_unique(points);
    sort_unique(lines);
    hold_others(points, lines);
    for (core::PointId id : points) add_point(id);
    for (core::LineId id : lines) add_line(id);
  }

  void add_edges() {
    for (KeyframeId id : std::vector<KeyframeId>(bundle_.keyframes)) {
      for (const maps::SurfaceEdge& edge : map_.edges_of(id)) {
        if (edge.b != id || !has(edge.a)) continue;  // each edge once, at its newer end
        const int a = index_.at(edge.a);
        const int b = index_.at(edge.b);
        if (pose_fixed(a) && pose_fixed(b)) continue;
        bundle_.problem.edges.push_back({a, b, edge.b_from_a, edge.information});
      }
    }
  }

  LocalBundle take() {
    auto& poses = bundle_.problem.poses;
    const bool anchored = std::any_of(poses.begin(), poses.end(), [](const auto& p) { return p.fixed; });
    if (!anchored && !poses.empty()) {
      const auto oldest = std::min_element(bundle_.keyframes.begin(), bundle_.keyframes.end());
      poses[static_cast<std::size_t>(oldest - bundle_.keyframes.begin())].fixed = true;
    }
    return std::move(bundle_);
  }

 private:
  template <typename Ids>
  static void sort_unique(Ids& ids) {
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  }
  [[nodiscard]] bool pose_fixed(int i) const {
    return bundle_.problem.poses[static_cast<std::size_t>(i)].fixed;
  }

  void hold_others(const std::vector<core::PointId>& points, const std::vector<core::LineId>& lines) {
    std::map<KeyframeId, int> count;
    const auto vote = [&](const std::vector<maps::Observation>& observations) {
      for (const maps::Observation& o : observations) {
        if (!has(o.keyframe)) ++count[o.keyframe];
      }
    };
    for (core::PointId id : points) vote(map_.point(id).observations);
    for (core::LineId id : lines) vote(map_.line(id).observations);
    for (KeyframeId id : std::vector<KeyframeId>(bundle_.keyframes)) {
      for (const maps::SurfaceEdge& edge : map_.edges_of(id)) {
        const KeyframeId other = edge.a == id ? edge.b : edge.a;
        if (!has(other)) count[other] += 50;  // an edge holds as much as many landmarks do
      }
    }
    std::vector<std::pair<KeyframeId, int>> others(count.begin(), count.end());
    std::stable_sort(others.begin(), others.end(),
                     [](const auto& a, const auto& b) { return a.second > b.second; });
    for (std::size_t i = 0; i < others.size() && i < kMaxHeld; ++i) add_pose(others[i].first, true);
  }

  void add_point(core::PointId id) {
    const maps::MapPoint& point = map_.point(id);
    const int index = static_cast<int>(bundle_.points.size());
    bundle_.points.push_back(id);
    bundle_.problem.points.push_back(point.position);
    for (const maps::Observation& o : point.observations) {
      if (!has(o.keyframe) || !calm(o.keyframe)) continue;
      const features::PointFeature& f =
          map_.keyframe(o.keyframe).features->points[static_cast<std::size_t>(o.feature)];
      optimize::BundlePointObservation seen;
      seen.pose = index_.at(o.keyframe);
      seen.point = index;
      seen.pixel = f.pixel.cast<double>();
      seen.pixel_sigma = std::pow(options_.orb_scale_factor, f.octave);
      seen.depth = static_cast<double>(f.depth);
      seen.depth_sigma = f.depth > 0.0F ? sensor::depth_sigma(seen.depth) : 1.0;
      bundle_.problem.point_observations.push_back(seen);
      bundle_.point_seen.push_back({index, o.keyframe});
    }
  }

  void add_line(core::LineId id) {
    const maps::MapLine& line = map_.line(id);
    const int index = static_cast<int>(bundle_.lines.size());
    bundle_.lines.push_back(id);
    bundle_.problem.lines.push_back(geometry::line_through(line.start, line.end));
    for (const maps::Observation& o : line.observations) {
      if (!has(o.keyframe) || !calm(o.keyframe)) continue;
      const features::LineFeature& f =
          map_.keyframe(o.keyframe).features->lines[static_cast<std::size_t>(o.feature)];
      optimize::BundleLineObservation seen;
      seen.pose = index_.at(o.keyframe);
      seen.line = index;
      seen.start = f.segment.start.cast<double>();
      seen.end = f.segment.end.cast<double>();
      seen.pixel_sigma = 0.6;
      if (f.line3) {
        seen.has_depth = true;
        seen.start_camera = f.line3->start;
        seen.end_camera = f.line3->end;
        seen.start_sigma = std::max(0.003, std::sqrt(f.line3->start_covariance.trace()));
        seen.end_sigma = std::max(0.003, std::sqrt(f.line3->end_covariance.trace()));
      }
      bundle_.problem.line_observations.push_back(seen);
      bundle_.line_seen.push_back({index, o.keyframe});
    }
  }

  const maps::Map& map_;
  LocalBundleOptions options_;
  LocalBundle bundle_;
  std::map<KeyframeId, int> index_;
};

/// Landmarks that nobody else sees keep their place in front of their keyframe.
void carry_single_landmarks(maps::Map& map, KeyframeId id, const Rigid3& new_from_old_world) {
  for (core::PointId p : map.points_of(id)) {
    if (p.valid() && map.point(p).observations.size() == 1) {
      map.point(p).position = new_from_old_world * map.point(p).position;
    }
  }
  for (core::LineId l : map.lines_of(id)) {
    if (!l.valid() || map.line(l).observations.size() != 1) continue;
    map.line(l).start = new_from_old_world * map.line(l).start;
    map.line(l).end = new_from_old_world * map.line(l).end;
  }
}

}  // namespace

LocalBundle take_local_bundle(const maps::Map& map, KeyframeId keyframe, const sensor::Pinhole& camera,
                              const LocalBundleOptions& options) {
  Builder builder(map, camera, options);
  const std::vector<KeyframeId> window = window_of(map, keyframe, options.keyframes);
  for (KeyframeId id : window) builder.add_pose(id, id.index == 0 || !builder.calm(id));
  builder.add_landmarks(window);
  builder.add_edges();
  return builder.take();
}

void put_back(const LocalBundle& bundle, maps::Map& map) {
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    if (bundle.problem.poses[i].fixed) continue;
    const KeyframeId id = bundle.keyframes[i];
    const Rigid3& adjusted = bundle.problem.poses[i].camera_from_world;
    carry_single_landmarks(map, id, adjusted.inverse() * map.camera_from_world(id));
    map.set_pose(id, adjusted);
  }
  for (std::size_t i = 0; i < bundle.points.size(); ++i) {
    if (map.find_point(bundle.points[i]) != nullptr)
      map.point(bundle.points[i]).position = bundle.problem.points[i];
  }
  for (std::size_t i = 0; i < bundle.lines.size(); ++i) {
    if (map.find_line(bundle.lines[i]) == nullptr) continue;
    maps::MapLine& line = map.line(bundle.lines[i]);
    line.start = geometry::nearest_point(bundle.problem.lines[i], line.start);
    line.end = geometry::nearest_point(bundle.problem.lines[i], line.end);
  }
  for (std::size_t i = 0; i < bundle.point_seen.size(); ++i) {
    if (!bundle.problem.point_observations[i].outlier) continue;
    const core::PointId id = bundle.points[static_cast<std::size_t>(bundle.point_seen[i].landmark)];
    if (map.find_point(id) == nullptr) continue;
    map.unobserve(id, bundle.point_seen[i].keyframe);
    if (map.point(id).observations.empty()) map.remove_point(id);
  }
  for (std::size_t i = 0; i < bundle.line_seen.size(); ++i) {
    if (!bundle.problem.line_observations[i].outlier) continue;
    const core::LineId id = bundle.lines[static_cast<std::size_t>(bundle.line_seen[i].landmark)];
    if (map.find_line(id) == nullptr) continue;
    map.unobserve(id, bundle.line_seen[i].keyframe);
    if (map.line(id).observations.empty()) map.remove_line(id);
  }
}

}  // namespace plumbline::mapping
