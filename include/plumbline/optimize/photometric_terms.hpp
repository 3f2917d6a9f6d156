// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Direct alignment of one camera with what another one saw: grey values of thousands of surface samples
// (docs/method/least_squares.md; the paper has no such family). The derivative is
// taken in the other camera's image, where it does not change with the pose.
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::optimize {

/// A surface sample and its grey value in the reference camera's image. The derivative and the value are
/// adjacent in memory: sum_photometric() takes them as one row.
struct PhotometricTerm {
  /// Derivative of the expected grey value by xi = (rho, phi), camera_from_reference <- camera_from_reference
  /// Exp(xi).
  Eigen::Matrix<float, 6, 1> derivative = Eigen::Matrix<float, 6, 1>::Zero();
  float value = 0.0F;   ///< grey value that is expected, of the reference image
  float weight = 1.0F;  ///< standard deviation of the family over that of the term
  Eigen::Vector3f point = Eigen::Vector3f::Zero();  ///< reference camera, metres
};

struct PhotometricFamily {
  std::vector<PhotometricTerm> terms;
  cv::Mat image;           ///< CV_32FC1, of the camera whose pose is estimated
  sensor::Pinhole camera;  ///< that takes `image`
  geometry::Rigid3 reference_from_world;
  double gain = 1.0;   ///< grey value expected in `image` = gain x that of the reference image
  double sigma = 1.0;  ///< of a residual, grey values
};

/// e = weight (I(pi(T_cr p)) - gain v) / sigma, for each term; NaN where it is not in the image.
std::vector<float> photometric_residuals(const PhotometricFamily& family,
                                         const geometry::Rigid3& camera_from_world);

/// Contribution of a family to the normal equations of the left perturbation of camera_from_world.
struct PhotometricSums {
  geometry::Matrix6d h = geometry::Matrix6d::Zero();  ///< of w j^T j
  geometry::Vector6d g = geometry::Vector6d::Zero();  ///< of w j^T e
  double cost = 0.0;                                  ///< Huber; a term that is not in the image costs 1/2
};
PhotometricSums sum_photometric(const PhotometricFamily& family, const geometry::Rigid3& camera_from_world,
                                double loss);

/// Normalised correlation of expected and seen grey values, -1 to 1; 0 with fewer than `min_terms` in view.
double photometric_correlation(const PhotometricFamily& family, const geometry::Rigid3& camera_from_world,
                               int min_terms);

}  // namespace plumbline::optimize
