// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Point-to-plane steps for PCL's registration loop that make no step along directions that surfaces do not
// constrain: along a corridor, or within a wall's plane.
#include <pcl/registration/transformation_estimation.h>

#include <array>

#include "plumbline/cloud/registration/surface_cloud.hpp"

namespace plumbline::cloud {

/// One Gauss-Newton step over correspondences, and what they know. Rotations are taken about the middle of
/// the points and scaled by their spread, so that all six numbers are metres: (rho + phi x centre, lever phi)
/// of xi = (rho, phi).
struct PlaneStep {
  Eigen::Matrix4d transformation = Eigen::Matrix4d::Identity();  ///< transform of the source
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double lever = 1.0;
  /// Eigenvalues of the information, 1/m^2.
  Eigen::Matrix<double, 6, 1> eigenvalues = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 6> directions = Eigen::Matrix<double, 6, 6>::Identity();  ///< its eigenvectors
  std::array<bool, 6> held{};  ///< no step was made along the others
  int inliers = 0;
  double rms = 0.0;  ///< RMS of these, in standard deviations
};

/// For pcl::IterativeClosestPoint::setTransformationEstimation. Residuals lie along the mean of both normals,
/// weighted with both standard deviations (curvature), under a robust loss whose scale is the median
/// residual: Huber while the surfaces are apart (`narrow` false), so that the few points that show the offset
/// have weight, then Tukey.
class ConstrainedPointToPlane
    : public pcl::registration::TransformationEstimation<SurfacePoint, SurfacePoint, double> {
 public:
  /// A direction is held when its share of the normals, squared, is larger than `min_information`.
  explicit ConstrainedPointToPlane(double min_information) : min_information_(min_information) {}
  void setNarrow(bool narrow) { narrow_ = narrow; }

  /// The step from the source to the target, with its information.
  [[nodiscard]] PlaneStep step(const SurfaceCloud& source, const SurfaceCloud& target,
                               const pcl::Correspondences& correspondences) const;

  void estimateRigidTransformation(const SurfaceCloud& source, const SurfaceCloud& target,
                                   Matrix4& transformation) const override;
  void estimateRigidTransformation(const SurfaceCloud& source, const pcl::Indices& of_source,
                                   const SurfaceCloud& target, Matrix4& transformation) const override;
  void estimateRigidTransformation(const SurfaceCloud& source, const pcl::Indices& of_source,
                                   const SurfaceCloud& target, const pcl::Indices& of_target,
                                   Matrix4& transformation) const override;
  void estimateRigidTransformation(const SurfaceCloud& source, const SurfaceCloud& target,
                                   const pcl::Correspondences& correspondences,
                                   Matrix4& transformation) const override;

 private:
  double min_information_;
  bool narrow_ = false;
};

}  // namespace plumbline::cloud
