// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a keyframe has depth for, older keyframes may have seen without: through a door whose near post
// shadows the projector, beyond the sensor's range, on what shines. Their corners there belong to no
// landmark until one is made, and then say how the keyframes lie to each other.
#include <vector>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/tracking/association.hpp"

namespace plumbline::mapping {

/// Looks for `landmarks`, just made from corners of the newest keyframe, in `older` keyframes (the nearest
/// first), among corners that see nothing yet. Where it finds one, that corner's patch is aligned with the
/// newest keyframe's image (`levels`); the landmark becomes what the older keyframe saw, and both see it
/// exactly. The newest keyframe's corner and its patch's offset follow in `newest`, which must be the
/// features of that keyframe. Corners found must lie off their landmarks' projections all alike, by how much
/// does not matter much: the older pose is not known better. Returns how many landmarks were found.
int add_earlier_observations(maps::Map& map, const std::vector<core::PointId>& landmarks,
                             core::KeyframeId keyframe, const std::vector<core::KeyframeId>& older,
                             const std::vector<cv::Mat>& levels, const sensor::Pinhole& camera,
                             const tracking::AssociationOptions& options, features::FrameFeatures& newest);

}  // namespace plumbline::mapping
