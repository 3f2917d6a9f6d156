// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Do two keyframes show the same place, and how do they lie to each other? (docs/method/places.md.) Points
// and lines are matched by descriptor, P3P in RANSAC gives a pose, more matches are found around it among the
// landmarks of the surroundings, the surfaces are aligned; then everything that speaks against it is asked.
#include <cstdint>
#include <string>

#include "plumbline/core/options.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

struct VerificationOptions {
  int min_inliers = 30;             ///< points, and lines counted twice
  double min_found = 0.15;          ///< share of the landmarks in view that are found where they should be
  double min_evidence = 10.0;       ///< inliers times that share: few must be most, many may be some
  int min_cells = 5;                ///< of a 4 x 4 grid of the image, with inliers
  double min_overlap = 0.5;         ///< share of the surface in view that is confirmed
  double max_contradiction = 0.05;  ///< share of it that lies where the other camera saw free space
  int rounds = 600;                 ///< of RANSAC, at most
  int neighbours = 8;               ///< keyframes around the match whose landmarks are looked for
  double orb_scale_factor = 1.2;
  bool depth_rows = true;  ///< points are held by their depth, too
  bool joint = false;      ///< landmarks are adjusted with the pose, as the paper has it
  bool align = true;       ///< the pose as the surfaces say, too
  void declare(core::OptionTable& table);
};

/// A keyframe of a map, seen through its robot's camera.
struct PlaceView {
  const maps::Map* map = nullptr;
  core::KeyframeId keyframe;
  sensor::Pinhole camera;
};

/// All that was found out; what was not reached is 0.
struct PlaceVerification {
  bool accepted = false;
  std::string refused;                                          ///< why not, for people; empty when accepted
  geometry::Rigid3 query_from_match;                            ///< between the two cameras
  geometry::Matrix6d information = geometry::Matrix6d::Zero();  ///< of log(estimate * query_from_match^-1)
  int matched_points = 0;                                       ///< by descriptor
  int matched_lines = 0;
  int ransac_inliers = 0;  ///< points and lines
  int points = 0;          ///< inliers in the end, from the whole surroundings
  int lines = 0;
  int visible_points = 0;  ///< landmarks that should have been seen
  int visible_lines = 0;
  double found = 0.0;    ///< share of these that were
  int cells = 0;         ///< of 4 x 4, with inliers
  double rms_px = 0.0;   ///< of the points, in standard deviations (1 px at octave 0)
  double overlap = 0.0;  ///< of the surfaces, both ways
  double contradiction = 0.0;
  double surface_shift_m = 0.0;  ///< how far the alignment of the surfaces moved the pose; of accepted ones
  double surface_rms = 0.0;      ///< standard deviations
  bool surface_aligned = false;
};

/// `query` against `match` and its surroundings; the two may be of different maps and cameras. Deterministic
/// for a seed.
PlaceVerification verify_place(const PlaceView& query, const PlaceView& match,
                               const VerificationOptions& options, std::uint64_t seed);

}  // namespace plumbline::mapping
