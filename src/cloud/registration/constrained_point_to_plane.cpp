// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/registration/constrained_point_to_plane.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "plumbline/core/numbers.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::cloud {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

struct Match {
  Eigen::Vector3d point;   ///< point of the source
  Eigen::Vector3d normal;  ///< mean of both
  double distance;         ///< off the target along it, standard deviations
  double inverse_sigma;
};

std::vector<Match> matches_of(const SurfaceCloud& source, const SurfaceCloud& target,
                              const pcl::Correspondences& correspondences) {
  std::vector<Match> matches;
  matches.reserve(correspondences.size());
  for (const pcl::Correspondence& c : correspondences) {
    const SurfacePoint& s = source[static_cast<std::size_t>(c.index_query)];
    const SurfacePoint& t = target[static_cast<std::size_t>(c.index_match)];
    const Eigen::Vector3d point = s.getVector3fMap().cast<double>();

    // The mean of both normals, the noise of both points
    const Eigen::Vector3d normal =
        (s.getNormalVector3fMap() + t.getNormalVector3fMap()).cast<double>().normalized();
    const double inverse_sigma =
        1.0 / std::hypot(static_cast<double>(s.curvature), static_cast<double>(t.curvature));
    const double distance = normal.dot(point - t.getVector3fMap().cast<double>());
    matches.push_back({point, normal, distance * inverse_sigma, inverse_sigma});
  }
  return matches;
}

Eigen::Vector3d middle_of(const std::vector<Match>& matches) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Match& m : matches) sum += m.point;
  return sum / static_cast<double>(matches.size());
}

/// Root of the mean squared distance from the middle.
double spread_of(const std::vector<Match>& matches, const Eigen::Vector3d& middle) {
  double sum = 0.0;
  for (const Match& m : matches) sum += (m.point - middle).squaredNorm();
  return std::sqrt(sum / static_cast<double>(matches.size()));
}

/// Scale of the residuals of most matches; at least their noise.
double scale_of(const std::vector<Match>& matches) {
  std::vector<double> errors;
  for (const Match& m : matches) errors.push_back(std::abs(m.distance));
  return std::max(1.0, 1.4826 * core::median(std::move(errors)));
}

double huber(double ratio) {
  constexpr double kHuber = 1.345;
  return ratio <= kHuber ? 1.0 : kHuber / ratio;
}
double tukey(double ratio) {
  constexpr double kTukey = 4.685;
  const double rest = 1.0 - ratio * ratio / (kTukey * kTukey);
  return rest > 0.0 ? rest * rest : 0.0;
}

pcl::Correspondences in_order(std::size_t count) {
  pcl::Correspondences pairs;
  for (std::size_t i = 0; i < count; ++i) pairs.emplace_back(static_cast<int>(i), static_cast<int>(i), 0.0F);
  return pairs;
}

}  // namespace

PlaneStep ConstrainedPointToPlane::step(const SurfaceCloud& source, const SurfaceCloud& target,
                                        const pcl::Correspondences& correspondences) const {
  PlaneStep found;
  const std::vector<Match> matches = matches_of(source, target, correspondences);
  if (matches.empty()) return found;

  // Rotations about the centre, comparable with translations
  found.centre = middle_of(matches);
  found.lever = std::max(0.1, spread_of(matches, found.centre));
  const double scale = scale_of(matches);
  Matrix6d h = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();

  // Normal equations with a robust loss
  double weights = 0.0, squares = 0.0;
  for (const Match& m : matches) {
    const double ratio = std::abs(m.distance) / scale;
    const double loss = narrow_ ? tukey(ratio) : huber(ratio);
    if (loss <= 0.0) continue;

    Vector6d jacobian;  // of the distance in metres
    jacobian << m.normal, ((m.point - found.centre) / found.lever).cross(m.normal);
    const double weight = loss * m.inverse_sigma * m.inverse_sigma;
    h += weight * jacobian * jacobian.transpose();
    g += weight * (m.distance / m.inverse_sigma) * jacobian;
    weights += weight;
    squares += m.distance * m.distance;
    ++found.inliers;
  }

  // Principal directions of the information
  found.rms = found.inliers > 0 ? std::sqrt(squares / found.inliers) : 0.0;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(h);
  found.eigenvalues = eigen.eigenvalues();
  found.directions = eigen.eigenvectors();

  // No step along directions that are not observable
  Vector6d step = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    found.held[static_cast<std::size_t>(i)] = found.eigenvalues(i) > min_information_ * weights;
    if (!found.held[static_cast<std::size_t>(i)]) continue;
    step -= found.directions.col(i) * (found.directions.col(i).dot(g) / found.eigenvalues(i));
  }

  // From the centre and the lever to the frame
  step.tail<3>() /= found.lever;
  step.head<3>() -= step.tail<3>().cross(found.centre);
  found.transformation = geometry::exp_se3(step).isometry().matrix();
  return found;
}

void ConstrainedPointToPlane::estimateRigidTransformation(const SurfaceCloud& source,
                                                          const SurfaceCloud& target,
                                                          Matrix4& transformation) const {
  transformation = step(source, target, in_order(std::min(source.size(), target.size()))).transformation;
}

void ConstrainedPointToPlane::estimateRigidTransformation(const SurfaceCloud& source,
                                                          const pcl::Indices& of_source,
                                                          const SurfaceCloud& target,
                                                          Matrix4& transformation) const {
  estimateRigidTransformation(SurfaceCloud(source, of_source), target, transformation);
}

void ConstrainedPointToPlane::estimateRigidTransformation(const SurfaceCloud& source,
                                                          const pcl::Indices& of_source,
                                                          const SurfaceCloud& target,
                                                          const pcl::Indices& of_target,
                                                          Matrix4& transformation) const {
  estimateRigidTransformation(source, of_source, SurfaceCloud(target, of_target), transformation);
}

void ConstrainedPointToPlane::estimateRigidTransformation(const SurfaceCloud& source,
                                                          const SurfaceCloud& target,
                                                          const pcl::Correspondences& correspondences,
                                                          Matrix4& transformation) const {
  transformation = step(source, target, correspondences).transformation;
}

}  // namespace plumbline::cloud
