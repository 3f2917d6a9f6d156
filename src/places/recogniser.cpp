// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/places/recogniser.hpp"

#include <algorithm>

namespace plumbline::places {

using core::KeyframeId;

namespace {

bool meet(const std::vector<KeyframeId>& a, const std::vector<KeyframeId>& b) {
  auto i = a.begin();
  auto j = b.begin();
  while (i != a.end() && j != b.end()) {
    if (*i == *j) return true;
    if (*i < *j) {
      ++i;
    } else {
      ++j;
    }
  }
  return false;
}

}  // namespace

void RecogniserOptions::declare(core::OptionTable& table) {
  table.number("places.min_score", min_score, {0.0, 1.0}, "",
               "Score of a candidate over that of the keyframe before, at least");
  table.number("places.min_absolute", min_absolute, {0.0, 1.0}, "", "Score of a candidate, at least");
  table.integer("places.consistent", consistent, {1, 100}, "",
                "Keyframes in a row that must see the same surroundings");
  table.integer("places.candidates", hits, {1, 1000}, "", "Most similar keyframes that are grouped");
  table.integer("places.islands", groups, {1, 100}, "", "Places that are verified per keyframe, at most");
}

std::vector<Candidate> Recogniser::recognise(const Database& database, KeyframeId query,
                                             const features::FrameFeatures& picture, KeyframeId neighbour,
                                             const std::function<bool(KeyframeId)>& allowed,
                                             const Neighbours& neighbours) {
  return recognise(database.query(picture), query, neighbour, allowed, neighbours);
}

std::vector<Candidate> Recogniser::recognise(const Database::Scores& scores, KeyframeId query,
                                             KeyframeId neighbour,
                                             const std::function<bool(KeyframeId)>& allowed,
                                             const Neighbours& neighbours) {
  const double usual = neighbour.valid() ? scores.of(neighbour) : 0.0;
  const double threshold = std::max(options_.min_absolute, options_.min_score * usual);
  std::vector<Hit> hits = scores.best(static_cast<std::size_t>(options_.hits), allowed);
  while (!hits.empty() && hits.back().score < threshold) hits.pop_back();

  struct Found {
    Candidate candidate;
    Group group;
  };
  std::vector<Found> found;
  for (const Hit& hit : hits) {
    // Hits come best first: what lies in the surroundings of a better one belongs to that.
    const auto known = std::find_if(found.begin(), found.end(), [&](const Found& f) {
      return std::binary_search(f.group.members.begin(), f.group.members.end(), hit.keyframe);
    });
    if (known != found.end()) {
      known->candidate.group_score += hit.score;
      continue;
    }
    Found f;
    f.candidate.keyframe = hit.keyframe;
    f.candidate.score = f.candidate.group_score = hit.score;
    f.candidate.relative = usual > 0.0 ? hit.score / usual : 1.0;
    f.group.members = neighbours(hit.keyframe);
    f.group.members.push_back(hit.keyframe);
    std::sort(f.group.members.begin(), f.group.members.end());
    found.push_back(std::move(f));
  }
  std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    return a.candidate.group_score > b.candidate.group_score;
  });
  if (found.size() > static_cast<std::size_t>(options_.groups)) {
    found.resize(static_cast<std::size_t>(options_.groups));
  }
  std::vector<Group>& last = last_[query.robot];
  std::vector<Group> now;
  std::vector<Candidate> candidates;
  for (Found& f : found) {
    for (const Group& before : last) {
      if (meet(before.members, f.group.members)) {
        f.group.in_a_row = std::max(f.group.in_a_row, before.in_a_row + 1);
      }
    }
    f.candidate.in_a_row = f.group.in_a_row;
    candidates.push_back(f.candidate);
    now.push_back(std::move(f.group));
  }
  last = std::move(now);
  return candidates;
}

}  // namespace plumbline::places
