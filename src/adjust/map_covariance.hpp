// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <vector>

#include "plumbline/maps/fusion_state.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::adjust {

/// Covariance of all keyframes' motions (left perturbations of camera_from_world), as the map's pose graph
/// and the covariances of its keyframes have it: how the map may bend.
class MapCovariance {
 public:
  MapCovariance(const maps::Map& map, const maps::FusionState& state);
  ~MapCovariance();
  MapCovariance(const MapCovariance&) = delete;
  MapCovariance& operator=(const MapCovariance&) = delete;

  [[nodiscard]] Eigen::Index size() const { return 6 * static_cast<Eigen::Index>(numbers_.size()); }
  /// First of the six unknowns of a keyframe.
  [[nodiscard]] Eigen::Index at(core::KeyframeId id) const { return 6 * numbers_.at(id); }
  /// The covariance times these columns.
  [[nodiscard]] Eigen::MatrixXd times(const Eigen::MatrixXd& columns) const;

 private:
  struct Factor;
  std::map<core::KeyframeId, Eigen::Index> numbers_;
  std::unique_ptr<Factor> factor_;
  double scale_ = 1.0;
};

}  // namespace plumbline::adjust
