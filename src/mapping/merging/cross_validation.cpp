// SPDX-License-Identifier: BSD-3-Clause
// Once there is an answer to how two maps lie, it says which other keyframes should see the same: those are
// tried, too.
#include <algorithm>
#include <set>
#include <utility>

#include "merging/map_fusion_sets.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

/// How far apart keyframes lie that should see the same.
struct Reach {
  double near_m;
  double turned_rad;
};
constexpr Reach kMust{0.7, 0.45};  // they do
constexpr Reach kMay{1.5, 0.7};    // most do, unless something stands between them

/// The keyframe of a that should see most nearly what a camera of b sees; invalid: none does.
KeyframeId nearest_view(const maps::Map& a, const Rigid3& a_from_b, const Rigid3& b_from_camera,
                        const Reach& reach) {
  constexpr double kMetresPerRadian = 1.0;
  KeyframeId best;
  double least = reach.near_m + kMetresPerRadian * reach.turned_rad;
  const Rigid3 here = a_from_b * b_from_camera;
  for (const KeyframeId id : a.keyframe_ids()) {
    const Rigid3 camera_from_here = a.camera_from_world(id) * here;
    const double turned = geometry::rotation_angle(camera_from_here.rotation);
    const double apart = camera_from_here.translation.norm();
    if (apart > reach.near_m || turned > reach.turned_rad) continue;
    if (const double cost = apart + kMetresPerRadian * turned; cost < least) {
      least = cost;
      best = id;
    }
  }
  return best;
}

std::vector<VerifiedPair> verify_all(const std::vector<MapPart>& parts,
                                     const std::vector<OverlapFinder::Candidate>& candidates,
                                     const MapFusionOptions& options, const core::Executor& executor) {
  std::vector<VerifiedPair> verified(candidates.size());
  executor.parallel_for(candidates.size(), [&](std::size_t i) {
    verified[i] = verify_candidate(parts, candidates[i], options);
  });
  return verified;
}

}  // namespace

void expand_candidates(const std::vector<MapPart>& parts, const SortedPairs& all,
                       const std::vector<ConsistentSet>& sets, const MapFusionOptions& options,
                       const core::Executor& executor, const MergeEvidence& merge,
                       std::vector<VerifiedPair>& pairs) {
  constexpr std::size_t kSets = 3;
  constexpr std::size_t kMost = 24;  // of each set
  const maps::Map& a = *parts[merge.a].map;
  const maps::Map& b = *parts[merge.b].map;
  std::set<std::pair<KeyframeId, KeyframeId>> known;
  for (const VerifiedPair& pair : pairs) {
    known.emplace(std::min(pair.query, pair.match), std::max(pair.query, pair.match));
  }
  std::vector<OverlapFinder::Candidate> open;
  for (std::size_t i = 0; i < std::min(kSets, sets.size()); ++i) {
    std::vector<PlacePair> places;
    for (const std::size_t k : sets[i].members) places.push_back(all.places[k]);
    const Rigid3 a_from_b = mean_transform(a, b, places).a_from_b;
    std::size_t tried = 0;
    const auto attempt = [&](std::size_t query_part, KeyframeId query, std::size_t match_part,
                             KeyframeId match) {
      if (!match.valid() || tried >= kMost) return;
      if (!known.emplace(std::min(query, match), std::max(query, match)).second) return;
      open.push_back({query, match, query_part, match_part, 0.0});
      ++tried;
    };
    for (const KeyframeId id : b.keyframe_ids()) {
      attempt(merge.b, id, merge.a, nearest_view(a, a_from_b, b.camera_from_world(id).inverse(), kMay));
    }
    for (const KeyframeId id : a.keyframe_ids()) {
      attempt(merge.a, id, merge.b,
              nearest_view(b, a_from_b.inverse(), a.camera_from_world(id).inverse(), kMay));
    }
  }
  const std::vector<VerifiedPair> verified = verify_all(parts, open, options, executor);
  pairs.insert(pairs.end(), verified.begin(), verified.end());
}

void cross_validate(const std::vector<MapPart>& parts, const MapFusionOptions& options,
                    const core::Executor& executor, MergeEvidence& merge) {
  constexpr std::size_t kMost = 60;
  const maps::Map& a = *parts[merge.a].map;
  const maps::Map& b = *parts[merge.b].map;
  std::set<KeyframeId> agreed;
  for (const VerifiedPair& pair : merge.pairs)
    agreed.insert(b.has_keyframe(pair.query) ? pair.query : pair.match);
  std::vector<OverlapFinder::Candidate> open;
  for (const KeyframeId id : b.keyframe_ids()) {
    const KeyframeId near = nearest_view(a, merge.a_from_b, b.camera_from_world(id).inverse(), kMust);
    if (!near.valid()) continue;
    ++merge.expected;
    if (agreed.count(id) != 0) {
      ++merge.confirmed;
    } else {
      open.push_back({id, near, merge.b, merge.a, 0.0});
    }
  }
  std::vector<OverlapFinder::Candidate> tried;
  const std::size_t step = (open.size() + kMost - 1) / std::max<std::size_t>(kMost, 1);
  for (std::size_t i = 0; i < open.size(); i += std::max<std::size_t>(step, 1)) tried.push_back(open[i]);
  merge.expected -= static_cast<int>(open.size() - tried.size());
  const std::vector<VerifiedPair> verified = verify_all(parts, tried, options, executor);
  const SortedPairs known = sort_pairs(a, b, merge.pairs);
  const SortedPairs fresh = sort_pairs(a, b, verified);
  for (std::size_t i = 0; i < fresh.places.size(); ++i) {
    const auto agrees = [&](const PlacePair& other) {
      return agree(a, b, fresh.places[i], other, options.consistency);
    };
    if (!std::all_of(known.places.begin(), known.places.end(), agrees)) continue;
    ++merge.confirmed;
    merge.pairs.push_back(verified[fresh.indices[i]]);
  }
}

}  // namespace plumbline::mapping
