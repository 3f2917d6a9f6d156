// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/merging/component_joiner.hpp"

#include <algorithm>

#include "plumbline/maps/components.hpp"

namespace plumbline::mapping {

using core::KeyframeId;

namespace {

constexpr std::size_t kLookAlikesTried = 3;  // of other components, that are verified for each keyframe

}  // namespace

void ComponentJoiner::verify(const maps::Map& map, KeyframeId keyframe, KeyframeId root,
                             const places::Database& places) {
  const auto& features = map.keyframe(keyframe).features;
  if (features == nullptr) return;
  const auto elsewhere = [&](KeyframeId id) {
    return map.has_keyframe(id) && maps::root_of(map, id) != root;
  };
  for (const places::Hit& hit : places.query(*features).best(kLookAlikesTried, elsewhere)) {
    if (hit.score < options_.places.min_absolute) return;
    const std::uint64_t seed = options_.seed + 7919U * static_cast<std::uint64_t>(keyframe.index) +
                               static_cast<std::uint64_t>(hit.keyframe.index);
    VerifiedPair pair{
        keyframe, hit.keyframe,
        verify_place({&map, keyframe, camera_}, {&map, hit.keyframe, camera_}, options_.verify, seed)};
    if (!pair.evidence.accepted) continue;
    const KeyframeId other = maps::root_of(map, hit.keyframe);
    pairs_[std::minmax(root, other)].verified.push_back(std::move(pair));
  }
}

std::optional<ComponentOverlap> ComponentJoiner::look_up(const maps::Map& map, KeyframeId keyframe,
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

void ComponentJoiner::add(const maps::Map& map, const std::vector<Loop>& verified) {
  for (const Loop& loop : verified) {
    const KeyframeId one = maps::root_of(map, loop.query);
    const KeyframeId other = maps::root_of(map, loop.match);
    if (one != other)
      pairs_[std::minmax(one, other)].verified.push_back({loop.query, loop.match, loop.evidence});
  }
}

void ComponentJoiner::joined(KeyframeId a, KeyframeId b) {
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

}  // namespace plumbline::mapping
