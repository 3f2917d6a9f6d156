// SPDX-License-Identifier: BSD-3-Clause
#include "merging/free_direction.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace plumbline::mapping {
namespace {

/// Extent of a map's camera positions along a direction of its world, metres.
double extent_along(const maps::Map& map, const Eigen::Vector3d& direction) {
  double least = std::numeric_limits<double>::max();
  double most = std::numeric_limits<double>::lowest();
  for (const core::KeyframeId id : map.keyframe_ids()) {
    const double at = direction.dot(map.camera_from_world(id).inverse().translation);
    least = std::min(least, at);
    most = std::max(most, at);
  }
  return std::max(0.0, most - least);
}

}  // namespace

FreeDirection free_direction(const maps::Map& a, const maps::Map& b, const geometry::Rigid3& a_from_b,
                             const std::vector<VerifiedPair>& agreeing) {
  std::set<core::KeyframeId> keyframes;
  for (const VerifiedPair& pair : agreeing) keyframes.insert({pair.query, pair.match});

  // The scatter of the normals shows which directions surfaces constrain: the eigenvector of its
  // least eigenvalue is the freest one.
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  double count = 0.0;

  for (const core::KeyframeId id : keyframes) {
    const Eigen::Matrix3d a_from_camera = a.has_keyframe(id)
                                              ? a.camera_from_world(id).inverse().rotation
                                              : (a_from_b * b.camera_from_world(id).inverse()).rotation;

    for (const maps::SurfaceSample& sample : (a.has_keyframe(id) ? a : b).keyframe(id).surface) {
      const Eigen::Vector3d normal = a_from_camera * sample.normal.cast<double>();
      scatter += normal * normal.transpose();
      count += 1.0;
    }
  }

  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter / std::max(1.0, count));
  FreeDirection free{axes.eigenvalues()[0], axes.eigenvalues()[1], 0.0};

  // The reach is measured along the free direction of a corridor, or within the plane of a lone wall,
  // where two directions are free.
  const auto extent = [&](int axis) {
    const Eigen::Vector3d direction = axes.eigenvectors().col(axis);
    return std::min(extent_along(a, direction), extent_along(b, a_from_b.rotation.transpose() * direction));
  };
  free.reach_m = free.corridor() ? extent(0) : std::hypot(extent(0), extent(1));
  return free;
}

}  // namespace plumbline::mapping
