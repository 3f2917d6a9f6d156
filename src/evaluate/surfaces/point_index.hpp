// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Exact nearest neighbours among points.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <nanoflann.hpp>
#include <vector>

#include "plumbline/core/executor.hpp"

namespace plumbline::evaluate {

struct Neighbor {
  std::uint32_t index = 0;
  double squared_distance = 0.0;
};

/// `points` must outlive the index, be finite and not empty.
class PointIndex {
 public:
  explicit PointIndex(const std::vector<Eigen::Vector3f>& points);

  /// Among equally near points always returns the same one.
  [[nodiscard]] Neighbor nearest(const Eigen::Vector3d& q) const;

  /// The k nearest, nearest first (fewer if there are fewer points). `found` is reused storage.
  void nearest(const Eigen::Vector3d& q, std::size_t k, std::vector<Neighbor>& found) const;

  [[nodiscard]] std::size_t size() const { return points_.size(); }
  [[nodiscard]] const std::vector<Eigen::Vector3f>& points() const { return points_; }
  /// All numbers in an order in space.
  [[nodiscard]] const std::vector<std::uint32_t>& order() const { return tree_.vAcc; }

 private:
  /// Interface that nanoflann requires of a data set.
  struct Dataset {
    const std::vector<Eigen::Vector3f>& points;
    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
    [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
      return static_cast<double>(points[i](static_cast<Eigen::Index>(axis)));
    }
    template <typename Box>
    bool kdtree_get_bbox(Box& /*box*/) const {
      return false;
    }
  };
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Dataset>, Dataset, 3,
                                                   std::uint32_t>;
  const std::vector<Eigen::Vector3f>& points_;
  Dataset data_;
  Tree tree_;
};

/// Calls body(first, last) for fixed chunks of [0, count), the same whatever the number of threads.
template <typename Body>
void for_chunks(const core::Executor& executor, std::size_t count, std::size_t chunk, const Body& body) {
  executor.parallel_for((count + chunk - 1) / chunk,
                        [&](std::size_t c) { body(c * chunk, std::min(count, (c + 1) * chunk)); });
}

/// Sampling density of a surface.
struct Density {
  double spacing_m = 0.0;      ///< median distance to the nearest other place
  double points_per_m2 = 0.0;  ///< median of 16 / (pi r16^2), r16 the distance to the 16th neighbour
  /// Edge of the square that one sample stands for, 1 / sqrt(points_per_m2).
  [[nodiscard]] double cell_m() const;
};
/// From up to 100 000 points spread over all. Zeros when all are at one place; points_per_m2 is 0 for fewer
/// than 17 points, too.
Density density(const PointIndex& index, const core::Executor& executor);

/// Normal of the points `found` by principal components, up to sign; zero unless they are flat: their spread
/// along the normal below a quarter of that across.
Eigen::Vector3f flat_normal(const std::vector<Eigen::Vector3f>& points, const std::vector<Neighbor>& found);

/// Normals by principal components of the 12 nearest points; zero where these are not flat. Up to sign.
std::vector<Eigen::Vector3f> estimate_normals(const PointIndex& index, const core::Executor& executor);

}  // namespace plumbline::evaluate
