// SPDX-License-Identifier: BSD-3-Clause
// Verifies other keyframes that should see the same place if the relative pose of two maps is right.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "merging/map_fusion_sets.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

/// Distances within which two keyframes should see the same.
struct Reach {
  double near_m;
  double turned_rad;
};
constexpr Reach kMust{0.7, 0.45};  // they do
constexpr Reach kMay{1.5, 0.7};    // most do, unless something stands between them

constexpr double kConfirmed = 0.75;        // of the keyframes that see one place
constexpr double kConfirmedByLike = 0.45;  // of those that see one that looks alike in part

/// The keyframe of a whose view should be most like that of a camera of b; invalid: none is.
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

std::vector<VerifiedPair> verify_all(const PartPair& maps,
                                     const std::vector<OverlapFinder::Candidate>& candidates) {
  std::vector<VerifiedPair> verified(candidates.size());
  maps.executor.parallel_for(candidates.size(), [&](std::size_t i) {
    verified[i] = verify_candidate(maps.parts, candidates[i], maps.options);
  });
  return verified;
}

}  // namespace

std::vector<VerifiedPair> verify_neighbours(const PartPair& maps, const PairSets& sets,
                                            const std::vector<VerifiedPair>& known) {
  constexpr std::size_t kSets = 3;
  constexpr std::size_t kMost = 24;  // of each set
  const maps::Map& a = maps.map_a();
  const maps::Map& b = maps.map_b();
  std::set<std::pair<KeyframeId, KeyframeId>> seen;
  for (const VerifiedPair& pair : known)
    seen.emplace(std::min(pair.query, pair.match), std::max(pair.query, pair.match));

  std::vector<OverlapFinder::Candidate> candidates;

  // Rival alignments are tested like the leading one, so that the additional views decide between them.
  for (std::size_t i = 0; i < std::min(kSets, sets.sets.size()); ++i) {
    const Rigid3 a_from_b = mean_alignment(maps, sets.places_of(i)).a_from_b;
    std::size_t added = 0;
    const auto add = [&](std::size_t query_part, KeyframeId query, std::size_t match_part, KeyframeId match) {
      if (!match.valid() || added >= kMost) return;
      if (!seen.emplace(std::min(query, match), std::max(query, match)).second) return;
      candidates.push_back({query, match, query_part, match_part, 0.0});
      ++added;
    };

    // Keyframes of either map are paired with the most similar view of the other one under this alignment.
    for (const KeyframeId id : b.keyframe_ids()) {
      add(maps.b, id, maps.a, nearest_view(a, a_from_b, b.camera_from_world(id).inverse(), kMay));
    }

    for (const KeyframeId id : a.keyframe_ids()) {
      add(maps.a, id, maps.b, nearest_view(b, a_from_b.inverse(), a.camera_from_world(id).inverse(), kMay));
    }
  }

  return verify_all(maps, candidates);
}

CrossValidation cross_validate(const PartPair& maps, const std::vector<VerifiedPair>& agreeing,
                               const Rigid3& a_from_b) {
  constexpr std::size_t kMost = 60;
  const maps::Map& a = maps.map_a();
  const maps::Map& b = maps.map_b();
  CrossValidation result;
  std::set<KeyframeId> agreed;
  for (const VerifiedPair& pair : agreeing)
    agreed.insert(b.has_keyframe(pair.query) ? pair.query : pair.match);

  // If the alignment is right, keyframes that lie close together in it see the same. The agreeing ones do.
  std::vector<OverlapFinder::Candidate> open;
  for (const KeyframeId id : b.keyframe_ids()) {
    const KeyframeId near = nearest_view(a, a_from_b, b.camera_from_world(id).inverse(), kMust);
    if (!near.valid()) continue;

    if (agreed.count(id) != 0) {
      ++result.confirmed;
    } else {
      open.push_back({id, near, maps.b, maps.a, 0.0});
    }
  }

  // A sample that is spread evenly over the map is representative and bounds the time.
  std::vector<OverlapFinder::Candidate> tried;
  const std::size_t step = std::max<std::size_t>((open.size() + kMost - 1) / kMost, 1);
  for (std::size_t i = 0; i < open.size(); i += step) tried.push_back(open[i]);
  result.expected = result.confirmed + static_cast<int>(tried.size());

  const PairSets known = accepted_pairs(maps, agreeing);
  const PairSets fresh = accepted_pairs(maps, verify_all(maps, tried));
  for (std::size_t i = 0; i < fresh.places.size(); ++i) {
    const auto agrees = [&](const PlacePair& other) {
      return agree(a, b, fresh.places[i], other, maps.options.consistency);
    };
    if (!std::all_of(known.places.begin(), known.places.end(), agrees)) continue;
    ++result.confirmed;
    result.pairs.push_back(fresh.pairs[i]);
  }

  // Log odds of one place against one that looks alike in part, where fewer keyframes would be confirmed.
  const double missed = result.expected - result.confirmed;
  result.against_like = result.confirmed * std::log(kConfirmed / kConfirmedByLike) +
                        missed * std::log((1.0 - kConfirmed) / (1.0 - kConfirmedByLike));
  return result;
}

}  // namespace plumbline::mapping
