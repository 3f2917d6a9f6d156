// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Seeded numbers, poses and points for small worlds.
#include <random>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::tests {

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  double normal(double sigma = 1.0) { return std::normal_distribution<double>(0.0, sigma)(engine_); }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine_); }
  std::uint64_t bits() { return (static_cast<std::uint64_t>(engine_()) << 32) | engine_(); }
  Eigen::Vector3d vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  Eigen::Vector3d direction() { return Eigen::Vector3d(normal(), normal(), normal()).normalized(); }
  /// Any rotation up to `angle`, translation within `metres`.
  geometry::Rigid3 pose(double angle, double metres) {
    const Eigen::Vector3d phi = uniform(0.0, angle) * direction();
    return {geometry::exp_so3(phi), vector(metres)};
  }
  /// A step of exactly this size.
  geometry::Rigid3 step(double metres, double angle) {
    geometry::Vector6d xi;
    xi << metres * direction(), angle * direction();
    return geometry::exp_se3(xi);
  }

 private:
  std::mt19937 engine_;
};

inline double distance(const geometry::Rigid3& a, const geometry::Rigid3& b) {
  return (a.inverse().translation - b.inverse().translation).norm();
}
inline double angle(const geometry::Rigid3& a, const geometry::Rigid3& b) {
  return geometry::rotation_angle(a.rotation * b.rotation.transpose());
}

}  // namespace plumbline::tests
