// SPDX-License-Identifier: BSD-3-Clause
#include "observable_directions.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace plumbline::tracking {

using geometry::Rigid3;
using geometry::Vector6d;

namespace {

constexpr double kDegenerate = 2500.0;  // information of a standard deviation of 2 cm
constexpr double kLikely = 4e4;         // of 5 mm
constexpr double kSurfaceOnly = 1e7;    // of 0.3 mm
// Smallest squared share of the normals along a constrained direction; normals are exact to 3 degrees.
constexpr double kShareOfNormals = 0.004;
const Vector6d kDirectionScale = (Vector6d() << 1.0, 1.0, 1.0, 0.5, 0.5, 0.5).finished();

}  // namespace

PrincipalDirections principal_directions(const geometry::Matrix6d& information) {
  const geometry::Matrix6d h = kDirectionScale.asDiagonal() * information * kDirectionScale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<geometry::Matrix6d> eigen(h);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

double degenerate_below(const geometry::Matrix6d& information, bool surface_only) {
  return surface_only ? std::max(kDegenerate, kShareOfNormals * information.topLeftCorner<3, 3>().trace())
                      : kDegenerate;
}

geometry::Matrix6d projector_onto_degenerate(const PrincipalDirections& directions, double below) {
  geometry::Matrix6d part = geometry::Matrix6d::Zero();
  for (int i = 0; i < 6 && directions.eigenvalues(i) < below; ++i) {
    part += directions.eigenvectors.col(i) * directions.eigenvectors.col(i).transpose();
  }
  return kDirectionScale.asDiagonal() * part * kDirectionScale.cwiseInverse().asDiagonal();
}

std::optional<optimize::PosePrior> motion_prior(const geometry::Matrix6d& information,
                                                const Rigid3& predicted, MotionTrust trust) {
  const PrincipalDirections directions = principal_directions(information);
  const double limit = trust == MotionTrust::kLikely
                           ? kLikely
                           : degenerate_below(information, trust == MotionTrust::kSurfaceOnly);
  if (directions.eigenvalues(0) >= limit) return std::nullopt;
  const double worth = trust == MotionTrust::kSurfaceOnly ? kSurfaceOnly
                       : trust == MotionTrust::kLikely    ? kLikely
                                                          : kDegenerate;

  // The prior only constrains degenerate directions
  geometry::Matrix6d degenerate = geometry::Matrix6d::Zero();
  for (int i = 0; i < 6 && directions.eigenvalues(i) < limit; ++i) {
    degenerate += worth * directions.eigenvectors.col(i) * directions.eigenvectors.col(i).transpose();
  }
  const Vector6d inverse = kDirectionScale.cwiseInverse();
  return optimize::PosePrior{predicted, inverse.asDiagonal() * degenerate * inverse.asDiagonal()};
}

}  // namespace plumbline::tracking
