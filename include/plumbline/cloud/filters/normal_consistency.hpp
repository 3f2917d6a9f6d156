// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Points whose normal disagrees with those around it: where depth is noisy, at borders and on shiny things,
// normals point anywhere.
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "plumbline/cloud/filters/choosing_filter.hpp"
#include "plumbline/core/executor.hpp"

namespace plumbline::cloud {

/// Keeps a point if enough of its nearest neighbours (pcl::search::KdTree, over the points with normals) have
/// a normal within an angle of its own. `PointT` has unit normals; points without one (NaN) never agree.
/// Neighbours are searched among all points, with or without indices.
template <typename PointT>
class NormalConsistency : public ChoosingFilter<PointT> {
 public:
  explicit NormalConsistency(bool extract_removed_indices = false)
      : ChoosingFilter<PointT>(extract_removed_indices) {
    this->filter_name_ = "NormalConsistency";
  }

  /// Number of nearest neighbours to compare, >= 1.
  void setNeighbours(int neighbours) { neighbours_ = neighbours; }
  /// Largest angle between normals that agree, radians in [0, pi].
  void setMaxAngle(double max_angle_rad) { max_angle_rad_ = max_angle_rad; }
  /// Share of the neighbours that must agree, 0 to 1; more than 1/2 removes edges.
  void setMinShare(double min_share) { min_share_ = min_share; }
  /// Sets the executor whose threads are used; null (the default): one thread. The result does not depend on
  /// it.
  void setExecutor(const core::Executor* executor) { executor_ = executor; }

 protected:
  using ChoosingFilter<PointT>::applyFilter;

  void applyFilter(pcl::Indices& indices) override {
    // Only points with normals are neighbours
    const auto known = std::make_shared<pcl::Indices>();
    for (std::size_t i = 0; i < this->input_->size(); ++i) {
      if (has_normal(i)) known->push_back(static_cast<pcl::index_t>(i));
    }
    std::vector<std::uint8_t> agrees(this->input_->size(), 0);
    if (known->size() > 1) {  // FLANN has no tree of nothing
      pcl::search::KdTree<PointT> tree;
      tree.setInputCloud(this->input_, known);
      for_each(this->indices_->size(), [&](std::size_t k) {
        const auto i = static_cast<std::size_t>((*this->indices_)[k]);
        if (has_normal(i)) agrees[i] = consistent(tree, i) ? 1 : 0;
      });
    }
    this->choose(indices, [&](std::size_t i) { return agrees[i] != 0; });
  }

 private:
  [[nodiscard]] bool has_normal(std::size_t i) const {
    return pcl::isXYZFinite((*this->input_)[i]) && pcl::isNormalFinite((*this->input_)[i]);
  }

  template <typename Body>
  void for_each(std::size_t count, const Body& body) const {
    constexpr std::size_t kPiece = 256;  // points that one thread takes at a time
    const auto piece = [&](std::size_t p) {
      for (std::size_t k = p * kPiece; k < std::min(count, (p + 1) * kPiece); ++k) body(k);
    };

    // Several points per task, since a point is little work
    const std::size_t pieces = (count + kPiece - 1) / kPiece;
    if (executor_ != nullptr && pieces > 1) {
      executor_->parallel_for(pieces, piece);
    } else {
      for (std::size_t p = 0; p < pieces; ++p) piece(p);
    }
  }

  [[nodiscard]] bool consistent(const pcl::search::KdTree<PointT>& tree, std::size_t i) const {
    const pcl::PointCloud<PointT>& cloud = *this->input_;
    thread_local pcl::Indices near;
    thread_local std::vector<float> squared;
    tree.nearestKSearch(cloud[i], neighbours_ + 1, near, squared);  // the point itself is among them
    const auto least = static_cast<float>(std::cos(max_angle_rad_));
    int agree = 0;
    int others = 0;

    // Neighbours that face the same way
    for (const pcl::index_t index : near) {
      const auto j = static_cast<std::size_t>(index);
      if (j == i) continue;
      ++others;
      agree += cloud[i].getNormalVector3fMap().dot(cloud[j].getNormalVector3fMap()) >= least ? 1 : 0;
    }
    return others > 0 && agree >= min_share_ * others;
  }

  int neighbours_ = 16;
  double max_angle_rad_ = 0.5236;
  double min_share_ = 0.3;
  const core::Executor* executor_ = nullptr;
};

}  // namespace plumbline::cloud
