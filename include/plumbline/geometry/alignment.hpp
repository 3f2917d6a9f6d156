// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Least-squares alignment of point sets, rigid or with a scale.
#include <vector>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::geometry {

/// target_from_source minimising sum |target_i - T source_i|^2 (Horn 1987 / Umeyama without scale).
/// Both of the same size (throws std::invalid_argument otherwise). Fewer than 3 points: a shift only.
/// Collinear points, which leave the turn about their line free: the smallest rotation that lays line on
/// line.
Rigid3 align_points(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target);

/// The rotation R for which trace(R^T m) is largest, by singular value decomposition (Kabsch): with m the sum
/// of a b^T, that which turns vectors b into a, and with m the sum of rotations, their mean.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

/// A similarity: target = scale * rotation * source + translation.
struct ScaledRigid3 {
  double scale = 1.0;
  Rigid3 rigid;  ///< its rotation and translation

  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return rigid * (scale * p); }
};
/// The same with the scale that minimises sum |target_i - scale R source_i - t|^2 (Umeyama 1991); 1 if all
/// source points are one.
ScaledRigid3 align_points_scaled(const std::vector<Eigen::Vector3d>& source,
                                 const std::vector<Eigen::Vector3d>& target);

}  // namespace plumbline::geometry
