// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Who saw the points of a fused cloud.
#include <cstdint>
#include <vector>

#include "plumbline/cloud/dense_fusion.hpp"

namespace plumbline::pipeline {

/// For each point the robot with most measurements around it (ties: the lower number). `robots`: of each
/// view; 0-254. Reads each view once, several
/// at a time. Errors are those of `read`.
core::Result<std::vector<std::uint8_t>> robots_of_points(
    const cloud::Cloud& fused, const std::vector<geometry::Rigid3>& world_from_camera,
    const std::vector<std::int32_t>& robots, const cloud::ReadView& read, double voxel_m,
    const core::Executor& executor);

}  // namespace plumbline::pipeline
