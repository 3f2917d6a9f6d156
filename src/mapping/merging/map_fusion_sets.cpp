// SPDX-License-Identifier: BSD-3-Clause
#include "merging/map_fusion_sets.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::mapping {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

SortedPairs sort_pairs(const maps::Map& a, const maps::Map& b, const std::vector<VerifiedPair>& pairs) {
  SortedPairs sorted;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const VerifiedPair& pair = pairs[i];
    if (!pair.evidence.accepted) continue;
    if (a.has_keyframe(pair.query) && b.has_keyframe(pair.match)) {
      sorted.places.push_back({pair.query, pair.match, pair.evidence.query_from_match.inverse()});
    } else {
      sorted.places.push_back({pair.match, pair.query, pair.evidence.query_from_match});
    }
    sorted.indices.push_back(i);
  }
  return sorted;
}

Rigid3 worlds(const maps::Map& a, const maps::Map& b, const PlacePair& pair) {
  return a.camera_from_world(pair.a).inverse() * pair.b_from_a.inverse() * b.camera_from_world(pair.b);
}

MeanTransform mean_transform(const maps::Map& a, const maps::Map& b, const std::vector<PlacePair>& pairs) {
  constexpr int kRounds = 20;
  constexpr double kHuber_m = 0.03;
  constexpr double kArm_m = 1.0;      // radians count as what they move at this distance
  constexpr double kFloor_m = 0.002;  // pairs of one place share their errors
  constexpr double kFloor_rad = 0.001;
  MeanTransform mean;
  if (pairs.empty()) return mean;
  const auto n = static_cast<double>(pairs.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const PlacePair& pair : pairs) middle += b.camera_from_world(pair.b).inverse().translation / n;
  const Rigid3 b_from_middle(Eigen::Matrix3d::Identity(), middle);
  Rigid3 estimate = worlds(a, b, pairs.front()) * b_from_middle;
  std::vector<Vector6d> errors(pairs.size());
  for (int round = 0; round < kRounds; ++round) {
    Vector6d step = Vector6d::Zero();
    double weights = 0.0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Rigid3 said = worlds(a, b, pairs[i]) * b_from_middle;
      errors[i] << said.translation - estimate.translation,
          geometry::log_so3(said.rotation * estimate.rotation.transpose());
      Vector6d scaled = errors[i];
      scaled.tail<3>() *= kArm_m;
      const double weight = std::min(1.0, kHuber_m / std::max(1e-9, scaled.norm()));
      step += weight * errors[i];
      weights += weight;
    }
    step /= weights;
    estimate =
        Rigid3(geometry::exp_so3(step.tail<3>()) * estimate.rotation, estimate.translation + step.head<3>());
  }
  Matrix6d scatter = Matrix6d::Zero();
  double spread2 = 0.0;
  for (const Vector6d& error : errors) {
    scatter += error * error.transpose();
    spread2 += error.head<3>().squaredNorm();
  }
  mean.covariance = scatter / (n * std::max(1.0, n - 1.0));
  mean.covariance.diagonal().head<3>().array() += kFloor_m * kFloor_m;
  mean.covariance.diagonal().tail<3>().array() += kFloor_rad * kFloor_rad;
  mean.spread_m = std::sqrt(spread2 / n);
  mean.a_from_b = estimate * b_from_middle.inverse();
  return mean;
}

}  // namespace plumbline::mapping
