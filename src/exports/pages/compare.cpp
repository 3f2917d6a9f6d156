// SPDX-License-Identifier: BSD-3-Clause
#include "pages/compare.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nanoflann.hpp>

namespace plumbline::exports {
namespace {

/// Points as nanoflann asks for them.
struct SearchedPoints {
  const viewer::Points* points = nullptr;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points->positions.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t k) const { return points->positions[i][k]; }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};
using PointTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, SearchedPoints>,
                                                      SearchedPoints, 3, std::uint32_t>;

/// Distance from each point to the nearest one of `others`, metres; NaN if there are none.
std::vector<float> distances(const viewer::Points& points, const viewer::Points& others,
                             const core::Executor& executor) {
  std::vector<float> out(points.positions.size(), std::nanf(""));
  if (others.positions.empty()) return out;
  const SearchedPoints searched{&others};
  const PointTree tree(3, searched, nanoflann::KDTreeSingleIndexAdaptorParams(16));

  // From one cloud's coordinates into the other's
  std::array<float, 3> shift{};
  for (std::size_t k = 0; k < 3; ++k) shift[k] = static_cast<float>(points.shift[k] - others.shift[k]);

  // Points are independent, so blocks run in parallel
  constexpr std::size_t kBlock = 4096;
  executor.parallel_for((out.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    const std::size_t last = std::min(out.size(), (block + 1) * kBlock);
    for (std::size_t i = block * kBlock; i < last; ++i) {
      const auto& [x, y, z] = points.positions[i];
      const std::array<float, 3> at{x + shift[0], y + shift[1], z + shift[2]};

      // The nearest point itself, not its surface
      std::uint32_t nearest = 0;
      float squared = 0.0F;
      tree.knnSearch(at.data(), 1, &nearest, &squared);
      out[i] = std::sqrt(squared);
    }
  });

  return out;
}

}  // namespace

/// Moves positions and turns normals; the shift stays.
void move(viewer::Points& points, const geometry::Rigid3& target_from_source) {
  const Eigen::Vector3d shift(points.shift[0], points.shift[1], points.shift[2]);
  for (auto& p : points.positions) {
    const Eigen::Vector3d moved = target_from_source * (shift + Eigen::Vector3d(p[0], p[1], p[2])) - shift;
    for (std::size_t k = 0; k < 3; ++k) p[k] = static_cast<float>(moved[static_cast<int>(k)]);
  }
  for (auto& n : points.normals) {
    const Eigen::Vector3d turned = target_from_source.rotation * Eigen::Vector3d(n[0], n[1], n[2]);
    for (std::size_t k = 0; k < 3; ++k) n[k] = static_cast<float>(turned[static_cast<int>(k)]);
  }
}

/// Adds to each cloud a layer with its distances to the other one.
void add_distances(viewer::Points& first, viewer::Points& second, const core::Executor& executor) {
  const auto layer = [](std::vector<float> values) {
    viewer::Layer made{"distance", "Distance to the other map", "m", viewer::Scale::kLogarithmic, 0.001, 0.2,
                       24};
    made.values = std::move(values);
    return made;
  };

  // Both are computed before a layer is added
  viewer::Layer of_first = layer(distances(first, second, executor));
  viewer::Layer of_second = layer(distances(second, first, executor));
  first.layers.push_back(std::move(of_first));
  second.layers.push_back(std::move(of_second));
}

}  // namespace plumbline::exports
