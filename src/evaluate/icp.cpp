// SPDX-License-Identifier: BSD-3-Clause
#include "icp.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace plumbline::evaluate {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

constexpr std::size_t kMostPoints = 20000;
constexpr int kMostIterations = 80;
constexpr double kLeastReach = 0.02;  // m
constexpr double kStill = 1e-7;       // m; a smaller step ends the search
// Eigenvalue of the mean normal equations below which a direction is not determined.
constexpr double kLeastStiffness = 1e-4;

struct Pair {
  Eigen::Vector3d point;  ///< point of the cloud, transformed
  Eigen::Vector3d normal;
  double residual = 0.0;  ///< normal . (point - foot)
  double distance = 0.0;
  std::size_t index = 0;
};

std::vector<Pair> find_pairs(const std::vector<Eigen::Vector3d>& cloud, const MeasuredSurface& surface,
                             const Rigid3& pose, double reach, const core::Executor& executor) {
  std::vector<Pair> all(cloud.size());
  for_chunks(executor, cloud.size(), 512, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const Eigen::Vector3d q = pose * cloud[i];
      const Foot foot = surface.foot(q);
      const double residual = foot.normal.dot(q - foot.point);
      all[i] = {q, foot.normal, residual, foot.distance, i};
      // Past a border the nearest point is not below the cloud's point: such a pair pulls the wrong way.
      const bool border = std::abs(residual) < 0.9 * foot.distance - 1e-9;
      if (foot.normal.isZero() || border || foot.distance > reach) all[i].distance = -1.0;
    }
  });
  all.erase(std::remove_if(all.begin(), all.end(), [](const Pair& p) { return p.distance < 0.0; }),
            all.end());
  return all;
}

void keep_nearest(std::vector<Pair>& pairs, double share) {
  const auto keep = static_cast<std::size_t>(std::ceil(share * static_cast<double>(pairs.size())));
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.index < b.index;
  });
  pairs.resize(std::min(keep, pairs.size()));
}

struct Step {
  Rigid3 motion;
  double length_m = 0.0;
  bool determined = false;
};

/// Gauss-Newton step about the pairs' centre, lengths in units of their radius so that all directions
/// compare.
Step solve(const std::vector<Pair>& pairs) {
  // Centred and scaled: rotation and translation compare
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Pair& p : pairs) center += p.point;
  center /= static_cast<double>(pairs.size());
  double radius = 0.0;
  for (const Pair& p : pairs) radius += (p.point - center).squaredNorm();
  radius = std::sqrt(radius / static_cast<double>(pairs.size()));
  if (!(radius > 0.0)) return {};

  // Point-to-plane residuals, linearised
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  for (const Pair& p : pairs) {
    Vector6d j;
    j << p.normal, ((p.point - center) / radius).cross(p.normal);
    hessian += j * j.transpose();
    gradient += j * p.residual;
  }

  // Eigenvalues show the directions that surfaces determine
  hessian /= static_cast<double>(pairs.size());
  gradient /= static_cast<double>(pairs.size());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(hessian);
  Vector6d x = Vector6d::Zero();
  Step step;
  step.determined = true;

  // Undetermined directions stay as they are
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (solver.eigenvalues()(k) < kLeastStiffness) {
      step.determined = false;
      continue;
    }
    const Vector6d direction = solver.eigenvectors().col(k);
    x -= direction * (direction.dot(gradient) / solver.eigenvalues()(k));
  }

  // Back to the frame of the points
  const Eigen::Matrix3d rotation = geometry::exp_so3(x.tail<3>() / radius);
  step.motion = Rigid3(rotation, center - rotation * center + x.head<3>());
  step.length_m = x.norm();
  return step;
}

double rms_residual(const std::vector<Pair>& pairs) {
  double sum = 0.0;
  for (const Pair& p : pairs) sum += p.residual * p.residual;
  return std::sqrt(sum / static_cast<double>(pairs.size()));
}

}  // namespace

IcpResult align_icp(const std::vector<Eigen::Vector3f>& cloud, const MeasuredSurface& surface,
                    const Rigid3& start, const IcpOptions& options, const core::Executor& executor) {
  // An even subset is enough for six unknowns
  const std::size_t stride = (cloud.size() + kMostPoints - 1) / kMostPoints;
  std::vector<Eigen::Vector3d> some;
  for (std::size_t i = 0; i < cloud.size(); i += stride) some.push_back(cloud[i].cast<double>());

  // The start counts if ICP cannot begin
  IcpResult result;
  result.reference_from_cloud = start;

  // Pairs, trimmed; then one Gauss-Newton step
  double reach = options.max_distance_m;
  for (; result.iterations < kMostIterations; ++result.iterations) {
    std::vector<Pair> pairs = find_pairs(some, surface, result.reference_from_cloud, reach, executor);
    result.overlap = static_cast<double>(pairs.size()) / static_cast<double>(some.size());
    if (pairs.size() < 6) return result;

    // The farthest pairs may have no partner
    keep_nearest(pairs, options.trim);
    result.rmse_m = rms_residual(pairs);
    const Step step = solve(pairs);
    result.reference_from_cloud = step.motion * result.reference_from_cloud;
    result.determined = step.determined;

    // The reach shrinks with the median distance
    const double tighter =
        std::clamp(4.0 * pairs[pairs.size() / 2].distance, std::min(kLeastReach, reach), reach);
    result.converged = step.length_m < kStill;
    if (result.converged && tighter > 0.99 * reach) return result;
    reach = tighter;
  }
  return result;
}

}  // namespace plumbline::evaluate
