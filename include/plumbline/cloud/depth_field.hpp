// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a depth camera gets wrong the same way every time. Structured light has errors that change smoothly
// over the image and grow with the square of the distance (Herrera, Kannala, Heikkila, PAMI 34, 2012):
// walls bend, and one wall seen at the middle and at the rim of two images comes out double. Views of a run
// that see the same surface at different places of their images tell how much (after Teichman, Miller,
// Thrun, RSS 2013).
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "plumbline/cloud/dense_fusion.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::cloud {

/// 1 / z = 1 / z_measured + beta(x, y) along the ray (x, y, 1), x = (u - cx) / fx: beta is a polynomial in x
/// and y of the degrees 2 to 4, in 1/m. Depth is right in the middle of the image: what a constant or a
/// slope would change are the scale of the map and the tilt of its walls, and of these the poses know more
/// than the clouds do. The default corrects nothing.
class DepthField {
 public:
  static constexpr int kTerms = 12;
  using Terms = Eigen::Matrix<double, kTerms, 1>;

  DepthField() = default;
  /// `coefficients` of x^a y^b by degree a + b, and within a degree from x^n to y^n.
  explicit DepthField(const Terms& coefficients) : coefficients_(coefficients) {}
  [[nodiscard]] bool identity() const { return coefficients_.isZero(0.0); }
  [[nodiscard]] const Terms& coefficients() const { return coefficients_; }
  /// The values of all monomials at (x, y).
  static Terms monomials(double x, double y);
  /// 1/m.
  [[nodiscard]] double beta(double x, double y) const { return coefficients_.dot(monomials(x, y)); }
  /// Moves points along their rays and turns their normals with the surface. Camera frame. A depth changes by
  /// half at most.
  void correct(Cloud& camera_cloud) const;

 private:
  /// One point and its normal.
  static void correct(const Eigen::Matrix<float, kTerms, 1>& c, Eigen::Vector3f& p, Eigen::Vector3f& normal);

  Terms coefficients_ = Terms::Zero();
};

struct DepthFieldOptions {
  int views = 80;            ///< that are compared at most, evenly over the run
  int partners = 6;          ///< others that each is compared with
  double least_gain = 0.08;  ///< share of the disagreement between views that must go
  void declare(core::OptionTable& table);
};

struct DepthFieldReport {
  std::size_t samples = 0;  ///< pairs of surface points that were compared
  /// Median disagreement of views in standard deviations of the depth noise, without and with a field that
  /// was found from other parts of the run.
  double before = 0.0;
  double after = 0.0;
  bool used = false;
  double most_at_2m = 0.0;  ///< largest change of a depth of 2 m along rays that were compared, metres
};

/// The field of the camera that took all `views`, from their disagreement at fixed poses. The run is cut into
/// parts; a field found from the others must take away `least_gain` of the disagreement with each part's
/// views, all in all; else the field corrects nothing, as it does where too little overlaps. `read`: as for
/// fuse_views; depth views are passed over. `views`: indices for `read` and `world_from_camera`, in the order
/// of time. The same for any number of threads. Errors are those of `read`. `report` may be null.
core::Result<DepthField> find_depth_field(const std::vector<std::size_t>& views,
                                          const std::vector<geometry::Rigid3>& world_from_camera,
                                          const ReadView& read, const sensor::Pinhole& camera,
                                          const DepthFieldOptions& options, const core::Executor& executor,
                                          DepthFieldReport* report = nullptr);

}  // namespace plumbline::cloud
