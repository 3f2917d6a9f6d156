// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Conventions by which other programs write poses.
#include <string>
#include <utility>
#include <vector>

#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::geometry {

enum class PoseConvention {
  kWorldFromCamera,  ///< ours: x right, y down, z forward; quaternions x y z w
  kInverted,         ///< camera_from_world
  kOpenGl,           ///< y up, z backwards
  kWFirst,           ///< quaternions w x y z, read as x y z w
};

/// Names for users, without kWorldFromCamera: "inverted", "opengl", "wxyz".
const std::vector<std::pair<std::string, PoseConvention>>& pose_conventions();

/// world_from_camera of a pose that was read as if it were that, but is written by `convention`.
Rigid3 read_by(PoseConvention convention, const Rigid3& pose);

}  // namespace plumbline::geometry
