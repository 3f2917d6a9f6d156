// SPDX-License-Identifier: BSD-3-Clause
// Search for places that two maps share, and for the relative pose of the maps.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "merging/free_direction.hpp"
#include "merging/map_fusion_sets.hpp"

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

/// Number of places at which keyframes of b agree: of those near one another one counts.
int places_of(const maps::Map& map, const std::vector<PlacePair>& pairs, const MapFusionOptions& options) {
  std::vector<Rigid3> places;
  for (const PlacePair& pair : pairs) {
    const Rigid3 world_from_camera = map.camera_from_world(pair.b).inverse();
    const auto same = [&](const Rigid3& other) {
      return (other.translation - world_from_camera.translation).norm() < options.min_span_m &&
             geometry::rotation_angle(other.rotation.transpose() * world_from_camera.rotation) <
                 options.min_span_rad;
    };
    if (std::none_of(places.begin(), places.end(), same)) places.push_back(world_from_camera);
  }
  return static_cast<int>(places.size());
}

std::string objection(const PartPair& maps, const Consistency& consistency, const Rigid3& a_from_b) {
  const MapFusionOptions& options = maps.options;
  if (consistency.verified == 0) return "no two keyframes were verified to show the same place";

  const bool few = consistency.agreeing < options.min_pairs;
  const FreeDirection free = free_direction(maps.map_a(), maps.map_b(), a_from_b, consistency.pairs);
  if ((few ? free.slides() : free.corridor()) && free.reach_m < options.few_extent_m) {
    return fmt::format(
        "what they have in common slides along itself as a {} does, and the maps reach over {:.1f} m there "
        "({} m are needed to see whether things repeat)",
        free.corridor() ? "corridor" : "wall", free.reach_m, options.few_extent_m);
  }

  return {};
}

/// A place that looks alike in part is told by what does not stand there.
std::string objection(const MergeEvidence& merge) {
  if (merge.ambiguity.against_like + merge.validation.against_like >= 0.0) return {};
  return fmt::format(
      "a place that looks alike in part: of {} keyframes that should see what the other map holds, {} do, "
      "and {} of {} landmarks are found",
      merge.validation.expected, merge.validation.confirmed, merge.ambiguity.overlap.matched,
      merge.ambiguity.overlap.expected);
}

Consistency consistency_of(const PartPair& maps, const PairSets& sets) {
  Consistency result;
  result.verified = static_cast<int>(sets.places.size());
  if (sets.sets.empty()) return result;
  result.agreeing = support(sets.sets.front());
  result.span_m = sets.sets.front().span_m;
  result.span_rad = turn_between(maps.map_b(), sets.places_of(0));
  result.places = std::min(result.agreeing, places_of(maps.map_b(), sets.places_of(0), maps.options));
  for (const std::size_t i : sets.sets.front().members) result.pairs.push_back(sets.pairs[i]);
  return result;
}

}  // namespace

void OverlapFinder::add(const maps::Map& map, KeyframeId keyframe) {
  const auto& features = map.keyframe(keyframe).features;
  if (features != nullptr) database_.add(keyframe, features);
}

std::vector<OverlapFinder::Candidate> OverlapFinder::recognise(const std::vector<MapPart>& parts,
                                                               std::size_t part, KeyframeId keyframe,
                                                               KeyframeId before) {
  const auto& features = parts[part].map->keyframe(keyframe).features;
  if (features == nullptr) return {};
  return recognise(database_.query(*features), parts, part, keyframe, before);
}

