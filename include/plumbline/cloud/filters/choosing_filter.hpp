// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Base of our filters that choose points. They are filters of PCL's kind, for any program that uses
// PCL: setInputCloud, setIndices, filter(indices), filter(cloud), setNegative, setKeepOrganized and
// getRemovedIndices do what they do with pcl::PassThrough. With setKeepOrganized(true) construct them with
// `true`, as PCL's.
#include <pcl/common/point_tests.h>
#include <pcl/filters/filter_indices.h>

#include <cstddef>

namespace plumbline::cloud {

/// `PointT` has coordinates; a point without measurement has NaN there and is removed, negative or not.
template <typename PointT>
class ChoosingFilter : public pcl::FilterIndices<PointT> {
 public:
  using pcl::FilterIndices<PointT>::filter;

 protected:
  explicit ChoosingFilter(bool extract_removed_indices)
      : pcl::FilterIndices<PointT>(extract_removed_indices) {}

  using pcl::FilterIndices<PointT>::applyFilter;

  /// Requested points, in their order, for which keep(index) holds.
  template <typename Keep>
  void choose(pcl::Indices& indices, const Keep& keep) {
    indices.clear();
    this->removed_indices_->clear();
    for (const pcl::index_t index : *this->indices_) {
      const auto i = static_cast<std::size_t>(index);
      if (pcl::isXYZFinite((*this->input_)[i]) && keep(i) != this->negative_) {
        indices.push_back(index);
      } else if (this->extract_removed_indices_) {
        this->removed_indices_->push_back(index);
      }
    }
  }
};

}  // namespace plumbline::cloud
