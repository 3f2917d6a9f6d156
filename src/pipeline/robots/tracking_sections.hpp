// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Sections of the robots' SLAM in summary.json: loops, components, maps of other robots.
#include <map>
#include <string>

#include "plumbline/mapping/slam.hpp"
#include "robots/robot_cameras.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {

/// Adds one robot's loops to the section `loops`.
void report_loops(const mapping::Slam& slam, Json& loops);
/// Adds the components that were joined while the robot mapped. `frames`: by root, as they were tracked.
void report_joins(const std::string& robot, const mapping::Slam& slam,
                  const std::map<core::KeyframeId, std::size_t>& frames, Json& list);
/// Use that was made of other robots' maps.
Json feedback_section(const Slams& slams, const mapping::OtherMapsInbox& others);

/// Adds a doubt if loops that agree with one another contradict the path.
void doubt_disputed_loops(const Json& summary, std::vector<Doubt>& reasons);

}  // namespace plumbline::pipeline
