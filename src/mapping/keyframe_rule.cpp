// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/keyframe_rule.hpp"

#include <algorithm>
#include <vector>

namespace plumbline::mapping {
namespace {

struct View {
  double overlap = 1.0;
  double depth = 2.0;  ///< median, metres
};

/// Share of a keyframe's surface samples that the camera still sees, and their median depth.
View view_of(const maps::Keyframe& keyframe, const geometry::Rigid3& camera_from_keyframe,
             const sensor::Pinhole& camera) {
  if (keyframe.surface.empty()) return {};
  int inside = 0;
  std::vector<float> depths;
  depths.reserve(keyframe.surface.size());
  for (const maps::SurfaceSample& s : keyframe.surface) {
    depths.push_back(s.point.z());
    const Eigen::Vector3d p = camera_from_keyframe * s.point.cast<double>();
    if (p.z() > 0.1 && camera.contains(camera.project(p))) ++inside;
  }
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return {static_cast<double>(inside) / static_cast<double>(keyframe.surface.size()),
          static_cast<double>(*middle)};
}

}  // namespace

void KeyframeRuleOptions::declare(core::OptionTable& table) {
  table.integer("keyframe.min_frames", min_frames, {1, 1000}, "", "Frames between keyframes, at least");
  table.integer("keyframe.max_frames", max_frames, {1, 10000}, "",
                "Frames between keyframes, at most, while the camera moves");
  table.number("keyframe.min_shared", min_shared, {0.05, 1.0}, "",
               "A smaller share of features still tracked makes a keyframe");
  table.number("keyframe.min_overlap", min_surface_overlap, {0.05, 1.0}, "",
               "A smaller share of the last keyframe's surface in view makes a keyframe");
  table.number("keyframe.max_parallax", max_parallax, {0.005, 2.0}, "",
               "More movement over depth makes a keyframe");
  table.number("keyframe.max_rotation", max_rotation_rad, {0.01, 3.0}, "rad",
               "More rotation makes a keyframe");
  table.integer("keyframe.min_features", min_features, {0, 10000}, "",
                "With fewer features tracked a keyframe is urgent, if the scene has more to offer");
}

KeyframeDecision KeyframeRule::decide(const maps::Map& map, core::KeyframeId reference,
                                      const tracking::TrackResult& track, const sensor::Pinhole& camera) {
  KeyframeDecision d;
  d.frames_since = ++frames_since_;
  const int tracked = static_cast<int>(track.points.size() + track.lines.size());
  if (frames_since_ == 1) features_after_keyframe_ = tracked;
  const geometry::Rigid3 camera_from_keyframe =
      track.camera_from_world * map.camera_from_world(reference).inverse();
  const View view = view_of(map.keyframe(reference), camera_from_keyframe, camera);
  d.overlap = view.overlap;
  d.shared = features_after_keyframe_ > 0 ? static_cast<double>(tracked) / features_after_keyframe_ : 1.0;
  d.parallax = camera_from_keyframe.inverse().translation.norm() / std::max(0.3, view.depth);
  d.rotation_rad = geometry::rotation_angle(camera_from_keyframe.rotation);
  d.urgent = d.shared < 0.5 * options_.min_shared || d.overlap < 0.5 * options_.min_surface_overlap ||
             (tracked < options_.min_features && d.shared < 0.8);
  const bool moved = d.parallax > options_.max_parallax || d.rotation_rad > options_.max_rotation_rad;
  const bool left = d.shared < options_.min_shared || d.overlap < options_.min_surface_overlap;
  const bool starving =
      d.frames_since >= options_.max_frames &&
      (d.parallax > 0.25 * options_.max_parallax || d.rotation_rad > 0.25 * options_.max_rotation_rad);
  d.wanted = d.frames_since >= options_.min_frames && (d.urgent || moved || left || starving);
  return d;
}

void KeyframeRule::keyframe_made() {
  frames_since_ = 0;
  features_after_keyframe_ = 0;
}

}  // namespace plumbline::mapping
