// SPDX-License-Identifier: BSD-3-Clause
#include "observable_directions.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace plumbline::tracking {

using geometry::Rigid3;
using geometry::Vector6d;

namespace {

constexpr double kWeak = 2500.0;  // information of a standard deviation of 2 cm
constexpr double kLikely = 4e4;   // of 5 mm
constexpr double kAlone = 1e7;    // of 0.3 mm
// Squared, in a direction that they hold; they are good to 3 degrees.
constexpr double kShareOfNormals = 0.004;
const Vector6d kDirectionScale = (Vector6d() << 1.0, 1.0, 1.0, 0.5, 0.5, 0.5).finished();

}  // namespace

Directions weigh_directions(const geometry::Matrix6d& information) {
  const geometry::Matrix6d h = kDirectionScale.asDiagonal() * information * kDirectionScale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<geometry::Matrix6d> eigen(h);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

double weak_below(const geometry::Matrix6d& information, bool surface_alone) {
  return surface_alone ? std::max(kWeak, kShareOfNormals * information.topLeftCorner<3, 3>().trace()) : kWeak;
}

geometry::Matrix6d weak_projection(const Directions& directions, double below) {
  geometry::Matrix6d part = geometry::Matrix6d::Zero();
  for (int i = 0; i < 6 && directions.eigenvalues(i) < below; ++i) {
    part += directions.eigenvectors.col(i) * directions.eigenvectors.col(i).transpose();
  }
  return kDirectionScale.asDiagonal() * part * kDirectionScale.cwiseInverse().asDiagonal();
}

std::optional<optimize::PosePrior> motion_prior(const geometry::Matrix6d& information,
                                                const Rigid3& predicted, Motion motion) {
  const Directions directions = weigh_directions(information);
  const double limit =
      motion == Motion::kLikely ? kLikely : weak_below(information, motion == Motion::kAlone);
  if (directions.eigenvalues(0) >= limit) return std::nullopt;
  const double worth = motion == Motion::kAlone ? kAlone : motion == Motion::kLikely ? kLikely : kWeak;
  geometry::Matrix6d weak = geometry::Matrix6d::Zero();
  for (int i = 0; i < 6 && directions.eigenvalues(i) < limit; ++i) {
    weak += worth * directions.eigenvectors.col(i) * directions.eigenvectors.col(i).transpose();
  }
  const Vector6d inverse = kDirectionScale.cwiseInverse();
  return optimize::PosePrior{predicted, inverse.asDiagonal() * weak * inverse.asDiagonal()};
}

}  // namespace plumbline::tracking
