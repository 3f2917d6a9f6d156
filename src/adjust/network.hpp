// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "map_covariance.hpp"
#include "plumbline/adjust/collocation.hpp"
#include "plumbline/adjust/control.hpp"
#include "plumbline/adjust/place_views.hpp"
#include "plumbline/maps/map.hpp"
#include "similarity.hpp"

namespace plumbline::adjust {

/// Observations of a map that a similarity moves: what they say of another one, and of the map's bend.
class Network {
 public:
  Network(const std::vector<Control>& control, const std::vector<PlaceViews>& p,
          const std::vector<PlaceViews>& q, const maps::Map& map, const geometry::Rigid3& output_from_map);

  /// Present place of `p` or `q`.
  [[nodiscard]] Eigen::Vector3d place(const PlaceViews& place_views) const;
  void move(const Similarity& step);
  /// Observed less computed, of observation `i`; points by `targets` (frame of results).
  [[nodiscard]] Eigen::VectorXd residual(std::size_t i, const std::vector<Eigen::Vector3d>& targets) const;

  struct Solved {
    std::vector<std::size_t> used;
    CollocationSolution solution;
    Eigen::MatrixXd signal;  ///< covariance of keyframes' motions with the rows
    Similarity step;         ///< of the solution
    double scale_sigma = 0.0;
  };
  /// Solution of those observations that are not left out.
  [[nodiscard]] Solved solve(const std::vector<bool>& left_out, const std::vector<Eigen::Vector3d>& targets,
                             const MapCovariance& covariance) const;

 private:
  void differentiate(const PlaceViews& place_views, const Eigen::MatrixXd& rows,
                     const MapCovariance& covariance, Eigen::Ref<Eigen::MatrixXd> signal,
                     Eigen::Ref<Eigen::MatrixXd> similarity) const;

  const std::vector<Control>& control_;
  std::vector<PlaceViews> p_, q_;
  std::map<core::KeyframeId, geometry::Rigid3> output_from_camera_;
};

}  // namespace plumbline::adjust
