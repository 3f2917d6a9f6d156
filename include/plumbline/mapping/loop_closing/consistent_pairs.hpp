// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Selects consistent relative poses of images. Each relates a keyframe of one map to a keyframe of another
// (or of the same map, much later). Two are consistent if the loop through both ends near its start; the
// largest set of which every two are consistent is accepted (pairwise consistency maximisation: Mangelson,
// Dominic, Eustice, Vasudevan, ICRA 2018; docs/method/places.md). Repeated places give several such sets: a
// set is credible if no other one is nearly as large.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::mapping {

/// Keyframe `a` of map A and keyframe `b` of map B show the same place: b_from_a takes a's camera frame to
/// b's, metres.
struct PlacePair {
  core::KeyframeId a;
  core::KeyframeId b;
  geometry::Rigid3 b_from_a;
};

struct ConsistencyOptions {
  double max_apart_m = 0.15;       ///< largest distance between the poses that two pairs give one camera
  double max_turned_rad = 0.06;    ///< largest rotation between them
  double apart_per_metre = 0.02;   ///< added per metre between the two pairs, because maps drift
  double turned_per_metre = 0.01;  ///< added per metre, radians
  std::size_t max_sets = 5;        ///< largest number of sets to find
  int budget = 200000;             ///< steps of the search for each set; the best set found by then is used
};

/// Pairs of which every two are consistent.
struct ConsistentSet {
  std::vector<std::size_t> members;  ///< indices of the pairs, ascending
  std::size_t keyframes_a = 0;       ///< number of different keyframes of A
  std::size_t keyframes_b = 0;       ///< number of different keyframes of B
  double span_m = 0.0;  ///< largest distance between two members' cameras, in the map where it is smaller
};

/// True if two pairs are consistent: either pair, together with the maps' relative poses of A's and of B's
/// keyframes, gives the relative pose of the other pair within the limits.
bool agree(const maps::Map& map_a, const maps::Map& map_b, const PlacePair& one, const PlacePair& two,
           const ConsistencyOptions& options);

/// Consistent sets, the largest first. A pair that agrees with half of a set is not used for later sets, so
/// that sets[1] is the strongest alternative to sets[0]. Empty for no pairs; a pair that agrees with no other
/// is a set of one. The same input in the same order gives the same answer.
std::vector<ConsistentSet> consistent_sets(const maps::Map& map_a, const maps::Map& map_b,
                                           const std::vector<PlacePair>& pairs,
                                           const ConsistencyOptions& options);

/// The largest set of 0 ... n-1 of which every two are joined; `joined` is symmetric, n x n. Exact within the
/// budget (steps of branch and bound), else the largest that was found. Ascending.
std::vector<std::size_t> maximum_clique(const std::vector<std::vector<bool>>& joined, int budget);

}  // namespace plumbline::mapping
