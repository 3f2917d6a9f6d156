// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/local_mapping/keyframe_rule.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "plumbline/core/numbers.hpp"

namespace plumbline::mapping {
namespace {

constexpr int kDepthIsBack = 50;     // corners with depth
constexpr double kWellWithin = 0.8;  // of the limits: otherwise the next frame would trigger again
constexpr int kFewNormals = 10;      // landmarks; fewer are not enough for cones

struct ViewOverlap {
  double overlap = 1.0;
  double depth = 2.0;  ///< median, metres
};

/// Share of a keyframe's surface samples that the camera still sees, and their median depth.
ViewOverlap overlap_of(const maps::Keyframe& keyframe, const geometry::Rigid3& camera_from_keyframe,
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
  return {static_cast<double>(inside) / static_cast<double>(keyframe.surface.size()),
          static_cast<double>(core::median(std::move(depths)))};
}

/// Number of the keyframe's own landmarks that the frame has matched.
int landmarks_in_common(const maps::Map& map, core::KeyframeId keyframe, const tracking::TrackResult& track) {
  int common = 0;
  for (const auto& m : track.points)
    common += maps::seen_by(map.point(m.point).observations, keyframe) ? 1 : 0;
  for (const auto& m : track.lines) common += maps::seen_by(map.line(m.line).observations, keyframe) ? 1 : 0;
  return common;
}

int points_with_depth(const features::FrameFeatures& features) {
  return static_cast<int>(std::count_if(features.points.begin(), features.points.end(),
                                        [](const features::PointFeature& f) { return f.depth > 0.0F; }));
}

/// True if enough landmarks are matched: `wanted`, or half of the visible ones if a scene has fewer.
bool enough(std::size_t matched, int wanted, std::size_t visible) {
  return 2 * matched >= std::min(2 * static_cast<std::size_t>(wanted), visible);
}

}  // namespace

void KeyframeRuleOptions::declare(core::OptionTable& table) {
  table.choice("keyframe.rule", rule, {{"plain", Rule::kPlain}, {"cone", Rule::kCone}},
               "plain: by movement and by what is lost from view; cone: by the directions from which "
               "landmarks are seen");
  table.integer("keyframe.min_frames", min_frames, {1, 1000}, "",
                "Smallest number of frames between keyframes");
  table.integer("keyframe.max_frames", max_frames, {1, 10000}, "",
                "Largest number of frames between keyframes while the camera moves");

  table.number("keyframe.min_shared", min_shared, {0.05, 1.0}, "",
               "Make a keyframe when the share of features still tracked falls below this");
  table.number("keyframe.min_overlap", min_surface_overlap, {0.05, 1.0}, "",
               "Make a keyframe when the share of the last keyframe's surface in view falls below this");
  table.number("keyframe.max_parallax", max_parallax, {0.005, 2.0}, "",
               "Make a keyframe when movement over depth exceeds this");
  table.number("keyframe.max_rotation", max_rotation_rad, {0.01, 3.0}, "rad",
               "Make a keyframe when rotation exceeds this");

  table.integer("keyframe.min_features", min_features, {0, 10000}, "",
                "Number of tracked features below which a keyframe is urgent, if the image has more");
  table.boolean("keyframe.reuse", reuse,
                "Plain rule: return to an older keyframe that serves as well instead of making another");
  table.integer("keyframe.cone_max_wait", cone_patience, {0, 10000}, "",
                "Cone rule: number of frames after which a running bundle no longer delays a keyframe");
  table.number("keyframe.cone_max_shared", cone_max_shared, {0.05, 1.0}, "",
               "Cone rule: largest share of the last keyframe's landmarks that are matched in a new one");
  table.integer("keyframe.cone_min_points", cone_min_points, {0, 10000}, "",
                "Cone rule: smallest number of points that a keyframe matches, or half of the visible ones");

  table.integer("keyframe.cone_min_lines", cone_min_lines, {0, 10000}, "",
                "Cone rule: smallest number of lines that a keyframe matches, or half of the visible ones");
  table.number(
      "keyframe.cone_min_change", cone_min_change_rad, {0.001, 1.5}, "rad",
      "Cone rule: points whose viewing angle changed by more than this must be spread over the image");
  table.choice("keyframe.cone_balance", cone_balance,
               {{"above", Balance::kAbove}, {"below", Balance::kBelow}, {"off", Balance::kOff}},
               "Cone rule: required spread of these points (ECOG against its threshold)");

  table.boolean("keyframe.cone_scaled", cone_scaled,
                "Cone rule: scale thresholds with the scene, and wait six frames for balance at most");
  table.choice(
      "keyframe.urgent", urgent,
      {{"thin", Urgent::kThin}, {"nearly_lost", Urgent::kNearlyLost}, {"off", Urgent::kOff}},
      "Condition for a keyframe independent of the rule: thin: much less is tracked than after the last one, "
      "or fewer than min_features; nearly_lost: fewer than half of min_features; off: none");
}

bool KeyframeRule::plain_wants(const KeyframeDecision& d) const {
  const bool moved = d.parallax > options_.max_parallax || d.rotation_rad > options_.max_rotation_rad;
  const bool left = d.shared < options_.min_shared || d.overlap < options_.min_surface_overlap;
  const bool starving =
      d.frames_since >= options_.max_frames &&
      (d.parallax > 0.25 * options_.max_parallax || d.rotation_rad > 0.25 * options_.max_rotation_rad);
  return moved || left || starving;
}

bool KeyframeRule::is_urgent(const KeyframeDecision& d, int tracked) const {
  if (options_.urgent == KeyframeRuleOptions::Urgent::kOff) return false;
  const bool thin = tracked < options_.min_features && d.shared < 0.8;
  if (options_.urgent == KeyframeRuleOptions::Urgent::kNearlyLost) return thin;
  return d.shared < 0.5 * options_.min_shared || d.overlap < 0.5 * options_.min_surface_overlap || thin;
}

/// Cones need landmarks with normals; if there are next to none the plain rule decides.
bool KeyframeRule::knows_cones() const {
  return options_.rule == KeyframeRuleOptions::Rule::kCone && first_.counts.matched >= kFewNormals;
}

bool KeyframeRule::is_candidate(const ConeTerms& terms, const tracking::TrackResult& track,
                                bool mapper_idle) const {
  // Numbers of landmarks in the scene: those that should be seen, or those matched right after the keyframe.
  const bool scaled = options_.cone_scaled;
  const std::size_t points = scaled ? first_.points : track.visible_points.size();
  const std::size_t lines = scaled ? first_.lines : track.visible_lines.size();
  return (frames_since_ > options_.cone_patience || mapper_idle) &&
         enough(track.points.size(), options_.cone_min_points, points) &&
         enough(track.lines.size(), options_.cone_min_lines, lines) &&
         terms.shared <= options_.cone_max_shared;
}

ConeTerms KeyframeRule::cone_terms(const maps::Map& map, const tracking::TrackResult& track,
                                   bool mapper_idle) {
  ConeTerms terms;
  const Eigen::Vector3d centre_then = map.camera_from_world(track.reference).inverse().translation;
  const Eigen::Vector3d centre_now = track.camera_from_world.inverse().translation;
  std::vector<double> changes;
  std::vector<Eigen::Vector2d> pixels;
  terms.now.all = static_cast<int>(track.features->points.size());

  for (const tracking::PointMatch& match : track.points) {
    const maps::MapPoint& point = map.point(match.point);
    if (point.normal.isZero()) continue;
    ++terms.now.matched;
    const double then = viewing_angle(point.position, point.normal, centre_then);
    const double now = viewing_angle(point.position, point.normal, centre_now);
    if (viewing_zone(then) != viewing_zone(now)) ++terms.now.changed;
    changes.push_back(std::abs(now - then));
    pixels.push_back(camera_.project(track.camera_from_world * point.position));
  }

  const int common = landmarks_in_common(map, track.reference, track);

  // The first frame after a keyframe is the standard of comparison until the next keyframe.
  if (first_.keyframe != track.reference)
    first_ = {track.reference, common, track.points.size(), track.lines.size(), terms.now};
  terms.shared = first_.landmarks > 0 ? static_cast<double>(common) / first_.landmarks : 1.0;
  terms.threshold = cone_threshold(terms.now, first_.counts, options_.cone_epsilon, options_.cone_scaled);

  // With scaled thresholds at least about half of the points count, so that the balance is known even if
  // all angles have changed little.
  double least_change = options_.cone_min_change_rad;
  if (options_.cone_scaled && !changes.empty()) least_change = std::min(least_change, core::median(changes));
  GridCounts grid{};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (changes[i] > least_change) count_in_grid(pixels[i], camera_.width, camera_.height, grid);
  }

