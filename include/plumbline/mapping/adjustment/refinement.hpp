// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Refinement of a finished map as a whole: local maps are aligned by ICP, then everything is adjusted
// together (docs/method/refinement.md).
#include <map>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/mapping/registration/local_map_alignment.hpp"

namespace plumbline::mapping {

struct RefinementOptions {
  bool icp = true;       ///< align local maps that overlap
  bool adjust = true;    ///< anything at all
  bool accuracy = true;  ///< compute the accuracy of keyframes
  LocalMapOptions local_maps;
  PairOptions pairs;
  AlignmentOptions alignment;
  GlobalAdjustmentOptions adjustment;
  void declare(core::OptionTable& table);
};

struct RefinementSummary {
  std::size_t local_maps = 0;
  std::size_t tried = 0;      ///< alignments of two local maps
  std::size_t accepted = 0;   ///< alignments that were used
  std::size_t rejected = 0;   ///< accepted alignments that the pose graph rejected
  double mean_rms = 0.0;      ///< mean residual of the accepted, standard deviations of the depth noise
  double mean_shift_m = 0.0;  ///< mean motion of the keyframes
  double max_shift_m = 0.0;
  std::size_t refused = 0;      ///< solutions that would have torn the map
  optimize::BundleFits before;  ///< fits at the poses of the pose graph; zeros: not known
  optimize::BundleFits after;   ///< fits after the adjustment
};

struct Refinement {
  RefinementSummary summary;
  MapAccuracy accuracy;
};

/// Moves keyframes and landmarks of `map` to where they and the surfaces of its local maps fit best.
/// `surfaces`: coarse_surface of keyframes; those without one are in no local map. Errors as adjust_map.
Refinement refine_map(maps::Map& map, const std::map<core::KeyframeId, CoarseSurface>& surfaces,
                      const Cameras& cameras, const RefinementOptions& options,
                      const core::Executor& executor, core::Log& log);

}  // namespace plumbline::mapping
