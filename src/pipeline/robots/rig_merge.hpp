// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Maps of cameras that are fixed to each other, joined by their motion (docs/method/merging.md).
#include <string>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/geometry/hand_eye.hpp"
#include "plumbline/mapping/merging/map_fusion.hpp"
#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/rig.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {

/// The pose of a rig's camera that its map is joined by.
struct RigPlace {
  std::string name;
  geometry::HandEye pose;  ///< value and covariance as used; residuals of the motions
  bool found = false;      ///< from the motions; else as given
  double time_offset_s = 0.0;
  const char* offset_is = "none";  ///< "given", "found"
  std::size_t pairs = 0;           ///< pairs of keyframes that tie its map to the reference camera's
};

struct RigMerge {
  std::string reference;
  std::vector<RigPlace> cameras;  ///< all but the reference
  std::vector<mapping::MergeEvidence> merges;
};

/// Poses of the cameras and merges of all parts that hold them. Errors (kInput): a camera shares no time with
/// the reference; its pose is not given, and the motion does not show it.
core::Result<RigMerge> rig_merge(const Rig& rig, const std::vector<RobotMap>& parts, core::Log& log);

/// Sections of summary.json.
Json section_of(const RigMerge& rig);
/// rig.yaml of the result, with which another run needs to find nothing.
std::string to_yaml(const RigMerge& rig);

}  // namespace plumbline::pipeline