  terms.balance = grid_balance(grid);
  terms.candidate = is_candidate(terms, track, mapper_idle);
  terms.fires = terms.now.changed > terms.threshold.adaptive && balance_will_do(terms);
  return terms;
}

/// In the published program the sixth frame in a row is taken however its changes are spread.
bool KeyframeRule::balance_will_do(const ConeTerms& terms) {
  constexpr int kPatience = 6;
  if (balanced(terms.balance, options_.cone_balance)) return true;
  return options_.cone_scaled && terms.candidate && ++unbalanced_ >= kPatience;
}

KeyframeDecision KeyframeRule::decide(const maps::Map& map, const tracking::TrackResult& track,
                                      bool mapper_idle) {
  KeyframeDecision d;
  const maps::Keyframe& reference = map.keyframe(track.reference);
  d.frames_since = ++frames_since_;
  const int tracked = static_cast<int>(track.points.size() + track.lines.size());
  if (frames_since_ == 1) features_after_keyframe_ = tracked;

  // Parallax is movement over depth. The depth counts as 0.3 m at least, because close to a wall every small
  // movement would make a keyframe.
  const geometry::Rigid3 camera_from_keyframe =
      track.camera_from_world * map.camera_from_world(track.reference).inverse();
  const ViewOverlap view = overlap_of(reference, camera_from_keyframe, camera_);
  d.overlap = view.overlap;
  d.shared = features_after_keyframe_ > 0 ? static_cast<double>(tracked) / features_after_keyframe_ : 1.0;
  d.parallax = camera_from_keyframe.inverse().translation.norm() / std::max(0.3, view.depth);
  d.rotation_rad = geometry::rotation_angle(camera_from_keyframe.rotation);
  d.urgent = is_urgent(d, tracked);

  // Depth has returned after a keyframe without any: until the next keyframe
  // there is no surface to align with.
  if (reference.surface.empty() && points_with_depth(*track.features) >= kDepthIsBack) d.urgent = true;
  d.mapper_idle = mapper_idle;
  d.cone = cone_terms(map, track, mapper_idle);

  const bool by_cones = knows_cones();
  const bool wants = by_cones ? d.cone.candidate && d.cone.fires : plain_wants(d);
  d.wanted = d.frames_since >= options_.min_frames && (d.urgent || wants);

  // An older keyframe may serve as reference again, except if tracking gets thin and needs new landmarks.
  if (d.wanted && !d.urgent) d.reuse = reusable_keyframe(map, track);
  if (d.reuse.valid()) d.wanted = false;
  if (d.wanted)
    d.cause = !wants ? KeyframeCause::kUrgent : by_cones ? KeyframeCause::kCone : KeyframeCause::kPlain;
  return d;
}

