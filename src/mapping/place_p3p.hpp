// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A camera's pose from three points, fast enough to be asked for every sample of RANSAC.
#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::mapping {

struct P3pPoses {
  std::array<geometry::Rigid3, 4> camera_from_world;
  std::size_t count = 0;
};

/// All poses from which the points `world` (metres) are seen along the unit vectors `rays`, in no order;
/// polished on the three equations of the distances. Where two poses nearly coincide one may be left out.
/// Two quadrics that the distances fulfil span a pencil; one of its degenerate members is a pair of planes,
/// each of which leaves a quadratic equation (Persson & Nordberg, Lambda Twist, ECCV 2018; the pair is split
/// as in Ding et al., Revisiting the P3P Problem, CVPR 2023).
P3pPoses poses_from_points(const std::array<Eigen::Vector3d, 3>& world,
                           const std::array<Eigen::Vector3d, 3>& rays);

}  // namespace plumbline::mapping
