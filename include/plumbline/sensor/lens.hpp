// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Distortion of rays by a lens: the ray (x, y, 1) of a point comes out as (x', y', 1), and the pixel is (fx
// x' + cx, fy y' + cy). The models and the order of their coefficients are OpenCV's.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

namespace plumbline::sensor {

enum class LensModel : std::uint8_t {
  /// OpenCV's standard model, ROS' plumb_bob and rational_polynomial: with r^2 = x^2 + y^2
  /// x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2),
  /// y' likewise with p1 (r^2 + 2 y^2) + 2 p2 x y.
  kRadialTangential,
  /// OpenCV's fisheye, ROS' and Kalibr's equidistant, Kannala and Brandt: with theta = atan(r)
  /// (x', y') = (x, y) / r * theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
  kEquidistant,
};

/// k1 k2 p1 p2 k3 k4 k5 k6 of kRadialTangential; k1 k2 k3 k4 of kEquidistant, whose others are 0.
using Distortion = std::array<double, 8>;

struct Lens {
  LensModel model = LensModel::kRadialTangential;
  Distortion k{};

  /// True if the lens changes rays; an equidistant lens always does.
  [[nodiscard]] bool distorts() const;
  [[nodiscard]] Eigen::Vector2d distort(const Eigen::Vector2d& ray) const;
  /// Derivative of distort() with respect to the ray.
  [[nodiscard]] Eigen::Matrix2d jacobian(const Eigen::Vector2d& ray) const;
  /// distort() by k1 is `by_k1` times the ray, and by k2 `k2_by_k1` times that.
  struct ByCoefficients {
    double by_k1 = 0.0;
    double k2_by_k1 = 0.0;
  };
  [[nodiscard]] ByCoefficients by_coefficients(const Eigen::Vector2d& ray) const;
  /// The inverse of distort(), by Newton's method, exact to 1e-9 inside the image. Outside of where the model
  /// is invertible it is the last step.
  [[nodiscard]] Eigen::Vector2d undistort(const Eigen::Vector2d& distorted) const;
  /// undistort() if it is valid: none if no ray is distorted to that position, as beyond the rim of a lens.
  [[nodiscard]] std::optional<Eigen::Vector2d> ray_of(const Eigen::Vector2d& distorted) const;

  bool operator==(const Lens& other) const { return model == other.model && k == other.k; }
  bool operator!=(const Lens& other) const { return !(*this == other); }
};

}  // namespace plumbline::sensor
