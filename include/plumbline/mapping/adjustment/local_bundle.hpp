// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Local bundle adjustment (docs/method/mapping.md): a keyframe, those with which it shares landmarks or
// surfaces, and the landmarks that they see. Three steps, so that the middle one can run beside the tracker:
// take from the map, adjust, put back. The map may grow and lose landmarks between the first step and the
// last.
#include <map>
#include <optional>
#include <vector>

#include "plumbline/mapping/adjustment/map_bundle.hpp"
#include "plumbline/mapping/adjustment/observation_noise.hpp"
#include "plumbline/mapping/adjustment/tracked_path.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

/// Points and lines are sorted.
struct LocalBundle : MapBundle {
  std::vector<geometry::Rigid3> taken;  ///< camera_from_world of the keyframes when they were taken
  core::KeyframeId next;                ///< this robot's keyframes from here on were made after the take
};

struct LocalBundleOptions {
  int keyframes = 12;  ///< number that may move
  ObservationNoise noise;
};

/// Takes a bundle out of the map. The keyframes that may move are `keyframe`, `also` (those that no bundle
/// has adjusted yet), and those that share most with `keyframe`. Two kinds of keyframes around these are
/// held: those before and after on the tracker's path (maps::Keyframe::reference), so that everything that
/// moves is tied to something fixed by what the tracker saw between them, and those that see the same
/// landmarks.
LocalBundle take_local_bundle(const maps::Map& map, core::KeyframeId keyframe, const sensor::Pinhole& camera,
                              const LocalBundleOptions& options,
                              const std::vector<core::KeyframeId>& also = {});

/// new_from_old_world around keyframes that moved.
using MapCorrection = std::map<core::KeyframeId, geometry::Rigid3>;

/// Puts poses, landmarks and outliers back into the map. What has left the map by now is skipped. Keyframes
/// made after the bundle was taken keep their pose relative to their parent in the spanning tree; landmarks
/// that were not part of the bundle move with the keyframe that saw them first. Nothing is changed if a
/// keyframe's pose is not the one that was taken, because the map was moved with better knowledge meanwhile,
/// or if the result contradicts what the tracker measured (tracked_path.hpp), which is then reported.
std::optional<MapCorrection> put_back(const LocalBundle& bundle, maps::Map& map,
                                      std::optional<Contradiction>* refused = nullptr);

}  // namespace plumbline::mapping
