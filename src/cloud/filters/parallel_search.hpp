// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// PCL's kd-tree on all threads. PCL's filters ask for the neighbours of one point after another; this search
// answers the first question of a block for the whole block, on all threads, and the others from memory. The
// answers are those of PCL's tree, so that the filters' results are PCL's whatever the number of threads.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <functional>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/core/executor.hpp"

namespace plumbline::cloud {

class ParallelSearch : public pcl::search::KdTree<Point> {
 public:
  /// `executor` may be null: one thread. `sorted`: as in PCL's KdTree.
  ParallelSearch(const core::Executor* executor, bool sorted);

  using pcl::search::KdTree<Point>::nearestKSearch;

  /// Neighbours of the input's point `index`. One caller at a time.
  int nearestKSearch(pcl::index_t index, int k, pcl::Indices& indices,
                     std::vector<float>& squared_distances) const override;
  int nearestKSearch(const PointCloud& cloud, pcl::index_t index, int k, pcl::Indices& indices,
                     std::vector<float>& squared_distances) const override;

  /// body(i) for i in [0, count) on all threads, many at a time.
  void for_each(std::size_t count, const std::function<void(std::size_t)>& body) const;

 private:
  struct Block {
    std::size_t begin = 0;
    std::size_t end = 0;
    int k = 0;
    std::vector<int> found;             ///< how many, of every point
    std::vector<pcl::index_t> indices;  ///< k of every point
    std::vector<float> squared;         ///< k of every point
  };
  void fill(std::size_t begin, int k) const;

  const core::Executor* executor_;
  mutable Block block_;
};

}  // namespace plumbline::cloud
