// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The frame of the results: upright, on the floor.
#include <string>

#include "plumbline/cloud/types.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::pipeline {

enum class Up {
  kFloor,   ///< z along the floor's normal, 0 on the floor
  kCamera,  ///< z upright in the first camera's picture, 0 at the first camera
  kNone,    ///< the map's own frame
};

struct UpFrame {
  geometry::Rigid3 output_from_map;
  std::string up = "none";  ///< what was found: floor, camera or none
};

/// z up; x where the first camera looks, as far as that is horizontal; the origin below (floor) or at
/// (camera) the first camera. kFloor takes the lowest large plane that faces up (cloud::find_floor), and
/// falls back to kCamera when no such surface is seen. Without poses: none.
UpFrame find_up(Up wanted, const cloud::CloudConstPtr& cloud, const geometry::Trajectory& trajectory);

}  // namespace plumbline::pipeline
