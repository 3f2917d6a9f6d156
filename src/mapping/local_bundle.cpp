// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/local_bundle.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

constexpr int kMaxHeld = 20;

/// The keyframe, those not adjusted yet, those its surface is aligned with, and those that share most with
/// it.
std::vector<KeyframeId> window_of(const maps::Map& map, KeyframeId keyframe,
                                  const std::vector<KeyframeId>& also, int wanted) {
  std::vector<KeyframeId> window{keyframe};
  const auto append = [&](KeyframeId id) {
    if (static_cast<int>(window.size()) < wanted &&
        std::find(window.begin(), window.end(), id) == window.end()) {
      window.push_back(id);
    }
  };
  for (KeyframeId id : also) {
    if (map.has_keyframe(id)) append(id);
  }
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
      bundle_.taken.push_back(map_.camera_from_world(id));
      bundle_.problem.poses.push_back({bundle_.taken.back(), fixed});
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

  /// A sheared picture's depth is sheared, too: its surfaces say as little about where it was as its corners.
  void add_edges() {
    for (KeyframeId id : std::vector<KeyframeId>(bundle_.keyframes)) {
      for (const maps::SurfaceEdge& edge : map_.edges_of(id)) {
        if (edge.b != id || !has(edge.a)) continue;  // each edge once, at its newer end
        if (!calm(edge.a) || !calm(edge.b)) continue;
        const int a = index_.at(edge.a);
        const int b = index_.at(edge.b);
        if (pose_fixed(a) && pose_fixed(b)) continue;
        bundle_.problem.edges.push_back({a, b, edge.b_from_a, edge.information});
      }
    }
  }

  /// Without a keyframe that is held and speaks, the oldest that speaks is held: all could drift otherwise.
  LocalBundle take() {
    hold_loose_poses();
    KeyframeId oldest;
    bool anchored = false;
    for (std::size_t i = 0; i < bundle_.keyframes.size(); ++i) {
      const KeyframeId id = bundle_.keyframes[i];
      if (!calm(id)) continue;
      anchored = anchored || bundle_.problem.poses[i].fixed;
      if (!oldest.valid() || id < oldest) oldest = id;
    }
    if (!anchored && oldest.valid()) {
      bundle_.problem.poses[static_cast<std::size_t>(index_.at(oldest))].fixed = true;
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

  /// A pose that little ties to those that speak goes where a few wrong matches pull it: it stays.
  void hold_loose_poses() {
    constexpr int kFewest = 40;  // points that another sees, too
    std::vector<int> ties(bundle_.keyframes.size(), 0);
    const auto tie = [&ties](const auto& observations, auto landmark, int worth) {
      for (std::size_t begin = 0, end = 0; begin < observations.size(); begin = end) {
        while (end < observations.size() && landmark(observations[end]) == landmark(observations[begin]))
          ++end;
        if (end - begin < 2) continue;
        for (std::size_t i = begin; i < end; ++i)
          ties[static_cast<std::size_t>(observations[i].pose)] += worth;
      }
    };
    const optimize::BundleProblem& problem = bundle_.problem;
    tie(
        problem.point_observations, [](const auto& o) { return o.point; }, 1);
    tie(
        problem.line_observations, [](const auto& o) { return o.line; }, 2);
    for (const optimize::BundleEdge& edge : problem.edges) {
      ties[static_cast<std::size_t>(edge.a)] += kFewest;
      ties[static_cast<std::size_t>(edge.b)] += kFewest;
    }
    for (std::size_t i = 0; i < ties.size(); ++i) {
      if (ties[i] < kFewest) bundle_.problem.poses[i].fixed = true;
    }
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
      optimize::BundlePointObservation seen = options_.noise.of(f, o.aligned);
      seen.pose = index_.at(o.keyframe);
      seen.point = index;
      bundle_.problem.point_observations.push_back(seen);
      bundle_.point_seen.push_back({index, o});
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
      optimize::BundleLineObservation seen = options_.noise.of(f);
      seen.pose = index_.at(o.keyframe);
      seen.line = index;
      bundle_.problem.line_observations.push_back(seen);
      bundle_.line_seen.push_back({index, o});
    }
  }

  const maps::Map& map_;
  LocalBundleOptions options_;
  LocalBundle bundle_;
  std::map<KeyframeId, int> index_;
};

/// Where the world around each keyframe went: those of the bundle that moved, then those made after the take.
class CorrectionFinder {
 public:
  CorrectionFinder(const LocalBundle& bundle, const maps::Map& map) : bundle_(bundle), map_(map) {
    for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
      const optimize::BundlePose& pose = bundle.problem.poses[i];
      if (!pose.fixed) found_[bundle.keyframes[i]] = pose.camera_from_world.inverse() * bundle.taken[i];
    }
    for (KeyframeId id = bundle.next; id.index < map.next_keyframe_id(id.robot).index; ++id.index) {
      if (map.has_keyframe(id)) carry(id);
    }
  }
  [[nodiscard]] MapCorrection take() { return std::move(found_); }

 private:
  /// The tree may hang a keyframe on a younger one: parents first.
  void carry(KeyframeId id) {
    const KeyframeId parent = map_.parent(id);
    if (found_.count(id) != 0 || !parent.valid()) return;
    if (parent.robot == bundle_.next.robot && parent.index >= bundle_.next.index) carry(parent);
    const auto moved = found_.find(parent);
    if (moved != found_.end()) found_[id] = Rigid3(moved->second);
  }

  const LocalBundle& bundle_;
  const maps::Map& map_;
  MapCorrection found_;
};

