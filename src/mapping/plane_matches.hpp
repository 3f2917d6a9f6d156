// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Point-to-plane matches of two surfaces, and the equations that they make.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::mapping {

/// How matches count: Huber while the surfaces are still apart, so that the few samples that show it are
/// heard; then Tukey. `scale` in standard deviations.
struct MatchLoss {
  double scale = 1.0;
  bool narrow = false;  ///< Tukey
};

/// Of one Gauss-Newton step; rotations about `centre`, times `lever`, so that all six numbers are metres.
struct MatchEquations {
  geometry::Matrix6d h = geometry::Matrix6d::Zero();
  geometry::Vector6d g = geometry::Vector6d::Zero();
  double weights = 0.0;
  double squares = 0.0;  ///< of the inliers' errors, in standard deviations
  int inliers = 0;
};

/// Pairs of samples that should lie on one plane. Four matches are summed up side by side, in a fixed order.
class PlaneMatches {
 public:
  void clear();
  /// `moved` lies `distance` off the plane along its normal; `variance` of that, square metres.
  void add(const Eigen::Vector3d& moved, const Eigen::Vector3d& normal, double distance, double variance);
  [[nodiscard]] std::size_t size() const { return size_; }

  [[nodiscard]] Eigen::Vector3d middle() const;
  /// Root of the mean squared distance from there.
  [[nodiscard]] double spread(const Eigen::Vector3d& middle) const;
  /// Of the absolute errors, in standard deviations.
  [[nodiscard]] double median_error() const;
  [[nodiscard]] MatchEquations equations(const Eigen::Vector3d& centre, double lever,
                                         const MatchLoss& loss) const;

 private:
  static constexpr std::size_t kLanes = 4;
  using Doubles = double __attribute__((vector_size(8 * kLanes)));
  using Longs = std::int64_t __attribute__((vector_size(8 * kLanes)));
  struct alignas(32) Four {  // as AVX wants it, which compilers that know nothing of it do not see to
    Doubles moved[3] = {};
    Doubles normal[3] = {};
    Doubles distance = {};
    Doubles inverse_variance = {};  ///< 0: no match
  };
  std::vector<Four> matches_;
  std::size_t size_ = 0;
};

}  // namespace plumbline::mapping
