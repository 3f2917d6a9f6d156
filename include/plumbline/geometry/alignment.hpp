// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Least-squares rigid alignment of point sets.
#include <vector>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::geometry {

/// target_from_source minimising sum |target_i - T source_i|^2 (Horn 1987 / Umeyama without scale).
/// Both of the same size (throws std::invalid_argument otherwise). Fewer than 3 points: a shift only.
/// Collinear points, which leave the turn about their line free: the smallest rotation that lays line on
/// line.
Rigid3 align_points(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target);

}  // namespace plumbline::geometry
