// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Verifies that two keyframes show the same place, and finds their relative pose (docs/method/places.md).
// Points and lines are matched by descriptor, P3P in RANSAC gives a pose, more matches are found around it
// among the landmarks of the surroundings, and the surfaces are aligned; then all tests that could contradict
// the pose are made.
#include <cstdint>
#include <string>

#include "plumbline/core/options.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

struct VerificationOptions {
  int min_inliers = 30;  ///< points, and lines counted twice
  /// Smallest share of the landmarks in view that are found at their predicted positions.
  double min_found = 0.15;
  double min_evidence = 10.0;  ///< smallest product of inliers and that share: few inliers need a large share
  int min_cells = 5;           ///< smallest number of cells with inliers, of a 4 x 4 grid
  double min_overlap = 0.5;    ///< smallest share of the surface in view that is confirmed
  double max_contradiction = 0.05;  ///< largest share of it in the free space of the other camera
  int rounds = 600;                 ///< largest number of RANSAC iterations
  int neighbours = 8;               ///< number of keyframes around the match whose landmarks are searched
  double orb_scale_factor = 1.2;
  bool depth_rows = true;  ///< the depth of points constrains the pose, too
  bool joint = false;      ///< landmarks are adjusted together with the pose, as in the paper
  bool align = true;       ///< the surfaces are aligned to refine the pose
  void declare(core::OptionTable& table);
};

/// A keyframe of a map, seen through its robot's camera.
struct PlaceView {
  const maps::Map* map = nullptr;
  core::KeyframeId keyframe;
  sensor::Pinhole camera;
};

/// Result of all steps; values of steps that were not reached are 0.
struct PlaceVerification {
  bool accepted = false;
  std::string refused;                ///< reason for a refusal, as shown to users; empty if accepted
  geometry::Rigid3 query_from_match;  ///< relative pose of the two cameras
  geometry::Matrix6d information = geometry::Matrix6d::Zero();  ///< of log(estimate * query_from_match^-1)
  int matched_points = 0;                                       ///< points matched by descriptor
  int matched_lines = 0;
  int ransac_inliers = 0;  ///< points and lines
  int points = 0;          ///< inliers in the end, from the whole surroundings
  int lines = 0;
  int visible_points = 0;  ///< landmarks that should have been seen
  int visible_lines = 0;
  double found = 0.0;    ///< share of the visible landmarks that were found
  int cells = 0;         ///< number of cells with inliers, of 4 x 4
  double rms_px = 0.0;   ///< RMS residual of the points, in standard deviations (1 px at octave 0)
  double overlap = 0.0;  ///< overlap of the surfaces, both ways
  double contradiction = 0.0;
  double surface_shift_m = 0.0;  ///< motion of the pose by the alignment of the surfaces; if accepted
  double surface_rms = 0.0;      ///< standard deviations
  bool surface_aligned = false;
};

/// Verifies `query` against `match` and its surroundings, which may be of different maps and cameras.
/// Deterministic for a seed.
PlaceVerification verify_place(const PlaceView& query, const PlaceView& match,
                               const VerificationOptions& options, std::uint64_t seed);

}  // namespace plumbline::mapping
