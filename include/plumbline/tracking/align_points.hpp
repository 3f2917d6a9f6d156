// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Matched corners to a tenth of a pixel: aligned with what their landmark looked like when it was first seen.
#include <vector>

#include "plumbline/tracking/association.hpp"

namespace plumbline::tracking {

/// Sets `shift` and `aligned` of those matches whose landmark a keyframe saw from nearly the same side and
/// distance, oldest first, and where the pictures agree (features::align_patch); clears those of the others.
/// `frame` needs its levels.
void align_points(const maps::Map& map, const features::FrameFeatures& frame, const sensor::Pinhole& camera,
                  const geometry::Rigid3& camera_from_world, double scale_factor,
                  std::vector<PointMatch>& matches);

}  // namespace plumbline::tracking
