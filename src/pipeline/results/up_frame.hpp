// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The frame of the results: upright, on the floor, square to the walls.
#include <string>

#include "plumbline/cloud/types.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::pipeline {

enum class Up {
  kFloor,   ///< z along the floor's normal, 0 on the floor
  kCamera,  ///< z upright in the first camera's image, 0 at the first camera
  kNone,    ///< the map's own frame
};

enum class Yaw {
  kWalls,   ///< x along the direction of most walls that is nearest to where the first camera looks
  kCamera,  ///< x where the first camera looks
};

struct UpFrame {
  geometry::Rigid3 output_from_map;
  std::string up = "none";   ///< what was found: floor, camera or none
  std::string yaw = "none";  ///< walls, camera or none
};

/// z up; x horizontal; the origin below (floor) or at (camera) the first camera. kFloor takes the lowest
/// large plane that faces up (cloud::find_floor), and falls back to kCamera when no such surface is seen;
/// kWalls falls back to kCamera when less than a third of the upright surface is square to one direction.
/// Without poses, or with kNone: the map's own frame.
UpFrame find_up(Up wanted, Yaw yaw, const cloud::CloudConstPtr& cloud,
                const geometry::Trajectory& trajectory);

}  // namespace plumbline::pipeline
