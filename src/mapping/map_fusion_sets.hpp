// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What verified pairs of keyframes say of how the worlds of two maps lie.
#include <cstddef>
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

}  // namespace plumbline::mapping
