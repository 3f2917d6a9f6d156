// SPDX-License-Identifier: BSD-3-Clause
#include "merging/map_fusion_sets.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::mapping {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

std::vector<PlacePair> PairSets::places_of(std::size_t set) const {
  std::vector<PlacePair> result;
  for (const std::size_t i : sets[set].members) result.push_back(places[i]);
  return result;
}

PairSets accepted_pairs(const PartPair& maps, const std::vector<VerifiedPair>& pairs) {
  PairSets result;
  for (const VerifiedPair& pair : pairs) {
    if (!pair.evidence.accepted) continue;
    result.pairs.push_back(pair);
    if (maps.map_a().has_keyframe(pair.query) && maps.map_b().has_keyframe(pair.match)) {
      result.places.push_back({pair.query, pair.match, pair.evidence.query_from_match.inverse()});
    } else {
      result.places.push_back({pair.match, pair.query, pair.evidence.query_from_match});
    }
  }
  return result;
}

PairSets pair_sets(const PartPair& maps, const std::vector<VerifiedPair>& pairs) {
  PairSets result = accepted_pairs(maps, pairs);
  result.sets = consistent_sets(maps.map_a(), maps.map_b(), result.places, maps.options.consistency);
  return result;
}

Rigid3 worlds(const maps::Map& a, const maps::Map& b, const PlacePair& pair) {
  return a.camera_from_world(pair.a).inverse() * pair.b_from_a.inverse() * b.camera_from_world(pair.b);
}

Alignment mean_alignment(const PartPair& maps, const std::vector<PlacePair>& pairs) {
  constexpr int kRounds = 20;
  constexpr double kHuber_m = 0.03;
  constexpr double kArm_m = 1.0;      // distance at which a rotation counts as the motion it causes
  constexpr double kFloor_m = 0.002;  // pairs of one place have errors in common
  constexpr double kFloor_rad = 0.001;

  Alignment mean;
  if (pairs.empty()) return mean;

  const maps::Map& a = maps.map_a();
  const maps::Map& b = maps.map_b();
  const auto n = static_cast<double>(pairs.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const PlacePair& pair : pairs) middle += b.camera_from_world(pair.b).inverse().translation / n;

  // Errors are compared at the middle of the cameras: about a distant origin a small rotation
  // would look like a large shift.
  const Rigid3 b_from_middle(Eigen::Matrix3d::Identity(), middle);
  Rigid3 estimate = worlds(a, b, pairs.front()) * b_from_middle;
  std::vector<Vector6d> errors(pairs.size());
  for (int round = 0; round < kRounds; ++round) {
    Vector6d step = Vector6d::Zero();
    double weights = 0.0;

    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Rigid3 measured = worlds(a, b, pairs[i]) * b_from_middle;
      errors[i] << measured.translation - estimate.translation,
          geometry::log_so3(measured.rotation * estimate.rotation.transpose());

      // Huber weights: a pair that is far off pulls no harder than one at the threshold.
      Vector6d scaled = errors[i];
      scaled.tail<3>() *= kArm_m;
      const double weight = std::min(1.0, kHuber_m / std::max(1e-9, scaled.norm()));
      step += weight * errors[i];
      weights += weight;
    }

    step /= weights;
    estimate.rotation = geometry::exp_so3(step.tail<3>()) * estimate.rotation;
    estimate.translation += step.head<3>();
  }

  Matrix6d scatter = Matrix6d::Zero();
  double spread2 = 0.0;
  for (const Vector6d& error : errors) scatter += error * error.transpose();
  for (const Vector6d& error : errors) spread2 += error.head<3>().squaredNorm();

  mean.covariance = scatter / (n * std::max(1.0, n - 1.0));
  mean.covariance.diagonal().head<3>().array() += kFloor_m * kFloor_m;
  mean.covariance.diagonal().tail<3>().array() += kFloor_rad * kFloor_rad;
  mean.spread_m = std::sqrt(spread2 / n);
  mean.a_from_b = estimate * b_from_middle.inverse();
  return mean;
}

}  // namespace plumbline::mapping
