// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A surface that distances are measured to, be it triangles or samples.
#include <Eigen/Core>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/evaluate/cloud.hpp"
#include "plumbline/evaluate/surface.hpp"
#include "surfaces/point_index.hpp"
#include "surfaces/triangle_index.hpp"

namespace plumbline::evaluate {

/// Foot of a query point on the surface.
struct Foot {
  double distance = 0.0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit normal of the surface there; zero = unknown
};

class MeasuredSurface {
 public:
  virtual ~MeasuredSurface() = default;
  [[nodiscard]] virtual Foot foot(const Eigen::Vector3d& q) const = 0;
};

class MeshSurface : public MeasuredSurface {
 public:
  explicit MeshSurface(const TriangleMesh& mesh) : index_(mesh) {}
  [[nodiscard]] Foot foot(const Eigen::Vector3d& q) const override;

 private:
  TriangleIndex index_;
};

/// SampleDistance::kSurface: the foot lies on the plane through the nearest sample if it is within half a
/// sampling distance of it, or within two and surrounded by samples (no gap of more than half a turn between
/// the directions to the 12 nearest ones near that plane). Elsewhere, at borders and holes, the foot is the
/// sample itself.
class SampledSurface : public MeasuredSurface {
 public:
  /// `index` must outlive this; `normals` one per point, zero = unknown.
  SampledSurface(const PointIndex& index, std::vector<Eigen::Vector3f> normals, double cell_m,
                 SampleDistance mode)
      : index_(index), normals_(std::move(normals)), cell_m_(cell_m), mode_(mode) {}
  [[nodiscard]] Foot foot(const Eigen::Vector3d& q) const override;

 private:
  [[nodiscard]] bool surrounded(const Eigen::Vector3d& on_plane, const Eigen::Vector3d& normal) const;
  const PointIndex& index_;
  std::vector<Eigen::Vector3f> normals_;
  double cell_m_;
  SampleDistance mode_;
};

}  // namespace plumbline::evaluate
