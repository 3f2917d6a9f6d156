// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Velocity of a camera from its trajectory.
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::geometry {

/// At `stamp`, as the poses before and after it say (m/s, rad/s), in the camera's own frame:
/// camera_from_world(t + dt) = Exp(velocity dt) camera_from_world(t). Zero where these are more than 0.3 s
/// apart.
Vector6d velocity_at(const Trajectory& trajectory, double stamp);

}  // namespace plumbline::geometry