/// Landmarks outside the bundle keep their place in front of the keyframe that saw them first.
void carry_landmarks(const LocalBundle& bundle, KeyframeId id, const Rigid3& new_from_old_world,
                     maps::Map& map) {
  const auto mine = [&](const std::vector<maps::Observation>& seen) { return seen.front().keyframe == id; };
  for (core::PointId p : map.points_of(id)) {
    if (!p.valid() || !mine(map.point(p).observations)) continue;
    if (std::binary_search(bundle.points.begin(), bundle.points.end(), p)) continue;
    maps::MapPoint& point = map.point(p);
    point.position = new_from_old_world * point.position;
    point.normal = new_from_old_world.rotation * point.normal;
  }
  for (core::LineId l : map.lines_of(id)) {
    if (!l.valid() || !mine(map.line(l).observations)) continue;
    if (std::binary_search(bundle.lines.begin(), bundle.lines.end(), l)) continue;
    map.line(l).start = new_from_old_world * map.line(l).start;
    map.line(l).end = new_from_old_world * map.line(l).end;
  }
}

bool same(const Rigid3& a, const Rigid3& b) {
  return a.rotation == b.rotation && a.translation == b.translation;
}

bool moved_otherwise(const LocalBundle& bundle, const maps::Map& map) {
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    const KeyframeId id = bundle.keyframes[i];
    if (map.has_keyframe(id) && !same(map.camera_from_world(id), bundle.taken[i])) return true;
  }
  return false;
}

void put_back_landmarks(const LocalBundle& bundle, maps::Map& map) {
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
}

/// Observations that did not fit go, unless the landmark is seen otherwise by now.
void drop_outliers(const LocalBundle& bundle, maps::Map& map) {
  for (std::size_t i = 0; i < bundle.point_seen.size(); ++i) {
    if (!bundle.problem.point_observations[i].outlier) continue;
    const LocalBundle::Seen& seen = bundle.point_seen[i];
    const core::PointId id = bundle.points[static_cast<std::size_t>(seen.landmark)];
    if (!map.has_keyframe(seen.by.keyframe) || map.point_of(seen.by.keyframe, seen.by.feature) != id)
      continue;
    map.unobserve(id, seen.by.keyframe);
    if (map.point(id).observations.empty()) map.remove_point(id);
  }
  for (std::size_t i = 0; i < bundle.line_seen.size(); ++i) {
    if (!bundle.problem.line_observations[i].outlier) continue;
    const LocalBundle::Seen& seen = bundle.line_seen[i];
    const core::LineId id = bundle.lines[static_cast<std::size_t>(seen.landmark)];
    if (!map.has_keyframe(seen.by.keyframe) || map.line_of(seen.by.keyframe, seen.by.feature) != id) continue;
    map.unobserve(id, seen.by.keyframe);
    if (map.line(id).observations.empty()) map.remove_line(id);
  }
}

}  // namespace

LocalBundle take_local_bundle(const maps::Map& map, KeyframeId keyframe, const sensor::Pinhole& camera,
                              const LocalBundleOptions& options, const std::vector<KeyframeId>& also) {
  Builder builder(map, camera, options);
  const std::vector<KeyframeId> window = window_of(map, keyframe, also, options.keyframes);
  for (KeyframeId id : window) builder.add_pose(id, id.index == 0 || !builder.calm(id));
  builder.add_landmarks(window);
  builder.add_edges();
  LocalBundle bundle = builder.take();
  bundle.next = map.next_keyframe_id(keyframe.robot);
  return bundle;
}

std::optional<MapCorrection> put_back(const LocalBundle& bundle, maps::Map& map) {
  if (moved_otherwise(bundle, map)) return std::nullopt;
  MapCorrection correction = CorrectionFinder(bundle, map).take();
  for (const auto& [id, new_from_old_world] : correction) {
    if (map.has_keyframe(id)) carry_landmarks(bundle, id, new_from_old_world, map);
  }
  put_back_landmarks(bundle, map);
  for (const auto& [id, new_from_old_world] : correction) {  // those made after the take
    if (id.robot == bundle.next.robot && id.index >= bundle.next.index && map.has_keyframe(id))
      map.set_pose(id, map.camera_from_world(id) * new_from_old_world.inverse());
  }
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    if (!bundle.problem.poses[i].fixed && map.has_keyframe(bundle.keyframes[i]))
      map.set_pose(bundle.keyframes[i], bundle.problem.poses[i].camera_from_world);
  }
  drop_outliers(bundle, map);
  return correction;
}

}  // namespace plumbline::mapping
