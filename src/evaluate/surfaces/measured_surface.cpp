// SPDX-License-Identifier: BSD-3-Clause
#include "surfaces/measured_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace plumbline::evaluate {

Foot MeshSurface::foot(const Eigen::Vector3d& q) const {
  const MeshPoint nearest = index_.nearest(q);
  return {std::sqrt(nearest.squared_distance), nearest.point, index_.normal(nearest.triangle)};
}

/// True if the neighbours do not leave half of the plane free.
bool SampledSurface::surrounded(const Eigen::Vector3d& on_plane, const Eigen::Vector3d& normal) const {
  // Neighbours of the foot
  constexpr double kPi = 3.14159265358979323846;
  constexpr std::size_t kNeighbors = 12;
  std::vector<Neighbor> found;
  index_.nearest(on_plane, kNeighbors, found);

  // Directions to the neighbours, in the plane
  const Eigen::Vector3d u = normal.unitOrthogonal();
  const Eigen::Vector3d v = normal.cross(u);
  std::array<double, kNeighbors> angles{};
  std::size_t count = 0;
  for (const Neighbor& n : found) {
    const Eigen::Vector3d d = index_.points()[n.index].cast<double>() - on_plane;
    if (std::abs(normal.dot(d)) <= cell_m_) angles[count++] = std::atan2(v.dot(d), u.dot(d));
  }
  if (count < 2) return false;

  // At a border the largest gap exceeds 180 degrees
  std::sort(angles.begin(), angles.begin() + static_cast<std::ptrdiff_t>(count));
  double gap = angles[0] + 2.0 * kPi - angles[count - 1];
  for (std::size_t i = 0; i + 1 < count; ++i) gap = std::max(gap, angles[i + 1] - angles[i]);
  return gap <= kPi + 1e-6;
}

/// The nearest point of the surface; beyond a border, the nearest sample.
Foot SampledSurface::foot(const Eigen::Vector3d& q) const {
  const Neighbor nearest = index_.nearest(q);
  const Eigen::Vector3d p = index_.points()[nearest.index].cast<double>();
  const Eigen::Vector3d normal = normals_[nearest.index].cast<double>();
  const Foot at_sample{std::sqrt(nearest.squared_distance), p, normal};
  if (mode_ == SampleDistance::kPoint || normal.isZero()) return at_sample;

  // The plane counts only where samples surround the foot
  const double height = normal.dot(q - p);
  const Eigen::Vector3d on_plane = q - height * normal;
  const double lateral_sq = (on_plane - p).squaredNorm();
  if (lateral_sq > 4.0 * cell_m_ * cell_m_) return at_sample;
  if (lateral_sq > 0.25 * cell_m_ * cell_m_ && !surrounded(on_plane, normal)) return at_sample;
  return {std::abs(height), on_plane, normal};
}

}  // namespace plumbline::evaluate
