// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/places/recogniser.hpp"

#include <algorithm>

namespace plumbline::places {

using core::KeyframeId;

namespace {

/// True if two sorted lists have an element in common.
bool meet(const std::vector<KeyframeId>& a, const std::vector<KeyframeId>& b) {
  return std::any_of(a.begin(), a.end(),
                     [&](KeyframeId id) { return std::binary_search(b.begin(), b.end(), id); });
}

}  // namespace

void RecogniserOptions::declare(core::OptionTable& table) {
  table.number("places.min_score", min_score, {0.0, 1.0}, "",
               "Smallest score of a candidate relative to that of the previous keyframe");
  table.number("places.min_absolute", min_absolute, {0.0, 1.0}, "", "Score of a candidate, at least");
  table.integer("places.consistent", consistent, {1, 100}, "",
                "Keyframes in a row that must see the same surroundings");
  table.boolean("places.votes", votes, "The most similar are those that share most words");
}

std::vector<Candidate> Recogniser::recognise(const Database::Scores& scores, KeyframeId query,
                                             KeyframeId neighbour,
                                             const std::function<bool(KeyframeId)>& allowed,
                                             const Neighbours& neighbours) {
  // Scores relative to that of a known neighbour
  const double usual = neighbour.valid() ? scores.of(neighbour) : 0.0;
  const double threshold = std::max(options_.min_absolute, options_.min_score * usual);
  std::vector<Hit> hits = scores.best(static_cast<std::size_t>(options_.hits), allowed, options_.votes);
  while (!hits.empty() && hits.back().score < threshold) hits.pop_back();
  return seen_in_a_row(query.robot, islands(hits, neighbours));
}

/// Hits are sorted, best first: a hit in the surroundings of a better one belongs to that one.
std::vector<Recogniser::Island> Recogniser::islands(const std::vector<Hit>& hits,
                                                    const Neighbours& neighbours) const {
  std::vector<Island> result;
  for (const Hit& hit : hits) {
    const auto known = std::find_if(result.begin(), result.end(), [&](const Island& island) {
      return std::binary_search(island.members.begin(), island.members.end(), hit.keyframe);
    });
    if (known != result.end()) {
      known->candidate.group_score += hit.score;
      continue;
    }

    // A hit elsewhere begins another group
    Island& island = result.emplace_back();
    island.candidate.keyframe = hit.keyframe;
    island.candidate.score = island.candidate.group_score = hit.score;
    island.members = neighbours(hit.keyframe);
    island.members.push_back(hit.keyframe);
    std::sort(island.members.begin(), island.members.end());
  }

  // The best group first
  std::stable_sort(result.begin(), result.end(), [](const Island& a, const Island& b) {
    return a.candidate.group_score > b.candidate.group_score;
  });

  if (result.size() > static_cast<std::size_t>(options_.groups))
    result.resize(static_cast<std::size_t>(options_.groups));
  return result;
}

/// Counts for how many queries of the robot these surroundings have been found.
std::vector<Candidate> Recogniser::seen_in_a_row(std::int32_t robot, std::vector<Island> islands) {
  std::vector<Island>& last = last_[robot];
  std::vector<Candidate> candidates;
  for (Island& island : islands) {
    int& in_a_row = island.candidate.in_a_row;
    for (const Island& before : last) {
      if (meet(before.members, island.members)) in_a_row = std::max(in_a_row, before.candidate.in_a_row + 1);
    }
    candidates.push_back(island.candidate);
  }
  last = std::move(islands);
  return candidates;
}

}  // namespace plumbline::places
