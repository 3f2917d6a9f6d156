// SPDX-License-Identifier: BSD-3-Clause
#include "map_covariance.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "plumbline/geometry/adjoint.hpp"
#include "plumbline/mapping/adjustment/global_adjustment.hpp"

namespace plumbline::adjust {
namespace {

using geometry::Matrix6d;
using Triplets = std::vector<Eigen::Triplet<double>>;

void add_block(Eigen::Index row, Eigen::Index column, const Matrix6d& block, Triplets& triplets) {
  for (Eigen::Index r = 0; r < 6; ++r) {
    for (Eigen::Index c = 0; c < 6; ++c) triplets.emplace_back(row + r, column + c, block(r, c));
  }
}

}  // namespace

struct MapCovariance::Factor {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt;
};

MapCovariance::~MapCovariance() = default;

MapCovariance::MapCovariance(const maps::Map& map, const maps::FusionState& state)
    : factor_(std::make_unique<Factor>()) {
  const std::vector<core::KeyframeId> ids = map.keyframe_ids();
  for (const core::KeyframeId id : ids) numbers_.emplace(id, static_cast<Eigen::Index>(numbers_.size()));

  // The first keyframe is held, and what no edge ties to it so weakly that nothing counts on it.
  constexpr double kHeld = 1e8;
  constexpr double kWeak = 1e-3;
  Triplets triplets;
  for (const core::KeyframeId id : ids)
    add_block(at(id), at(id), (id == ids.front() ? kHeld : kWeak) * Matrix6d::Identity(), triplets);
  std::vector<mapping::PoseEdge> edges = mapping::map_edges(map);

  for (const mapping::PoseEdge& loop : mapping::loop_edges(map)) edges.push_back(loop);
  for (const mapping::PoseEdge& edge : edges) {
    const Matrix6d carry =
        -geometry::adjoint(map.camera_from_world(edge.b) * map.camera_from_world(edge.a).inverse());
    const Matrix6d cross = edge.information * carry;
    add_block(at(edge.b), at(edge.b), edge.information, triplets);
    add_block(at(edge.b), at(edge.a), cross, triplets);
    add_block(at(edge.a), at(edge.b), cross.transpose(), triplets);
    add_block(at(edge.a), at(edge.a), carry.transpose() * cross, triplets);
  }

  Eigen::SparseMatrix<double> information(size(), size());
  information.setFromTriplets(triplets.begin(), triplets.end());
  factor_->ldlt.compute(information);

  // The graph's own scale is rough; the covariances of some keyframes tell the true one.
  constexpr std::size_t kProbes = 12;
  std::vector<double> ratios;
  for (std::size_t i = 1; i < ids.size(); i += std::max<std::size_t>(1, ids.size() / kProbes)) {
    const auto known = state.covariances.find({ids[i].robot, map.keyframe(ids[i]).stamp});
    if (known == state.covariances.end() || !known->second.allFinite()) continue;
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(size(), 3);
    unit.middleRows<3>(at(ids[i])).setIdentity();
    const double own = times(unit).middleRows<3>(at(ids[i])).trace();

    const double told = known->second.topLeftCorner<3, 3>().trace();
    if (told > 0.0 && own > 0.0) ratios.push_back(told / own);
  }
  if (ratios.empty()) return;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  scale_ = std::clamp(*middle, 0.01, 4.0);
}

Eigen::MatrixXd MapCovariance::times(const Eigen::MatrixXd& columns) const {
  return scale_ * factor_->ldlt.solve(columns);
}

}  // namespace plumbline::adjust
