// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nanoflann.hpp>
#include <vector>

namespace plumbline::changes {

/// Neighbours among points, which must outlive this and be finite.
class PointSearch {
 public:
  explicit PointSearch(const std::vector<Eigen::Vector3f>& points)
      : data_{points}, tree_(3, data_, nanoflann::KDTreeSingleIndexAdaptorParams(16)) {}

  using Found = std::vector<std::pair<std::uint32_t, float>>;  ///< index, squared distance
  /// All within a radius, in no order; `found` is reused storage.
  void within(const Eigen::Vector3f& at, double radius_m, Found& found) const {
    found.clear();
    if (!data_.points.empty())
      tree_.radiusSearch(at.data(), static_cast<float>(radius_m * radius_m), found,
                         nanoflann::SearchParams(32, 0.0F, false));
  }
  /// The nearest `count`, nearest first.
  void nearest(const Eigen::Vector3f& at, std::size_t count, Found& found) const {
    std::vector<std::uint32_t> index(count);
    std::vector<float> squared(count);
    const std::size_t n =
        data_.points.empty() ? 0 : tree_.knnSearch(at.data(), count, index.data(), squared.data());
    found.clear();
    for (std::size_t i = 0; i < n; ++i) found.emplace_back(index[i], squared[i]);
  }
  [[nodiscard]] const std::vector<Eigen::Vector3f>& points() const { return data_.points; }

 private:
  struct Data {
    const std::vector<Eigen::Vector3f>& points;
    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
    [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
      return points[i](static_cast<Eigen::Index>(axis));
    }
    template <typename Box>
    bool kdtree_get_bbox(Box& /*box*/) const {
      return false;
    }
  };
  Data data_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Data>, Data, 3, std::uint32_t>
      tree_;
};

}  // namespace plumbline::changes
