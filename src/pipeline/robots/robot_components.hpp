// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The components of robots' maps (maps/components.hpp) as maps of their own.
#include <cstddef>
#include <string>
#include <vector>

#include "plumbline/pipeline/data.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {

struct RobotComponents {
  std::vector<RobotMap> maps;      ///< by their first keyframe
  std::size_t dropped = 0;         ///< components of too few keyframes
  std::size_t dropped_frames = 0;  ///< number of frames tracked in them
};

/// A map without further components comes back as it is. Components of fewer than five keyframes are dropped,
/// but for the one with most frames. All maps have all frames, of which only their own are tracked.
RobotComponents components_of(const RobotMap& whole);

/// The maps of components put together again, one frame list for all: of several components with a robot in
/// common each frame is that of the component in which it is tracked.
std::vector<maps::FramePose> frames_of(const std::vector<const RobotMap*>& parts);

/// Outcome for one component.
struct ComponentFate {
  std::string name;        ///< name of its folder, or of the robot and the keyframe that began it
  std::size_t frames = 0;  ///< tracked in it
  std::size_t keyframes = 0;
  bool joined = false;     ///< it is part of the result
  double joined_s = -1.0;  ///< time in the recording, if it was joined while mapping; negative: at the end
  int agreeing = 0;        ///< keyframes that agree
  std::string why_not;     ///< empty: joined
};
Json section_of(const ComponentFate& component);

/// Components that are not part of the result.
void doubt_components_apart(const Json& summary, std::vector<Doubt>& reasons);

}  // namespace plumbline::pipeline
