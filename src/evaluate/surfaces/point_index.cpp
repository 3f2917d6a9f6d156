// SPDX-License-Identifier: BSD-3-Clause
#include "surfaces/point_index.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "plumbline/evaluate/statistics.hpp"

namespace plumbline::evaluate {
namespace {

constexpr std::size_t kChunk = 4096;

}  // namespace

PointIndex::PointIndex(const std::vector<Eigen::Vector3f>& points)
    : points_(points), data_{points}, tree_(3, data_) {}

Neighbor PointIndex::nearest(const Eigen::Vector3d& q) const {
  Neighbor best;
  tree_.knnSearch(q.data(), 1, &best.index, &best.squared_distance);
  return best;
}

void PointIndex::nearest(const Eigen::Vector3d& q, std::size_t k, std::vector<Neighbor>& found) const {
  std::vector<std::uint32_t> indices(k);
  std::vector<double> distances(k);
  found.resize(tree_.knnSearch(q.data(), k, indices.data(), distances.data()));
  for (std::size_t i = 0; i < found.size(); ++i) found[i] = {indices[i], distances[i]};
}

/// Normal of the best plane; zero if the neighbours are not flat or in a row.
Eigen::Vector3f flat_normal(const std::vector<Eigen::Vector3f>& points, const std::vector<Neighbor>& found) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Neighbor& n : found) mean += points[n.index].cast<double>();
  mean /= static_cast<double>(found.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Neighbor& n : found) {
    const Eigen::Vector3d d = points[n.index].cast<double>() - mean;
    scatter += d * d.transpose();
  }

  // Flat: the least spread is far below the second
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  const Eigen::Vector3d spread = solver.eigenvalues();
  if (!(spread(1) > 0.0) || spread(0) > 0.0625 * spread(1)) return Eigen::Vector3f::Zero();
  return solver.eigenvectors().col(0).cast<float>();
}

double Density::cell_m() const { return points_per_m2 > 0.0 ? 1.0 / std::sqrt(points_per_m2) : 0.0; }

Density density(const PointIndex& index, const core::Executor& executor) {
  constexpr std::size_t kNeighbors = 16;
  constexpr std::size_t kMost = 100000;
  constexpr double kPi = 3.14159265358979323846;
  if (index.size() < 2) return {};

  // A subset along the index's order
  const std::size_t stride = (index.size() + kMost - 1) / kMost;
  const std::size_t count = (index.size() + stride - 1) / stride;
  std::vector<double> nearest(count, 0.0);
  std::vector<double> sixteenth(count, 0.0);

  // Nearest distance and the distance to the sixteenth
  for_chunks(executor, count, kChunk, [&](std::size_t first, std::size_t last) {
    std::vector<Neighbor> found;
    for (std::size_t i = first; i < last; ++i) {
      index.nearest(index.points()[index.order()[i * stride]].cast<double>(), kNeighbors + 1, found);

      // Doubled points do not count as neighbours
      const auto other = std::find_if(found.begin(), found.end(),
                                      [](const Neighbor& n) { return n.squared_distance > 0.0; });
      if (other != found.end()) nearest[i] = std::sqrt(other->squared_distance);
      if (found.size() > kNeighbors) sixteenth[i] = found.back().squared_distance;
    }
  });

  // Medians resist holes and doubled points
  const auto median_of_positive = [](std::vector<double>& values) {
    values.erase(std::remove(values.begin(), values.end(), 0.0), values.end());
    return summarize(values).median;
  };
  const double squared = median_of_positive(sixteenth);
  return {median_of_positive(nearest),
          squared > 0.0 ? static_cast<double>(kNeighbors) / (kPi * squared) : 0.0};
}

/// Normals from twelve neighbours, zero where these are not flat.
std::vector<Eigen::Vector3f> estimate_normals(const PointIndex& index, const core::Executor& executor) {
  std::vector<Eigen::Vector3f> normals(index.size(), Eigen::Vector3f::Zero());
  for_chunks(executor, index.size(), kChunk, [&](std::size_t first, std::size_t last) {
    std::vector<Neighbor> found;
    for (std::size_t i = first; i < last; ++i) {
      const std::uint32_t self = index.order()[i];
      index.nearest(index.points()[self].cast<double>(), 12, found);
      if (found.size() >= 4) normals[self] = flat_normal(index.points(), found);
    }
  });
  return normals;
}

}  // namespace plumbline::evaluate
