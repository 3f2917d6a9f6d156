// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Steps that decide whether two maps overlap, and find their relative pose.
#include <cstddef>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/mapping/loop_closing/consistent_pairs.hpp"
#include "plumbline/mapping/merging/map_fusion.hpp"

namespace plumbline::mapping {

/// Parts a and b, a < b.
struct PartPair {
  const std::vector<MapPart>& parts;
  std::size_t a;
  std::size_t b;
  const MapFusionOptions& options;
  const core::Executor& executor;
  [[nodiscard]] const maps::Map& map_a() const { return *parts[a].map; }
  [[nodiscard]] const maps::Map& map_b() const { return *parts[b].map; }
};

/// Accepted pairs and the consistent sets of them, the largest first.
struct PairSets {
  std::vector<VerifiedPair> pairs;
  std::vector<PlacePair> places;  ///< the same pairs, with `a` in part a and `b` in part b
  std::vector<ConsistentSet> sets;
  [[nodiscard]] std::vector<PlacePair> places_of(std::size_t set) const;
};
/// The accepted pairs, without the sets.
PairSets accepted_pairs(const PartPair& maps, const std::vector<VerifiedPair>& pairs);
PairSets pair_sets(const PartPair& maps, const std::vector<VerifiedPair>& pairs);

/// Transform from b's world to a's according to one pair.
geometry::Rigid3 worlds(const maps::Map& a, const maps::Map& b, const PlacePair& pair);

/// Robust mean of the alignments that the pairs give.
Alignment mean_alignment(const PartPair& maps, const std::vector<PlacePair>& pairs);

/// Number of different keyframes on the side that has fewer: one keyframe seen from ten others counts once.
int support(const ConsistentSet& set);

/// Verifies more pairs of keyframes that should see the same place if one of the first sets is right, except
/// those in `known`.
std::vector<VerifiedPair> verify_neighbours(const PartPair& maps, const PairSets& sets,
                                            const std::vector<VerifiedPair>& known);

/// Tests the alignment against the maps, together with others that are supported by the remaining sets or by
/// a step of repetition.
Ambiguity ambiguity_of(const PartPair& maps, const PairSets& sets, const geometry::Rigid3& a_from_b);
/// Natural logarithm of the odds that two maps share a place, if keyframes at `places` places agree.
double log_odds(const Ambiguity& ambiguity, int places, const MapFusionOptions& options);
/// Reason against merging them; empty: there is none.
std::string objection(const Ambiguity& ambiguity, int places, const MapFusionOptions& options);

/// Keyframes of b with a view of a: those that do not agree yet are verified.
CrossValidation cross_validate(const PartPair& maps, const std::vector<VerifiedPair>& agreeing,
                               const geometry::Rigid3& a_from_b);

}  // namespace plumbline::mapping
