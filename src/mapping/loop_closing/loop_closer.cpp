// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/loop_closing/loop_closer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "loop_closing/inter_robot_loops.hpp"
#include "plumbline/mapping/loop_closing/relocalisation.hpp"
#include "plumbline/maps/components.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

constexpr int kRelated = 5;             // shared landmarks: the same surroundings, not a loop
constexpr std::size_t kAroundLoop = 8;  // keyframes on each side whose landmarks are compared
constexpr int kDisputing = 5;           // keyframes whose loops agree against the path

/// The query's pose in the world according to the loop.
Rigid3 world_from_query(const maps::Map& map, const Loop& loop) {
  return map.camera_from_world(loop.match).inverse() * loop.evidence.query_from_match.inverse();
}

}  // namespace

void LoopOptions::declare(core::OptionTable& table) {
  table.boolean("loops", enabled, "Recognise places and close loops");
  table.number("loops.min_gap", min_gap_s, {0.0, 3600.0}, "s",
               "Shortest time between the keyframes of a loop");
  table.integer("loops.min_consistent", agreeing, {1, 20}, "",
                "Number of verified keyframes that must agree before a loop is closed");
  table.number("loops.max_alternative", max_alternative, {0.0, 1.0}, "",
               "Largest share of these that may agree on another place");
  table.number("loops.max_drift", max_drift, {0.0, 10.0}, "",
               "Largest correction by a loop, as a share of the distance travelled since (at least 10 cm)");
  table.boolean("loops.robust", robust, "Reject loops that do not fit the others");
  table.boolean("loops.bundle", bundle, "Adjust the whole map after a loop");
  vocabulary.declare(table);
  places.declare(table);
  verify.declare(table);
}

std::vector<Loop> LoopCloser::verify(const maps::Map& map, KeyframeId keyframe,
                                     const std::vector<places::Candidate>& candidates) {
  std::vector<Loop> verified;
  std::vector<Loop> far;
  for (const places::Candidate& candidate : candidates) {
    if (candidate.in_a_row < options_.places.consistent) continue;
    ++counts_.candidates;
    LoopTrial trial;
    trial.loop = {keyframe, candidate.keyframe, {}};
    trial.score = candidate.score;

    // A seed of its own for each keyframe makes the result independent of what was verified before.
    const std::uint64_t seed = options_.seed + static_cast<std::uint64_t>(keyframe.index);
    trial.loop.evidence =
        verify_place({&map, keyframe, camera_}, {&map, candidate.keyframe, camera_}, options_.verify, seed);
    trial.refused = judge(map, trial);
    trials_.push_back(trial);

    // Places that match, but farther off than drift explains, may be evidence against the path.
    if (!trial.refused.empty()) {
      if (trial.loop.evidence.accepted) far.push_back(std::move(trial.loop));
      continue;
    }

    ++counts_.verified;
    verified.push_back(std::move(trial.loop));
  }

  note_dispute(map, keyframe, far);
  return verified;
}

/// A single loop that drift does not explain is another place that looks the same. Many that agree with one
/// another, without an alternative, are evidence against the path.
void LoopCloser::note_dispute(const maps::Map& map, KeyframeId keyframe, const std::vector<Loop>& far) {
  LoopOptions options = options_;
  options.agreeing = kDisputing;
  LoopDispute dispute;
  dispute.loops = pending_disputes_.confirm(map, map, keyframe, far, options);
  if (dispute.loops.empty()) return;

  const auto landmarks = [](const Loop& l) { return l.evidence.points + 2 * l.evidence.lines; };
  dispute.strongest.loop =
      *std::max_element(dispute.loops.begin(), dispute.loops.end(),
                        [&](const Loop& x, const Loop& y) { return landmarks(x) < landmarks(y); });
  dispute.strongest.refused = judge(map, dispute.strongest);
  disputes_.push_back(std::move(dispute));
}

/// Measures how far closing the loop would move the query, and the length of the path on which that drift may
/// have grown.
void LoopCloser::measure_correction(const maps::Map& map, LoopTrial& trial) const {
  const Loop& loop = trial.loop;
  Eigen::Vector3d last = map.camera_from_world(loop.match).inverse().translation;
  for (std::int32_t i = loop.match.index + 1; i <= loop.query.index; ++i) {
    const KeyframeId id{loop.query.robot, i};
    if (!map.has_keyframe(id)) continue;
    const Eigen::Vector3d here = map.camera_from_world(id).inverse().translation;
    trial.path_m += (here - last).norm();
    last = here;
  }
  const Rigid3 correction = world_from_query(map, loop) * map.camera_from_world(loop.query);
  trial.correction_m = (correction * last - last).norm();
  trial.correction_rad = geometry::rotation_angle(correction.rotation);
}

