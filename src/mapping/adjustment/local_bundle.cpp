// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/adjustment/local_bundle.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "plumbline/geometry/adjoint.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Matrix6d;
using geometry::Rigid3;

constexpr int kMaxHeld = 20;

/// Information of the tracked motion to a keyframe from the one it followed, 1 cm at best. No keyframe is
/// freer than this, whatever it shares with others: a keyframe that depends on a handful of wrong matches
/// would go where they pull it.
Matrix6d tracked_information(const maps::Keyframe& keyframe) {
  constexpr double kLeast_m = 0.01;
  constexpr double kRadPerMetre = 0.7;
  const double sigma_m = std::max(kLeast_m, keyframe.reference_sigma_m);
  return geometry::information_of(sigma_m, kRadPerMetre * sigma_m);
}

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
  for (KeyframeId id : also) append(id);
  for (const maps::SurfaceEdge& edge : map.edges_of(keyframe)) append(edge.a == keyframe ? edge.b : edge.a);
  for (const KeyframeId id : map.neighbours(keyframe, map.keyframe_count())) append(id);
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
  [[nodiscard]] bool has(KeyframeId id) const { return index_.count(id) != 0; }

  /// Holds the keyframes before and after on the tracked path: so every keyframe that moves is tied to one
  /// that is held, and cannot move away from a neighbour unnoticed.
  void hold_neighbours_on_the_way() {
    const std::vector<KeyframeId> window = bundle_.keyframes;
    for (const KeyframeId id : window) {
      const KeyframeId before = map_.keyframe(id).reference;
      if (before.valid() && map_.has_keyframe(before)) add_pose(before, true);
    }
    KeyframeId id = *std::min_element(window.begin(), window.end());
    const std::int32_t end = map_.next_keyframe_id(id.robot).index;
    for (; id.index < end; ++id.index) {
      if (!map_.has_keyframe(id)) continue;
      const KeyframeId before = map_.keyframe(id).reference;
      if (std::find(window.begin(), window.end(), before) != window.end()) add_pose(id, true);
    }
  }

  /// The landmarks of the window; keyframes outside that see them are held.
  void add_landmarks(const std::vector<KeyframeId>& window) {
    std::vector<core::PointId> points = map_.points_seen_by(window);
    std::vector<core::LineId> lines = map_.lines_seen_by(window);
    const auto once = [&](auto id) { return map_.find(id)->observations.size() < 2; };
    points.erase(std::remove_if(points.begin(), points.end(), once), points.end());
    lines.erase(std::remove_if(lines.begin(), lines.end(), once), lines.end());
    hold_others(points, lines);
    for (core::PointId id : points) add_point(id);
    for (core::LineId id : lines) add_line(id);
  }

  /// The depth of a distorted image is distorted, too, so its surfaces are weakened like its corners.
  void add_edges() {
    for (KeyframeId id : std::vector<KeyframeId>(bundle_.keyframes)) {
      const maps::Keyframe& keyframe = map_.keyframe(id);
      for (const maps::SurfaceEdge& edge : map_.edges_of(id)) {
        if (edge.b != id) continue;  // each edge once, at its newer end
        add_edge(edge.a, id, edge.b_from_a, edge.information / (motion_factor(edge.a) * motion_factor(id)));
      }
      if (!keyframe.reference.valid() || !map_.has_keyframe(keyframe.reference)) continue;
      // In a turn the observations count for less, so the tracked motion counts for more.
      const double turning = motion_factor(keyframe.reference) * motion_factor(id);
      add_edge(keyframe.reference, id, keyframe.camera_from_reference,
               turning * turning * tracked_information(keyframe));
    }
  }

  /// The first keyframe of a map has no parent; if nothing else in the window is held, the oldest keyframe
  /// is.
  LocalBundle take() {
    std::vector<optimize::BundlePose>& poses = bundle_.problem.poses;
    if (std::none_of(poses.begin(), poses.end(), [](const auto& pose) { return pose.fixed; })) {
      poses[static_cast<std::size_t>(index_.begin()->second)].fixed = true;
    }
    return std::move(bundle_);
  }

 private:
  [[nodiscard]] bool pose_fixed(int i) const {
    return bundle_.problem.poses[static_cast<std::size_t>(i)].fixed;
  }

  [[nodiscard]] double motion_factor(KeyframeId id) const {
    return options_.noise.motion_factor_of(map_.keyframe(id).turn_rate);
  }
  void add_edge(KeyframeId from, KeyframeId to, const Rigid3& to_from_from, const Matrix6d& information) {
    if (!has(from)) return;
    const int a = index_.at(from);
    const int b = index_.at(to);
    if (pose_fixed(a) && pose_fixed(b)) return;
    bundle_.problem.edges.push_back({a, b, to_from_from, information});
  }

  void hold_others(const std::vector<core::PointId>& points, const std::vector<core::LineId>& lines) {
    // Fixed keyframes keep the window in place relative to the rest of the map. They are ranked by how
    // much they share with the window.
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
        if (!has(other)) count[other] += 50;  // an edge counts like many landmarks
      }
    }

    // The strongest ones suffice, and their number bounds the time that the bundle takes.
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
      if (!has(o.keyframe)) continue;
      const features::PointFeature& f =
          map_.keyframe(o.keyframe).features->points[static_cast<std::size_t>(o.feature)];
      optimize::BundlePointObservation seen = options_.noise.of(f, o.aligned, motion_factor(o.keyframe));
      seen.pose = index_.at(o.keyframe);
      seen.point = index;
      bundle_.problem.point_observations.push_back(seen);
      bundle_.point_seen.push_back(o);
    }
  }

  void add_line(core::LineId id) {
    const maps::MapLine& line = map_.line(id);
    const int index = static_cast<int>(bundle_.lines.size());
    bundle_.lines.push_back(id);
    bundle_.problem.lines.push_back(geometry::line_through(line.start, line.end));
    for (const maps::Observation& o : line.observations) {
      if (!has(o.keyframe)) continue;
      const features::LineFeature& f =
          map_.keyframe(o.keyframe).features->lines[static_cast<std::size_t>(o.feature)];
      optimize::BundleLineObservation seen = options_.noise.of(f, motion_factor(o.keyframe));
      seen.pose = index_.at(o.keyframe);
      seen.line = index;
      bundle_.problem.line_observations.push_back(seen);
      bundle_.line_seen.push_back(o);
    }
  }

  const maps::Map& map_;
  LocalBundleOptions options_;
  LocalBundle bundle_;
  std::map<KeyframeId, int> index_;
};

