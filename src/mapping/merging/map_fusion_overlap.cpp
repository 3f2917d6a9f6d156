// SPDX-License-Identifier: BSD-3-Clause
// Do two maps show the same place, and how do they lie to each other?
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

#include "merging/map_fusion_sets.hpp"
#include "plumbline/maps/covisibility.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

constexpr std::size_t kSurroundings = 8;  // keyframes that belong to the surroundings of one

std::size_t part_of(const std::vector<MapPart>& parts, KeyframeId id) {
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (parts[p].map->has_keyframe(id)) return p;
  }
  return parts.size();
}

double turn_between(const maps::Map& map, const std::vector<PlacePair>& pairs) {
  double most = 0.0;
  for (const PlacePair& x : pairs) {
    for (const PlacePair& y : pairs) {
      most = std::max(most, geometry::rotation_angle(map.camera_from_world(x.b).rotation *
                                                     map.camera_from_world(y.b).rotation.transpose()));
    }
  }
  return most;
}

void sum_up(MergeEvidence& merge) {
  const auto n = static_cast<double>(merge.pairs.size());
  for (const VerifiedPair& pair : merge.pairs) {
    const PlaceVerification& e = pair.evidence;
    merge.matches += e.matched_points + e.matched_lines;
    merge.inliers += e.points + e.lines;
    merge.rms_px += e.rms_px / n;
    merge.overlap += e.overlap / n;
  }
}

/// How far apart the cameras of a map lie: the diagonal of the box around them, metres.
double extent(const maps::Map& map) {
  Eigen::AlignedBox3d box;
  for (const KeyframeId id : map.keyframe_ids()) box.extend(map.camera_from_world(id).inverse().translation);
  return box.isEmpty() ? 0.0 : box.diagonal().norm();
}

/// Few keyframes will do where each shows a whole picture of the same: not by chance, and what merely looks
/// alike has less in common. That things repeat is seen by maps that reach farther than the place itself.
bool few_suffice(const maps::Map& a, const maps::Map& b, const MergeEvidence& merge,
                 const MapFusionOptions& options) {
  if (extent(a) < options.few_extent_m || extent(b) < options.few_extent_m) return false;
  std::set<KeyframeId> of_a;
  std::set<KeyframeId> of_b;
  for (const VerifiedPair& pair : merge.pairs) {
    if (pair.evidence.points + 2 * pair.evidence.lines < options.few_inliers) continue;
    const bool query_of_a = a.has_keyframe(pair.query);
    of_a.insert(query_of_a ? pair.query : pair.match);
    of_b.insert(query_of_a ? pair.match : pair.query);
  }
  return static_cast<int>(std::min(of_a.size(), of_b.size())) >= options.few_pairs;
}

std::string judge(const maps::Map& a, const maps::Map& b, const MergeEvidence& merge,
                  const MapFusionOptions& options) {
  if (merge.verified == 0) return "no two keyframes were verified to show the same place";
  if (merge.agreeing < options.min_pairs) {
    if (few_suffice(a, b, merge, options)) return {};
    return fmt::format(
        "only {} keyframes agree on how the maps lie ({} are needed, or {} with {} points and lines in "
        "common "
        "in maps of {} m and more)",
        merge.agreeing, options.min_pairs, options.few_pairs, options.few_inliers, options.few_extent_m);
  }
  if (merge.span_m < options.min_span_m && merge.span_rad < options.min_span_rad) {
    return fmt::format(
        "the keyframes that agree lie within {:.2f} m and {:.2f} rad: one place that looks alike "
        "is not enough",
        merge.span_m, merge.span_rad);
  }
  return {};
}

}  // namespace

void OverlapFinder::add(const maps::Map& map, KeyframeId keyframe) {
  const auto& features = map.keyframe(keyframe).features;
  if (features != nullptr) database_.add(keyframe, features);
}

std::vector<OverlapFinder::Candidate> OverlapFinder::look(const std::vector<MapPart>& parts, std::size_t part,
                                                          KeyframeId keyframe, KeyframeId before) {
  const auto& features = parts[part].map->keyframe(keyframe).features;
  if (features == nullptr) return {};
  return look(database_.query(*features), parts, part, keyframe, before);
}