/// Tests the correction against drift, which grows with the path: a much larger one means another place that
/// looks the same.
std::string LoopCloser::judge(const maps::Map& map, LoopTrial& trial) const {
  constexpr double kAlways_m = 0.1;
  constexpr double kAlways_rad = 0.05;
  constexpr double kRadiansPerMetre = 0.5;  // of drift
  const PlaceVerification& evidence = trial.loop.evidence;
  if (evidence.ransac_inliers == 0) return evidence.refused;
  const bool same_robot = trial.loop.match.robot == trial.loop.query.robot;
  if (same_robot) measure_correction(map, trial);  // otherwise their relative pose is not known
  if (!evidence.accepted) return evidence.refused;
  const double allowed_m = options_.max_drift * trial.path_m;
  if (trial.correction_m > kAlways_m + allowed_m ||
      trial.correction_rad > kAlways_rad + kRadiansPerMetre * allowed_m) {
    return fmt::format("{:.2f} m and {:.2f} rad exceed what drift explains on {:.1f} m", trial.correction_m,
                       trial.correction_rad, trial.path_m);
  }
  return {};
}

std::vector<Loop> PendingLoops::confirm(const maps::Map& matches, const maps::Map& queries,
                                        KeyframeId keyframe, const std::vector<Loop>& verified,
                                        const LoopOptions& options) {
  const auto gone = [&](const Loop& l) {
    return keyframe.index - l.query.index > patience_ || !queries.has_keyframe(l.query) ||
           !matches.has_keyframe(l.match);
  };
  waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(), gone), waiting_.end());
  if (verified.empty()) return {};

  waiting_.insert(waiting_.end(), verified.begin(), verified.end());
  std::vector<PlacePair> pairs;
  for (const Loop& loop : waiting_) pairs.push_back({loop.match, loop.query, loop.evidence.query_from_match});

  // A single match may be a place that looks alike: several keyframes must agree, and no
  // other set may have nearly as many.
  const std::vector<ConsistentSet> sets = consistent_sets(matches, queries, pairs, options.consistency);
  if (sets.empty() || static_cast<int>(sets[0].keyframes_b) < options.agreeing) return {};
  if (sets.size() > 1 && static_cast<double>(sets[1].keyframes_b) >
                             options.max_alternative * static_cast<double>(sets[0].keyframes_b)) {
    return {};
  }

  std::vector<Loop> result;
  for (const std::size_t i : sets[0].members) result.push_back(waiting_[i]);

  // Without a match of the newest keyframe the set contains nothing that was not considered before.
  const bool fresh =
      std::any_of(result.begin(), result.end(), [&](const Loop& l) { return l.query == keyframe; });
  if (!fresh) return {};
  waiting_.clear();
  return result;
}

std::vector<Loop> LoopCloser::detect(const maps::Map& map, KeyframeId keyframe) {
  const auto& features = map.keyframe(keyframe).features;
  if (features == nullptr) return {};

  // Keyframes close in time or in view always look alike and are no loops.
  const auto related = map.covisible(keyframe, kRelated);
  const double now = map.keyframe(keyframe).stamp;
  const KeyframeId root = maps::root_of(map, keyframe);
  const auto allowed = [&](KeyframeId id) {
    if (!map.has_keyframe(id) || std::abs(now - map.keyframe(id).stamp) < options_.min_gap_s) return false;
    if (maps::root_of(map, id) != root) return false;  // another component: not a loop
    return std::none_of(related.begin(), related.end(), [&](const auto& r) { return r.first == id; });
  };

  const auto neighbours = [&](KeyframeId id) { return map.neighbours(id, kAroundLoop); };
  const auto candidates =
      recogniser_.recognise(database_.query(*features), keyframe, last_, allowed, neighbours);
  const std::vector<Loop> verified = verify(map, keyframe, candidates);

  // The keyframe is added after its own query; otherwise it would find itself.
  database_.add(keyframe, features);
  last_ = keyframe;
  std::vector<Loop> sure = pending_.confirm(map, map, keyframe, verified, options_);
  if (others_ == nullptr) return sure;

  // Loops by way of other robots' maps must be explained by drift, too.
  for (const Loop& loop : others_->detect(database_, map, keyframe)) {
    LoopTrial trial;
    trial.loop = loop;
    trial.by_others = true;
    trial.refused = judge(map, trial);
    trials_.push_back(trial);
    if (trial.refused.empty()) sure.push_back(loop);
  }

  return sure;
}