/// Correction of the world around each keyframe: of those of the bundle that moved, then of those made after
/// the bundle was taken from the map.
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

bool moved_otherwise(const LocalBundle& bundle, const maps::Map& map) {
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    const Rigid3& now = map.camera_from_world(bundle.keyframes[i]);
    if (now.rotation != bundle.taken[i].rotation || now.translation != bundle.taken[i].translation)
      return true;
  }
  return false;
}

}  // namespace

LocalBundle take_local_bundle(const maps::Map& map, KeyframeId keyframe, const sensor::Pinhole& camera,
                              const LocalBundleOptions& options, const std::vector<KeyframeId>& also) {
  Builder builder(map, camera, options);
  const std::vector<KeyframeId> window = window_of(map, keyframe, also, options.keyframes);
  for (KeyframeId id : window) builder.add_pose(id, !map.parent(id).valid());
  builder.hold_neighbours_on_the_way();
  builder.add_landmarks(window);
  builder.add_edges();
  LocalBundle bundle = builder.take();
  bundle.next = map.next_keyframe_id(keyframe.robot);
  return bundle;
}

/// Poses of the bundle's keyframes, and of those made after it was taken.
static KeyframePoses poses_after(const LocalBundle& bundle, const MapCorrection& correction,
                                 const maps::Map& map) {
  KeyframePoses poses;
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    if (!bundle.problem.poses[i].fixed)
      poses.emplace_back(bundle.keyframes[i], bundle.problem.poses[i].camera_from_world);
  }
  for (const auto& [id, new_from_old_world] : correction) {
    if (id.robot == bundle.next.robot && id.index >= bundle.next.index)
      poses.emplace_back(id, map.camera_from_world(id) * new_from_old_world.inverse());
  }
  return poses;
}

std::optional<MapCorrection> put_back(const LocalBundle& bundle, maps::Map& map,
                                      std::optional<Contradiction>* refused) {
  if (moved_otherwise(bundle, map)) return std::nullopt;
  MapCorrection correction = CorrectionFinder(bundle, map).take();
  const KeyframePoses poses = poses_after(bundle, correction, map);
  if (const auto wrong = contradiction(map, poses)) {
    if (refused != nullptr) *refused = wrong;
    return std::nullopt;
  }
  for (const auto& [id, new_from_old_world] : correction) {
    carry_landmarks(bundle, id, new_from_old_world, map);
  }
  put_back_landmarks(bundle, map);
  for (const auto& [id, pose] : poses) map.set_pose(id, pose);
  drop_outliers(bundle, map);
  return correction;
}

}  // namespace plumbline::mapping