std::vector<OverlapFinder::Candidate> OverlapFinder::look(const places::Database::Scores& scores,
                                                          const std::vector<MapPart>& parts, std::size_t part,
                                                          KeyframeId keyframe, KeyframeId before) {
  std::vector<Candidate> result;
  const auto neighbours = [&](KeyframeId id) {
    std::vector<KeyframeId> around;
    const std::size_t where = part_of(parts, id);
    if (where == parts.size()) return around;
    for (const auto& [other, shared] : parts[where].map->covisible(id, maps::kCovisible)) {
      if (around.size() >= kSurroundings) break;
      around.push_back(other);
    }
    return around;
  };
  const auto allowed = [&](KeyframeId id) {
    const std::size_t where = part_of(parts, id);
    return where != part && where != parts.size();
  };
  const KeyframeId usual = before.valid() && database_.contains(before) ? before : KeyframeId{};
  for (const places::Candidate& c : recogniser_.look(scores, keyframe, usual, allowed, neighbours)) {
    result.push_back({keyframe, c.keyframe, part, part_of(parts, c.keyframe), c.score});
  }
  return result;
}

std::vector<OverlapFinder::Candidate> OverlapFinder::look_at_all(const std::vector<MapPart>& parts,
                                                                 const core::Executor& executor) {
  struct Query {
    std::size_t part;
    KeyframeId keyframe;
    KeyframeId before;
  };
  std::vector<Query> queries;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    KeyframeId before;
    for (const KeyframeId id : parts[p].map->keyframe_ids()) {
      if (parts[p].map->keyframe(id).features != nullptr) {
        queries.push_back({p, id, before.robot == id.robot ? before : KeyframeId{}});
      }
      before = id;
    }
  }
  constexpr std::size_t kAtATime = 256;  // scores of so many take memory at a time
  std::vector<Candidate> candidates;
  for (std::size_t first = 0; first < queries.size(); first += kAtATime) {
    std::vector<places::Database::Scores> scores(std::min(kAtATime, queries.size() - first));
    executor.parallel_for(scores.size(), [&](std::size_t i) {
      const Query& q = queries[first + i];
      scores[i] = database_.query(*parts[q.part].map->keyframe(q.keyframe).features);
    });
    for (std::size_t i = 0; i < scores.size(); ++i) {  // in order: who looks remembers what it saw
      const Query& q = queries[first + i];
      const std::vector<Candidate> found = look(scores[i], parts, q.part, q.keyframe, q.before);
      candidates.insert(candidates.end(), found.begin(), found.end());
    }
  }
  return candidates;
}

VerifiedPair verify_candidate(const std::vector<MapPart>& parts, const OverlapFinder::Candidate& candidate,
                              const MapFusionOptions& options) {
  const MapPart& query = parts[candidate.query_part];
  const MapPart& match = parts[candidate.match_part];
  const std::uint64_t seed = options.seed + 7919U * static_cast<std::uint64_t>(candidate.query.index) +
                             static_cast<std::uint64_t>(candidate.match.index);
  return {candidate.query, candidate.match,
          verify_place({query.map, candidate.query, query.cameras.at(candidate.query.robot)},
                       {match.map, candidate.match, match.cameras.at(candidate.match.robot)}, options.verify,
                       seed)};
}

MergeEvidence decide_overlap(const std::vector<MapPart>& parts, std::size_t a, std::size_t b,
                             const std::vector<VerifiedPair>& found, const MapFusionOptions& options,
                             const core::Executor& executor) {
  MergeEvidence merge;
  merge.a = a;
  merge.b = b;
  const maps::Map& map_a = *parts[a].map;
  const maps::Map& map_b = *parts[b].map;
  std::vector<VerifiedPair> pairs = found;
  SortedPairs all = sort_pairs(map_a, map_b, pairs);
  std::vector<ConsistentSet> sets = consistent_sets(map_a, map_b, all.places, options.consistency);
  if (!sets.empty() && witnesses(sets.front()) < options.min_pairs) {
    ask_neighbours(parts, all, sets, options, executor, merge, pairs);
    all = sort_pairs(map_a, map_b, pairs);
    sets = consistent_sets(map_a, map_b, all.places, options.consistency);
  }
  merge.verified = static_cast<int>(all.places.size());
  if (!sets.empty()) {
    merge.agreeing = witnesses(sets.front());
    merge.span_m = sets.front().span_m;
    std::vector<PlacePair> best;
    for (const std::size_t i : sets.front().members) {
      best.push_back(all.places[i]);
      merge.pairs.push_back(pairs[all.indices[i]]);
    }
    merge.span_rad = turn_between(map_b, best);
    const MeanTransform mean = mean_transform(map_a, map_b, best);
    merge.a_from_b = mean.a_from_b;
    merge.covariance = mean.covariance;
    merge.spread_m = mean.spread_m;
  }
  merge.refused = judge(map_a, map_b, merge, options);
  if (merge.refused.empty()) merge.refused = doubts(parts, all, sets, options, executor, merge);
  if (merge.refused.empty()) {
    ask_others(parts, options, executor, merge);
    if (merge.confirmed < options.min_confirmed * merge.expected) {
      merge.refused = fmt::format("of {} keyframes that should see what the other map holds, only {} do",
                                  merge.expected, merge.confirmed);
    }
  }
  sum_up(merge);
  merge.accepted = merge.refused.empty();
  return merge;
}