std::vector<OverlapFinder::Candidate> OverlapFinder::recognise(const places::Database::Scores& scores,
                                                               const std::vector<MapPart>& parts,
                                                               std::size_t part, KeyframeId keyframe,
                                                               KeyframeId before) {
  std::vector<Candidate> result;
  const auto neighbours = [&](KeyframeId id) {
    const std::size_t where = part_of(parts, id);
    return where == parts.size() ? std::vector<KeyframeId>{}
                                 : parts[where].map->neighbours(id, kSurroundings);
  };

  // Similar views within one map are its own loops, not overlaps with another map.
  const auto allowed = [&](KeyframeId id) {
    const std::size_t where = part_of(parts, id);
    return where != part && where != parts.size();
  };

  // Scores count relative to that of the keyframe before, because they all depend
  // on how distinctive the scene is.
  const KeyframeId usual = before.valid() && database_.contains(before) ? before : KeyframeId{};
  for (const places::Candidate& c : recogniser_.recognise(scores, keyframe, usual, allowed, neighbours)) {
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

  // A part may hold several robots, and the first keyframe of each has none before it.
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

  // Scores do not depend on one another and are computed in parallel; recognition runs in order.
  constexpr std::size_t kAtATime = 256;  // keyframes scored at a time, to bound memory
  std::vector<Candidate> candidates;
  for (std::size_t first = 0; first < queries.size(); first += kAtATime) {
    std::vector<places::Database::Scores> scores(std::min(kAtATime, queries.size() - first));
    executor.parallel_for(scores.size(), [&](std::size_t i) {
      const Query& q = queries[first + i];
      scores[i] = database_.query(*parts[q.part].map->keyframe(q.keyframe).features);
    });

    for (std::size_t i = 0; i < scores.size();
         ++i) {  // in order, because recognition depends on earlier queries
      const Query& q = queries[first + i];
      const std::vector<Candidate> found = recognise(scores[i], parts, q.part, q.keyframe, q.before);
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
  const PartPair maps{parts, a, b, options, executor};
  MergeEvidence merge;
  merge.a = a;
  merge.b = b;

  // Few agreeing pairs may be chance, or all that was tried so far: the keyframes around them decide.
  PairSets sets = pair_sets(maps, found);
  if (!sets.sets.empty() && support(sets.sets.front()) < options.min_pairs) {
    std::vector<VerifiedPair> more = verify_neighbours(maps, sets, found);
    more.insert(more.begin(), found.begin(), found.end());
    sets = pair_sets(maps, more);
  }

  merge.consistency = consistency_of(maps, sets);
  if (!sets.sets.empty()) merge.alignment = mean_alignment(maps, sets.places_of(0));
  merge.pairs = merge.consistency.pairs;
  merge.refused = objection(maps, merge.consistency, merge.alignment.a_from_b);

  // The first objection ends the examination, because the remaining tests are expensive.
  if (merge.refused.empty()) {
    merge.ambiguity = ambiguity_of(maps, sets, merge.alignment.a_from_b);
    merge.refused = objection(merge.ambiguity, merge.consistency.places, options);
  }

  if (merge.refused.empty()) {
    merge.validation = cross_validate(maps, merge.pairs, merge.alignment.a_from_b);
    merge.pairs.insert(merge.pairs.end(), merge.validation.pairs.begin(), merge.validation.pairs.end());
    merge.refused = objection(merge);
  }

  merge.accepted = merge.refused.empty();
  return merge;
}

PairTotals MergeEvidence::totals() const {
  PairTotals totals;
  const auto n = static_cast<double>(pairs.size());
  for (const VerifiedPair& pair : pairs) {
    const PlaceVerification& e = pair.evidence;
    totals.matches += e.matched_points + e.matched_lines;
    totals.inliers += e.points + e.lines;
    totals.rms_px += e.rms_px / n;
    totals.overlap += e.overlap / n;
  }
  return totals;
}

namespace {

/// Why a pair was refused, without its numbers, so that reasons can be counted.
std::string reason(const PlaceVerification& v, const VerificationOptions& options) {
  if (v.ransac_inliers == 0) return "no pose";
  if (v.points + 2 * v.lines < options.min_inliers) return "too few points and lines fit";
  if (v.contradiction > options.max_contradiction) return "surface seen through";
  if (v.overlap < options.min_overlap) return "surface not confirmed";
  if (v.cells < options.min_cells) return "matches in one corner of the image";
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

  // Every two parts are decided by themselves; contradictions between merges appear
  // later, in the joint pose graph.
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
