// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/registration/surface_cloud.hpp"

#include <pcl/filters/voxel_grid.h>

#include <array>
#include <cmath>
#include <flann/flann.hpp>
#include <map>
#include <vector>

#include "plumbline/cloud/fusion/cell_map.hpp"

namespace plumbline::cloud {
namespace {

/// Direction that a surface faces, and the block of a point.
using Part = std::array<int, 4>;

Part part_of(const SurfacePoint& p, float block_m) {
  const auto block = [block_m](float x) { return static_cast<int>(std::floor(x / block_m)); };
  return {facing(p.getNormalVector3fMap()), block(p.x), block(p.y), block(p.z)};
}

/// Appends the filtered points of a block that face one way.
void append_filtered(const SurfaceCloud::Ptr& part, float voxel_m, bool independent, SurfaceCloud& result) {
  pcl::VoxelGrid<SurfacePoint> grid;
  grid.setInputCloud(part);
  grid.setLeafSize(voxel_m, voxel_m, voxel_m);
  grid.setDownsampleAllData(true);
  grid.setSaveLeafLayout(independent);
  SurfaceCloud means;
  grid.filter(means);
  if (independent) {
    std::vector<float> counts(means.size(), 0.0F);
    for (const SurfacePoint& p : *part) ++counts[static_cast<std::size_t>(grid.getCentroidIndex(p))];
    for (std::size_t i = 0; i < means.size(); ++i) means[i].curvature /= std::sqrt(counts[i]);
  }
  result += means;
}

/// The tree that pcl::KdTreeFLANN builds, searched by FLANN's own functions: its knnSearch, which PCL calls,
/// opens a parallel region of OpenMP for every point, which costs twice as much as the search.
class SerialSearch : public SurfaceSearch::Tree {
 public:
  explicit SerialSearch(const SurfaceCloud::ConstPtr& cloud) : KdTree(false) {
    input_ = cloud;
    for (const SurfacePoint& p : *cloud) numbers_.insert(numbers_.end(), p.data, p.data + 3);
    index_ = std::make_unique<Index>(flann::Matrix<float>(numbers_.data(), cloud->size(), 3),
                                     flann::KDTreeSingleIndexParams(kLeaf));
    index_->buildIndex();
  }
  int nearestKSearch(const SurfacePoint& point, int k, pcl::Indices& indices,
                     std::vector<float>& squares) const override {
    flann::KNNSimpleResultSet<float> found(static_cast<std::size_t>(k));
    index_->findNeighbors(found, point.data, flann::SearchParams(-1, 0.0F));

    // PCL's indices have another type
    std::vector<std::size_t> places(found.size());
    squares.resize(found.size());
    found.copy(places.data(), squares.data(), found.size(), true);
    indices.assign(places.begin(), places.end());
    return static_cast<int>(found.size());
  }

 private:
  using Index = flann::KDTreeSingleIndex<flann::L2_Simple<float>>;
  static constexpr int kLeaf = 15;  // points, as PCL's
  std::vector<float> numbers_;
  std::unique_ptr<Index> index_;
};

}  // namespace

SurfaceCloud voxel_filtered(const SurfaceCloud& cloud, float voxel_m, bool independent) {
  constexpr float kBlock = 256.0F;  // voxels along each side: 2^24 cells
  std::map<Part, SurfaceCloud::Ptr> parts;

  // In parts, since PCL numbers cells with 31 bits
  for (const SurfacePoint& p : cloud) {
    if (!p.getVector3fMap().allFinite() || !p.getNormalVector3fMap().allFinite()) continue;
    SurfaceCloud::Ptr& part = parts[part_of(p, kBlock * voxel_m)];
    if (part == nullptr) part = std::make_shared<SurfaceCloud>();
    part->push_back(p);
  }
  SurfaceCloud result;
  for (const auto& [key, part] : parts) append_filtered(part, voxel_m, independent, result);
  return result;
}

SurfaceSearch::SurfaceSearch(SurfaceCloud::ConstPtr cloud) : cloud_(std::move(cloud)) {
  if (cloud_->empty()) return;  // FLANN has no tree of nothing
  tree_ = std::make_shared<SerialSearch>(cloud_);
}

int nearest_facing(const SurfaceSearch::Tree& tree, const SurfacePoint& point, float distance_m,
                   float min_cosine) {
  if (!point.getVector3fMap().allFinite()) return -1;
  thread_local pcl::Indices indices;
  thread_local std::vector<float> squares;
  for (const int looked_at : {1, 8}) {  // hardly ever is more than one needed
    const int found = tree.nearestKSearch(point, looked_at, indices, squares);
    for (int i = 0; i < found; ++i) {
      // Neighbours are sorted: all others are farther away
      if (squares[static_cast<std::size_t>(i)] > distance_m * distance_m) return -1;
      const int index = indices[static_cast<std::size_t>(i)];
      const SurfacePoint& p = (*tree.getInputCloud())[static_cast<std::size_t>(index)];
      if (p.getNormalVector3fMap().dot(point.getNormalVector3fMap()) >= min_cosine) return index;
    }
  }
  return -1;
}

}  // namespace plumbline::cloud
