// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Merges duplicate landmarks and adds missing observations: landmarks are searched in the images of keyframes
// that should see them and did not (docs/method/mapping.md).
#include <cstdint>
#include <map>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/tracking/association.hpp"

namespace plumbline::mapping {

struct FusionOptions {
  int keyframes = 10;      ///< largest number of neighbours
  double radius_px = 4.0;  ///< search radius around the projection, at octave 0
  tracking::AssociationOptions association;

  void declare(core::OptionTable& table);
};

struct FusionSummary {
  int observed = 0;  ///< observations added
  int merged = 0;    ///< duplicate landmarks removed
};

/// Landmarks of `keyframe` are projected into each of `neighbours`, and the neighbours' landmarks into
/// `keyframe`. If a feature near the projection looks like the landmark and agrees in image position and
/// depth, there are two cases: a feature without a landmark becomes an observation; a feature of another
/// landmark shows that both are one, and the less seen is merged into the other. Two landmarks that one
/// keyframe sees at different positions never merge. Every robot of the keyframes must have a camera (throws
/// std::out_of_range).
FusionSummary fuse_points(maps::Map& map, core::KeyframeId keyframe,
                          const std::vector<core::KeyframeId>& neighbours,
                          const std::map<std::int32_t, sensor::Pinhole>& cameras,
                          const FusionOptions& options);

/// The same for lines. A merged line covers the extent of both.
FusionSummary fuse_lines(maps::Map& map, core::KeyframeId keyframe,
                         const std::vector<core::KeyframeId>& neighbours,
                         const std::map<std::int32_t, sensor::Pinhole>& cameras,
                         const FusionOptions& options);

}  // namespace plumbline::mapping
