// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What verified pairs of keyframes say of how the worlds of two maps lie, and what speaks against it.
#include <cstddef>
#include <string>
#include <vector>

#include "plumbline/mapping/consistent_pairs.hpp"
#include "plumbline/mapping/map_fusion.hpp"

namespace plumbline::mapping {

/// The accepted ones of `pairs`, ends sorted by part; indices[i] is where places[i] stands in `pairs`.
struct SortedPairs {
  std::vector<PlacePair> places;
  std::vector<std::size_t> indices;
};
SortedPairs sort_pairs(const maps::Map& a, const maps::Map& b, const std::vector<VerifiedPair>& pairs);

/// a's world from b's, as one pair says.
geometry::Rigid3 worlds(const maps::Map& a, const maps::Map& b, const PlacePair& pair);

/// Robust mean of what the pairs say, its covariance about the middle of b's cameras, and how far from the
/// mean they put b's cameras (RMS, metres).
struct MeanTransform {
  geometry::Rigid3 a_from_b;
  geometry::Matrix6d covariance = geometry::Matrix6d::Identity();
  double spread_m = 0.0;
};
MeanTransform mean_transform(const maps::Map& a, const maps::Map& b, const std::vector<PlacePair>& pairs);

/// Different keyframes on the side that has fewer: one keyframe seen from ten others is one witness.
int support(const ConsistentSet& set);

/// What speaks against the answer of sets[0], of which `merge` has the transform and the pairs: the maps do
/// not fit where it lays them, or another set of pairs, or a step by which things repeat, would fit as well.
/// Fills laid, alternative, alternative_fit and alternative_m; empty: nothing.
std::string ambiguity(const std::vector<MapPart>& parts, const SortedPairs& all,
                      const std::vector<ConsistentSet>& sets, const MapFusionOptions& options,
                      const core::Executor& executor, MergeEvidence& merge);

/// More pairs of keyframes that should see the same if one of the first sets is right, verified; nothing that
/// is in `pairs` already. Uses a and b of `merge`.
void expand_candidates(const std::vector<MapPart>& parts, const SortedPairs& all,
                       const std::vector<ConsistentSet>& sets, const MapFusionOptions& options,
                       const core::Executor& executor, const MergeEvidence& merge,
                       std::vector<VerifiedPair>& pairs);

/// Keyframes of b with a view of a, as a_from_b of `merge` has it: those that do not agree yet are verified.
/// Fills expected, confirmed and more pairs.
void cross_validate(const std::vector<MapPart>& parts, const MapFusionOptions& options,
                    const core::Executor& executor, MergeEvidence& merge);

}  // namespace plumbline::mapping