core::KeyframeId KeyframeRule::reusable_keyframe(const maps::Map& map,
                                                 const tracking::TrackResult& track) const {
  if (!options_.reuse || options_.rule != KeyframeRuleOptions::Rule::kPlain) return {};
  std::map<core::KeyframeId, int> common;  // landmarks matched now that a keyframe saw
  const auto count = [&](const std::vector<maps::Observation>& observations) {
    for (const maps::Observation& o : observations) ++common[o.keyframe];
  };

  for (const auto& m : track.points) count(map.point(m.point).observations);
  for (const auto& m : track.lines) count(map.line(m.line).observations);
  const auto tracked = static_cast<double>(track.points.size() + track.lines.size());
  core::KeyframeId best;
  int most = 0;

  // The best keyframe saw most of the matched landmarks and lies well within the plain rule's limits: at
  // their border the next frame would ask for a keyframe again.
  for (const auto& [id, landmarks] : common) {
    if (id == track.reference || landmarks <= most || landmarks < options_.min_shared * tracked) continue;

    const geometry::Rigid3 camera_from_keyframe =
        track.camera_from_world * map.camera_from_world(id).inverse();
    const ViewOverlap view = overlap_of(map.keyframe(id), camera_from_keyframe, camera_);
    const double parallax = camera_from_keyframe.inverse().translation.norm() / std::max(0.3, view.depth);
    if (parallax > kWellWithin * options_.max_parallax ||
        geometry::rotation_angle(camera_from_keyframe.rotation) > kWellWithin * options_.max_rotation_rad ||
        1.0 - view.overlap > kWellWithin * (1.0 - options_.min_surface_overlap)) {
      continue;
    }

    best = id;
    most = landmarks;
  }

  return best;
}

void KeyframeRule::keyframe_made() {
  frames_since_ = 0;
  features_after_keyframe_ = 0;
  first_ = {};
  unbalanced_ = 0;
}

}  // namespace plumbline::mapping
