// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Evaluates how well two aligned maps fit, and whether they would fit elsewhere as well. Where things repeat
// (doors along a corridor, identical desks) the same images allow several alignments; one is credible if what
// was seen contradicts the others. Similar landmarks a fixed step apart reveal a
// repetition even if no keyframe stands at both of its ends: cameras see farther than they go.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/mapping/merging/map_fusion.hpp"

namespace plumbline::mapping {

class MapOverlay {
 public:
  MapOverlay(const MapPart& a, const MapPart& b);

  /// The fit of b aligned with a.
  [[nodiscard]] OverlayFit fit(const geometry::Rigid3& a_from_b) const;

  /// Natural logarithm of the odds that surfaces tell of one place, against another one: at most 0, for walls
  /// and floors are confirmed wherever a map is laid. Surface samples of each map that lie in view of the
  /// other map's cameras and face them are where these saw a surface too, or were seen through; those of a
  /// cell of 0.3 m count as one.
  [[nodiscard]] double surface_log_odds(const geometry::Rigid3& a_from_b) const;

  /// Other alignments of b with a, a step of `least_m` or more away from `a_from_b`: those supported by
  /// most landmarks seen by the keyframes of `pairs`.
  [[nodiscard]] std::vector<geometry::Rigid3> steps(const geometry::Rigid3& a_from_b,
                                                    const std::vector<VerifiedPair>& pairs,
                                                    double least_m) const;

 private:
  struct Landmark {
    Eigen::Vector3d position;  ///< in the map's world
    Eigen::Vector3d view;      ///< direction from the cameras, unit
    double distance_m = 0.0;   ///< from its first camera
    features::Descriptor256 descriptor{};
  };
  struct Side {
    MapPart part;
    std::vector<Landmark> landmarks;   ///< sorted by cell
    std::vector<std::uint64_t> cells;  ///< cell of each landmark
  };
  static Side side(const MapPart& part);
  static Landmark landmark(const maps::Map& map, core::PointId id);
  void match(const Side& side, const Landmark& landmark, const Eigen::Vector3d& at, OverlayFit& sum) const;
  void overlay(const Side& moved, const Side& fixed, const geometry::Rigid3& fixed_from_moved,
               OverlayFit& sum) const;
  static void vote(const Side& moved, const Side& fixed, const geometry::Rigid3& fixed_from_moved,
                   const std::vector<VerifiedPair>& pairs, std::vector<Eigen::Vector3d>& steps);

  Side a_;
  Side b_;
  double alike_ = 0.0;  ///< share of all pairs of landmarks, one of each map, that look alike
};

}  // namespace plumbline::mapping
