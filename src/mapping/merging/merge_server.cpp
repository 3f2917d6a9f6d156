// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/merge_server.hpp"

#include <algorithm>
#include <stdexcept>

namespace plumbline::mapping {

using core::KeyframeId;

MergeServer::MergeServer(const MapFusionOptions& options, const std::vector<Cameras>& cameras,
                         const core::Executor& executor)
    : options_(options), executor_(&executor), last_(cameras.size()), finder_(options) {
  for (const Cameras& own : cameras) {
    maps_.push_back(std::make_shared<maps::Map>());
    parts_.push_back({maps_.back().get(), own});
  }
}

std::vector<MergeEvidence> MergeServer::add(std::shared_ptr<const maps::Map> map, KeyframeId id) {
  const auto robot = static_cast<std::size_t>(id.robot);
  if (!id.valid() || robot >= parts_.size() || !map->has_keyframe(id)) {
    throw std::invalid_argument("a keyframe that no robot has");
  }
  maps_[robot] = std::move(map);
  parts_[robot].map = maps_[robot].get();
  const auto candidates = finder_.recognise(parts_, robot, id, last_[robot]);
  finder_.add(*parts_[robot].map, id);
  last_[robot] = id;

  std::vector<VerifiedPair> tried(candidates.size());
  executor_->parallel_for(candidates.size(), [&](std::size_t i) {
    tried[i] = verify_candidate(parts_, candidates[i], options_);
  });
  std::vector<MergeEvidence> certain;
  for (std::size_t i = 0; i < tried.size(); ++i) {
    if (!tried[i].evidence.accepted) continue;
    const std::pair<std::size_t, std::size_t> both{std::min(robot, candidates[i].match_part),
                                                   std::max(robot, candidates[i].match_part)};
    std::vector<VerifiedPair>& pairs = verified_[both];
    pairs.push_back(tried[i]);
    if (merged_[both] || static_cast<int>(pairs.size()) < options_.few_pairs) continue;
    MergeEvidence merge = decide_overlap(parts_, both.first, both.second, pairs, options_, *executor_);
    if (!merge.accepted) continue;
    merged_[both] = true;
    certain.push_back(std::move(merge));
  }
  return certain;
}

}  // namespace plumbline::mapping
