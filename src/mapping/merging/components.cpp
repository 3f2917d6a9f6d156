// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/merging/components.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <utility>

#include "plumbline/maps/components.hpp"

namespace plumbline::mapping {

using core::KeyframeId;

bool can_begin_map(const sensor::RgbdFrame& frame) {
  constexpr double kMinMeasured = 0.05;  // share of the pixels
  return !frame.depth.empty() &&
         cv::countNonZero(frame.depth > 0) > kMinMeasured * static_cast<double>(frame.depth.total());
}

bool can_begin_component(const sensor::RgbdFrame& frame, const features::FrameFeatures& features) {
  constexpr std::ptrdiff_t kLeastLandmarks = 60;  // points and lines (twice) with depth
  const auto points = std::count_if(features.points.begin(), features.points.end(),
                                    [](const features::PointFeature& f) { return f.depth > 0.0F; });
  const auto lines = std::count_if(features.lines.begin(), features.lines.end(),
                                   [](const features::LineFeature& f) { return f.line3.has_value(); });
  return can_begin_map(frame) && points + 2 * lines >= kLeastLandmarks;
}

void Components::verify(const maps::Map& map, KeyframeId keyframe, KeyframeId root,
                        const places::Database& places) {
  constexpr std::size_t kLookAlikesTried = 3;  // of other components, that are verified for each keyframe
  const auto& features = map.keyframe(keyframe).features;
  if (features == nullptr) return;
  const auto elsewhere = [&](KeyframeId id) {
    return map.has_keyframe(id) && maps::root_of(map, id) != root;
  };

  // Hits come best first, so the first one below the threshold ends the search.
  for (const places::Hit& hit : places.query(*features).best(kLookAlikesTried, elsewhere)) {
    if (hit.score < options_.places.min_absolute) return;
    const std::uint64_t seed = options_.seed + 7919U * static_cast<std::uint64_t>(keyframe.index) +
                               static_cast<std::uint64_t>(hit.keyframe.index);
    VerifiedPair pair{
        keyframe, hit.keyframe,
        verify_place({&map, keyframe, camera_}, {&map, hit.keyframe, camera_}, options_.verify, seed)};
    if (!pair.evidence.accepted) continue;

    // Evidence is collected for each pair of components, because one match alone does not decide.
    const KeyframeId other = maps::root_of(map, hit.keyframe);
    pairs_[std::minmax(root, other)].verified.push_back(std::move(pair));
  }
}

std::optional<ComponentOverlap> Components::look_up(const maps::Map& map, KeyframeId keyframe,
                                                    const places::Database& places) {
  const KeyframeId root = maps::root_of(map, keyframe);
  verify(map, keyframe, root, places);

  for (auto& [roots, pairs] : pairs_) {
    if ((roots.first != root && roots.second != root) || pairs.verified.size() == pairs.decided) continue;
    pairs.decided = pairs.verified.size();
    const maps::Map a = maps::component(map, roots.first);
    const maps::Map b = maps::component(map, roots.second);
    const Cameras cameras{{keyframe.robot, camera_}};
    MergeEvidence evidence =
        decide_overlap({{&a, cameras}, {&b, cameras}}, 0, 1, pairs.verified, options_, *executor_);
    if (evidence.accepted) return ComponentOverlap{roots.first, roots.second, std::move(evidence)};
  }
  return std::nullopt;
}

/// The component of root `b` became part of that of root `a`.
void Components::rename(KeyframeId a, KeyframeId b) {
  std::map<Roots, Pairs> renamed;
  for (auto& [roots, pairs] : pairs_) {
    const KeyframeId first = roots.first == b ? a : roots.first;
    const KeyframeId second = roots.second == b ? a : roots.second;
    if (first == second) continue;
    std::vector<VerifiedPair>& all = renamed[std::minmax(first, second)].verified;
    all.insert(all.end(), pairs.verified.begin(), pairs.verified.end());
  }
  pairs_ = std::move(renamed);
}

bool Components::join(maps::Map& map, ComponentOverlap overlap, KeyframeId keyframe, LoopCloser& loops) {
  // The components are aligned, connected by the pair of keyframes that share most, and adjusted together.
  maps::Map joined = map;
  const std::size_t joining = maps::component(joined, overlap.b).keyframe_count();
  maps::move_component(joined, overlap.b, overlap.evidence.alignment.a_from_b);

  std::vector<PoseEdge> edges;
  const VerifiedPair* best = nullptr;
  const auto share = [](const VerifiedPair& pair) { return pair.evidence.points + 2 * pair.evidence.lines; };
  for (const VerifiedPair& pair : overlap.evidence.pairs) {
    edges.push_back(LoopCloser::to_edge({pair.query, pair.match, pair.evidence}));
    if (best == nullptr || share(pair) > share(*best)) best = &pair;
  }

  const bool query_in_a = maps::root_of(joined, best->query) == overlap.a;
  joined.set_parent(overlap.b, query_in_a ? best->query : best->match);
  if (!loops.close(joined, edges)) return false;

  map = std::move(joined);
  rename(overlap.a, overlap.b);
  joins_.push_back({std::move(overlap), map.keyframe(keyframe).stamp, joining});
  return true;
}

std::optional<KeyframeId> Components::wrong_turn(const maps::Map& map, const LoopDispute& dispute) const {
  const auto is_between = [&](KeyframeId first) {
    return map.has_keyframe(first) &&
           std::all_of(dispute.loops.begin(), dispute.loops.end(), [&](const Loop& loop) {
             return loop.match < first && !(loop.query < first) &&
                    maps::root_of(map, loop.match) == maps::root_of(map, first) &&
                    maps::root_of(map, loop.query) == maps::root_of(map, first);
           });
  };
  const auto found = std::find_if(relocalised_.rbegin(), relocalised_.rend(), is_between);
  return found == relocalised_.rend() ? std::nullopt : std::optional(*found);
}

void Components::divide(maps::Map& map, KeyframeId first, const LoopDispute& dispute) {
  maps::split_component(map, first);
  relocalised_.erase(std::find(relocalised_.begin(), relocalised_.end(), first));
  ++taken_back_;

  // The loops join the two parts again.
  for (const Loop& loop : dispute.loops) {
    const KeyframeId one = maps::root_of(map, loop.query);
    const KeyframeId other = maps::root_of(map, loop.match);
    if (one != other)
      pairs_[std::minmax(one, other)].verified.push_back({loop.query, loop.match, loop.evidence});
  }
}

}  // namespace plumbline::mapping