void LoopCloser::use(std::shared_ptr<const OtherMapsInbox> others) {
  others_ = std::make_shared<InterRobotLoops>(options_, camera_, std::move(others));
}

std::optional<Rigid3> LoopCloser::locate(const sensor::RgbdFrame& frame,
                                         const std::shared_ptr<const features::FrameFeatures>& features,
                                         const tracking::SurfaceSamplerOptions& surface) {
  if (others_ == nullptr) return std::nullopt;
  std::optional<Rigid3> found = others_->locate(database_, image_map(frame, features, camera_, surface));
  if (found) ++counts_.located;
  return found;
}

void LoopCloser::restore(const maps::Map& map, KeyframeId newest) {
  for (const KeyframeId id : map.keyframe_ids()) {
    const auto& features = map.keyframe(id).features;
    if (features != nullptr && !database_.contains(id)) database_.add(id, features);
  }
  last_ = newest;
}

void LoopCloser::merge_duplicates(maps::Map& map, const PoseEdge& edge) const {
  std::vector<KeyframeId> old_side = map.neighbours(edge.a, kAroundLoop);
  old_side.insert(old_side.begin(), edge.a);
  std::vector<KeyframeId> new_side = map.neighbours(edge.b, kAroundLoop);
  new_side.insert(new_side.begin(), edge.b);
  for (const KeyframeId id : new_side) {
    std::vector<KeyframeId> others;
    for (const KeyframeId other : old_side) {
      if (other != id) others.push_back(other);
    }
    fuse_points(map, id, others, {{id.robot, camera_}}, options_.fusion);
    fuse_lines(map, id, others, {{id.robot, camera_}}, options_.fusion);
  }
}

/// `refused`: why it was not closed; empty: it was.
void LoopCloser::note_verdict(const PoseEdge& edge, const std::string& refused) {
  for (auto trial = trials_.rbegin(); trial != trials_.rend(); ++trial) {
    if (trial->loop.match != edge.a || trial->loop.query != edge.b) continue;
    trial->closed = refused.empty();
    trial->refused = refused;
    if (trial->closed && trial->by_others) ++counts_.by_others;
    return;
  }
}

bool LoopCloser::close(maps::Map& map, const std::vector<PoseEdge>& edges) {
  std::vector<PoseEdge> all = loop_edges(map);
  const std::size_t known = all.size();
  std::copy_if(edges.begin(), edges.end(), std::back_inserter(all),
               [&](const PoseEdge& e) { return map.has_keyframe(e.a) && map.has_keyframe(e.b); });
  if (all.size() == known) return false;

  // Nothing in the map changes before it is known that the solution does not tear the tracked path.
  const MapGraphResult solved = solve_map_graph(map, all, options_.robust);
  if (!solved.summary.usable) return false;
  if (const auto wrong = contradiction(map, solved.poses)) {
    ++counts_.refused;
    for (const PoseEdge& edge : edges) note_verdict(edge, wrong->text());
    return false;
  }

  std::vector<PoseEdge> believed;
  std::vector<PoseEdge> fresh;

  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool wrong = i < solved.summary.edges.size() && solved.summary.edges[i].rejected;
    if (i >= known) note_verdict(all[i], wrong ? "the pose graph rejected it" : "");
    if (wrong) {
      ++counts_.rejected;
      continue;
    }
    believed.push_back(all[i]);
    if (i >= known) fresh.push_back(all[i]);
  }

  // New loops may have shown that older ones were wrong, so the map's loops change even if none is new.
  set_loops(map, believed);
  if (fresh.empty()) return false;

  // Duplicates can be found only after the keyframes are moved, when landmarks of both visits coincide.
  move_keyframes(map, solved.poses);
  for (const PoseEdge& edge : fresh) merge_duplicates(map, edge);
  ++counts_.accepted;

  if (options_.bundle) {
    GlobalAdjustmentOptions adjustment;
    adjustment.pose_graph = false;               // it is solved
    adjustment.bundle_options.tolerance = 1e-4;  // the frame waits; later adjustments continue from here
    adjustment.noise.orb_scale_factor = options_.verify.orb_scale_factor;
    counts_.refused += adjust_map(map, {{edges.front().b.robot, camera_}}, believed, adjustment).refused;
  }

  return true;
}

std::vector<KeyframeId> LoopCloser::look_alikes(const maps::Map& map, const features::FrameFeatures& image,
                                                std::size_t count) const {
  std::vector<KeyframeId> result;
  for (const places::Hit& hit :
       database_.query(image).best(count, [&](KeyframeId id) { return map.has_keyframe(id); })) {
    result.push_back(hit.keyframe);
  }
  return result;
}

}  // namespace plumbline::mapping