namespace {

/// Why a pair was refused, without its numbers, so that reasons can be counted.
std::string reason(const PlaceVerification& v, const VerificationOptions& options) {
  if (v.ransac_inliers == 0) return "no pose";
  if (v.points + 2 * v.lines < options.min_inliers) return "too few points and lines fit";
  if (v.contradiction > options.max_contradiction) return "surface seen through";
  if (v.overlap < options.min_overlap) return "surface not confirmed";
  if (v.cells < options.min_cells) return "matches in one corner of the picture";
  return "too few of the landmarks found";
}

/// The best candidates of each two parts, in the order of keyframes.
std::vector<OverlapFinder::Candidate> chosen(std::vector<OverlapFinder::Candidate> candidates, int most) {
  const auto key = [](const OverlapFinder::Candidate& c) {
    return std::make_tuple(std::min(c.query_part, c.match_part), std::max(c.query_part, c.match_part));
  };
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](const auto& x, const auto& y) { return x.score > y.score; });
  std::map<std::tuple<std::size_t, std::size_t>, int> counts;
  std::set<std::pair<KeyframeId, KeyframeId>> seen;
  std::vector<OverlapFinder::Candidate> result;
  for (const OverlapFinder::Candidate& c : candidates) {
    if (!seen.emplace(std::min(c.query, c.match), std::max(c.query, c.match)).second) continue;
    if (counts[key(c)]++ < most) result.push_back(c);
  }
  std::sort(result.begin(), result.end(), [](const auto& x, const auto& y) {
    return std::tie(x.query, x.match) < std::tie(y.query, y.match);
  });
  return result;
}

}  // namespace

OverlapFinder learn_places(const std::vector<MapPart>& parts, const MapFusionOptions& options) {
  OverlapFinder finder(options);
  for (const MapPart& part : parts) {
    for (const KeyframeId id : part.map->keyframe_ids()) finder.add(*part.map, id);
  }
  return finder;
}

std::vector<MergeEvidence> find_overlaps(const std::vector<MapPart>& parts, const MapFusionOptions& options,
                                         const core::Executor& executor) {
  return find_overlaps(parts, learn_places(parts, options).look_at_all(parts, executor), options, executor);
}

std::vector<MergeEvidence> find_overlaps(const std::vector<MapPart>& parts,
                                         const std::vector<OverlapFinder::Candidate>& candidates,
                                         const MapFusionOptions& options, const core::Executor& executor) {
  const std::vector<OverlapFinder::Candidate> tried = chosen(candidates, options.verifications);
  std::vector<VerifiedPair> verified(tried.size());
  executor.parallel_for(tried.size(),
                        [&](std::size_t i) { verified[i] = verify_candidate(parts, tried[i], options); });
  std::vector<MergeEvidence> merges;
  for (std::size_t a = 0; a < parts.size(); ++a) {
    for (std::size_t b = a + 1; b < parts.size(); ++b) {
      const auto between = [&](const OverlapFinder::Candidate& c) {
        return std::min(c.query_part, c.match_part) == a && std::max(c.query_part, c.match_part) == b;
      };
      std::vector<VerifiedPair> pairs;
      std::map<std::string, int> refused;
      for (std::size_t i = 0; i < tried.size(); ++i) {
        if (!between(tried[i])) continue;
        pairs.push_back(verified[i]);
        if (!verified[i].evidence.accepted) ++refused[reason(verified[i].evidence, options.verify)];
      }
      MergeEvidence merge = decide_overlap(parts, a, b, pairs, options, executor);
      merge.candidates = static_cast<int>(std::count_if(candidates.begin(), candidates.end(), between));
      merge.tried = static_cast<int>(pairs.size());
      merge.refused_pairs = std::move(refused);
      if (merge.candidates == 0) merge.refused = "no two keyframes look alike";
      merges.push_back(std::move(merge));
    }
  }
  return merges;
}

}  // namespace plumbline::mapping
