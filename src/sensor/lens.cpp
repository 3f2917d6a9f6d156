// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/sensor/lens.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace plumbline::sensor {
namespace {

/// The quotient of polynomials of r^2 in the radial-tangential model, and its derivative by r^2.
struct Radial {
  double numerator;
  double denominator;
  double numerator_by_r2;
  double denominator_by_r2;

  Radial(const Distortion& k, double r2)
      : numerator(1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))),
        denominator(1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]))),
        numerator_by_r2(k[0] + r2 * (2.0 * k[1] + 3.0 * r2 * k[4])),
        denominator_by_r2(k[5] + r2 * (2.0 * k[6] + 3.0 * r2 * k[7])) {}
  [[nodiscard]] double value() const { return numerator / denominator; }
  [[nodiscard]] double by_r2() const { return (numerator_by_r2 - value() * denominator_by_r2) / denominator; }
};

/// theta (1 + k1 theta^2 + ...) of the equidistant model, and its derivative by theta.
struct Bent {
  double value;
  double by_theta;

  Bent(const Distortion& k, double theta) {
    const double t2 = theta * theta;
    value = theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
    by_theta = 1.0 + t2 * (3.0 * k[0] + t2 * (5.0 * k[1] + t2 * (7.0 * k[2] + t2 * 9.0 * k[3])));
  }
};

constexpr double kAxis = 1e-8;  // rays nearer to the axis are not bent

/// Derivative of the distorted point by the ray.
Eigen::Matrix2d radial_tangential_jacobian(const Distortion& k, const Eigen::Vector2d& ray) {
  const double x = ray.x();
  const double y = ray.y();
  const Radial radial(k, ray.squaredNorm());
  const double value = radial.value();
  const double by_r2 = radial.by_r2();
  Eigen::Matrix2d j;
  j(0, 0) = value + 2.0 * x * x * by_r2 + 2.0 * k[2] * y + 6.0 * k[3] * x;
  j(0, 1) = 2.0 * x * y * by_r2 + 2.0 * k[2] * x + 2.0 * k[3] * y;
  j(1, 0) = 2.0 * x * y * by_r2 + 2.0 * k[2] * x + 2.0 * k[3] * y;
  j(1, 1) = value + 2.0 * y * y * by_r2 + 6.0 * k[2] * y + 2.0 * k[3] * x;
  return j;
}

/// Derivative of the equidistant projection; the identity on the axis.
Eigen::Matrix2d equidistant_jacobian(const Distortion& k, const Eigen::Vector2d& ray) {
  const double r = ray.norm();
  if (r < kAxis) return Eigen::Matrix2d::Identity();
  const Bent bent(k, std::atan(r));
  const double scale = bent.value / r;
  const double scale_by_r = (bent.by_theta / (1.0 + r * r) - scale) / r;
  return scale * Eigen::Matrix2d::Identity() + scale_by_r / r * ray * ray.transpose();
}

/// The ray of a distorted point, by Newton's method on the angle.
Eigen::Vector2d equidistant_inverse(const Distortion& k, const Eigen::Vector2d& distorted) {
  constexpr int kSteps = 20;
  constexpr double kSteepest = 1.55;  // rad off the axis: beyond, a pinhole image has no pixels
  const double wanted = distorted.norm();
  if (wanted < kAxis) return distorted;
  double theta = std::min(wanted, kSteepest);
  for (int i = 0; i < kSteps; ++i) {
    const Bent bent(k, theta);
    if (!(std::abs(bent.by_theta) > 1e-6)) break;
    const double step = (wanted - bent.value) / bent.by_theta;
    theta = std::clamp(theta + step, 0.0, kSteepest);
    if (std::abs(step) < 1e-13) break;
  }
  return distorted * (std::tan(theta) / wanted);
}

}  // namespace

bool Lens::distorts() const {
  return model == LensModel::kEquidistant ||
         std::any_of(k.begin(), k.end(), [](double c) { return c != 0.0; });
}

/// The ray's point on the image plane at depth 1, as the lens shows it.
Eigen::Vector2d Lens::distort(const Eigen::Vector2d& ray) const {
  if (model == LensModel::kEquidistant) {
    const double r = ray.norm();
    return r < kAxis ? ray : Eigen::Vector2d(ray * (Bent(k, std::atan(r)).value / r));
  }
  const double x = ray.x();
  const double y = ray.y();
  const double r2 = ray.squaredNorm();
  const double radial = Radial(k, r2).value();
  return {x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
          y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
}

Eigen::Matrix2d Lens::jacobian(const Eigen::Vector2d& ray) const {
  return model == LensModel::kEquidistant ? equidistant_jacobian(k, ray) : radial_tangential_jacobian(k, ray);
}

/// Derivative by k1 along the ray, and the ratio of k2's to it.
Lens::ByCoefficients Lens::by_coefficients(const Eigen::Vector2d& ray) const {
  if (model == LensModel::kRadialTangential) {
    const double r2 = ray.squaredNorm();
    return {r2 / Radial(k, r2).denominator, r2};
  }
  const double r = ray.norm();
  if (r < kAxis) return {};
  const double theta = std::atan(r);
  return {theta * theta * theta / r, theta * theta};
}

/// Newton's method from the distorted point.
Eigen::Vector2d Lens::undistort(const Eigen::Vector2d& distorted) const {
  if (model == LensModel::kEquidistant) return equidistant_inverse(k, distorted);
  constexpr int kSteps = 8;
  Eigen::Vector2d ray = distorted;
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Vector2d error = distorted - distort(ray);
    const Eigen::Vector2d step = jacobian(ray).inverse() * error;
    ray += step;
    if (step.squaredNorm() < 1e-20) break;
  }
  return ray;
}

std::optional<Eigen::Vector2d> Lens::ray_of(const Eigen::Vector2d& distorted) const {
  constexpr double kExact = 1e-6;
  constexpr double kFarthest = 20.0;  // 87 degrees off the axis
  const Eigen::Vector2d ray = undistort(distorted);
  const bool found = ray.allFinite() && ray.norm() < kFarthest && (distort(ray) - distorted).norm() < kExact;
  // Beyond the fold of a polynomial a second ray is projected to the same position: no lens is like that.
  if (!found || jacobian(ray).determinant() <= 0.0) return std::nullopt;
  return ray;
}

}  // namespace plumbline::sensor
