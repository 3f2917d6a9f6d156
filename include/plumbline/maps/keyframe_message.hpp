// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a robot tells a fusion end of a new keyframe: enough to recognise its place and to verify it, in as
// few bytes as that takes. Plain bytes: within a process or over a network.
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::maps {

struct KeyframeMessage {
  std::shared_ptr<const Keyframe> keyframe;  ///< without grey thumbnail; rounded once it has travelled
  geometry::Rigid3 camera_from_world;        ///< in the robot's own world
  sensor::Pinhole camera;
  std::vector<std::int32_t> points;  ///< by feature: number of its landmark at the robot; -1: none
  std::vector<std::int32_t> lines;
  /// Earlier keyframes that have moved lately, where they are now: camera_from_world.
  std::vector<std::pair<KeyframeId, geometry::Rigid3>> moved;
  std::vector<std::uint8_t> cloud;  ///< of cloud::encode_cloud, camera frame; may be empty
};

/// The message of a keyframe of `map`; `recent` keyframes before it are told as moved. Without a cloud.
KeyframeMessage make_message(const Map& map, KeyframeId keyframe, const sensor::Pinhole& camera,
                             int recent = 8);

/// Kept: descriptors, landmarks and the pose exactly; pixels to a quarter, depth to a millimetre (up to 65
/// m), the small depth picture to two centimetres, directions to 11 degrees; 128 samples of the surface.
/// Points come back by octave and row, with their landmarks; the noise of lines' ends is what their
/// depth lets expect. Same message, same bytes.
std::vector<std::uint8_t> encode_message(const KeyframeMessage& message);

/// Errors (kInput): not such bytes, another version, truncated, damaged.
core::Result<KeyframeMessage> decode_message(const std::vector<std::uint8_t>& bytes);

}  // namespace plumbline::maps
