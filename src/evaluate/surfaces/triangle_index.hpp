// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Exact nearest point on a triangle mesh.
#include <Eigen/Core>
#include <cstdint>

#include "plumbline/evaluate/surface.hpp"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace plumbline::evaluate {

struct MeshPoint {
  std::uint32_t triangle = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double squared_distance = 0.0;
};

/// Nearest point of triangle a b c to q (Ericson, Real-Time Collision Detection, 5.1.5); degenerate ones
/// allowed.
Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& q, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// `mesh` must outlive the index, be finite, with at least one triangle and no vertex out of range.
class TriangleIndex {
 public:
  explicit TriangleIndex(const TriangleMesh& mesh);
  ~TriangleIndex();
  TriangleIndex(const TriangleIndex&) = delete;
  TriangleIndex& operator=(const TriangleIndex&) = delete;
  [[nodiscard]] MeshPoint nearest(const Eigen::Vector3d& q) const;
  /// Unit, by the right-hand rule; zero for a degenerate triangle.
  [[nodiscard]] Eigen::Vector3d normal(std::uint32_t triangle) const;

 private:
  [[nodiscard]] MeshPoint on(std::uint32_t triangle, const Eigen::Vector3d& q) const;
  const TriangleMesh& mesh_;
  RTCDeviceTy* device_;
  RTCSceneTy* scene_;  ///< Embree's boxes around triangles
};

}  // namespace plumbline::evaluate
