// SPDX-License-Identifier: BSD-3-Clause
// A view's measurements, voxel by voxel.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <limits>
#include <utility>

#include "plumbline/cloud/voxel_map.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "voxel_sample.hpp"

namespace plumbline::cloud {
namespace {

/// The samples of a view by voxel. Few enough to stay in the caches, where a whole map does not: what a voxel
/// gets from one view is summed up here first.
class ViewVoxels {
 public:
  explicit ViewVoxels(std::size_t points) : table_(kFirstTable, 0) { samples_.reserve(points / 3); }

  /// Where a measurement belongs: a sample that has its voxel and faces the same way; a new one if need be.
  VoxelSample& find_or_add(std::uint64_t key, const Eigen::Vector3f& normal) {
    // Neighbours in a picture mostly share their voxel, or had it in the row before.
    if (last_ < samples_.size() && suits(samples_[last_], key, normal)) return samples_[last_];
    if (2 * (samples_.size() + 1) > table_.size()) grow();
    std::size_t slot = home(key);
    for (; table_[slot] != 0; slot = (slot + 1) & (table_.size() - 1)) {
      last_ = table_[slot] - 1;
      if (suits(samples_[last_], key, normal)) return samples_[last_];
    }
    samples_.emplace_back();
    last_ = samples_.size() - 1;
    table_[slot] = static_cast<std::uint32_t>(samples_.size());
    samples_.back().key = key;
    return samples_.back();
  }
  [[nodiscard]] std::vector<VoxelSample> take() { return std::move(samples_); }

 private:
  static constexpr std::size_t kFirstTable = 1U << 14U;

  static bool suits(const VoxelSample& sample, std::uint64_t key, const Eigen::Vector3f& normal) {
    return sample.key == key && sample.normal.dot(normal) >= kOpposed * sample.normal.norm();
  }
  [[nodiscard]] std::size_t home(std::uint64_t key) const {
    return static_cast<std::size_t>((key >> 1) * 0x9E3779B97F4A7C15ULL >> 32) & (table_.size() - 1);
  }
  void grow() {
    table_.assign(2 * table_.size(), 0);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      std::size_t slot = home(samples_[i].key);
      while (table_[slot] != 0) slot = (slot + 1) & (table_.size() - 1);
      table_[slot] = static_cast<std::uint32_t>(i + 1);
    }
  }

  std::vector<VoxelSample> samples_;
  std::vector<std::uint32_t> table_;  ///< open addressing, linear probing: index into samples_ + 1, 0 = free
  std::size_t last_ = 0;
};

/// One more measurement; West's weighted update of the scatter along the normal known so far.
void take_up(const VoxelSample& one, VoxelSample& sum) {
  const float total = sum.weight + one.weight;
  const Eigen::Vector3f before = one.offset - sum.offset;
  const float share = one.weight / total;
  if (sum.weight > 0.0F) {
    const float squared = sum.normal.squaredNorm();
    const float distance = before.dot(sum.normal);
    if (squared > 0.0F) sum.scatter += distance * distance / squared * sum.weight * share;
  }
  if (sum.weight == 0.0F || (one.normal_known != 0 && sum.normal_known == 0)) {
    sum.normal = one.weight * one.normal;
    sum.normal_known = one.normal_known;
  } else if (one.normal_known != 0) {
    sum.normal += one.weight * one.normal;
  }
  sum.offset += share * before;
  sum.color += share * (one.color - sum.color);
  sum.variance += one.variance;
  sum.weight = total;
}

}  // namespace

ViewSamples VoxelMap::sampled(const Cloud& camera_cloud, const geometry::Rigid3& world_from_cloud,
                              const VoxelMapOptions& options, std::uint8_t robot) {
  const double unit = sensor::depth_sigma(1.0);
  const auto least = static_cast<float>(options.min_cos_incidence);
  const Eigen::Matrix3f rotation = world_from_cloud.rotation.cast<float>();
  const Eigen::Vector3d& translation = world_from_cloud.translation;
  ViewSamples view;
  ViewVoxels voxels(camera_cloud.size());
  VoxelSample sample;
  for (const Point& p : camera_cloud.points) {
    if (!(p.z > 0.0F) || !std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
    const Eigen::Vector3f point(p.x, p.y, p.z);
    const Eigen::Vector3f to_camera = point * (-1.0F / point.norm());
    Eigen::Vector3f normal(p.normal_x, p.normal_y, p.normal_z);
    const float squared = normal.squaredNorm();
    const bool known = squared > 0.25F && squared < std::numeric_limits<float>::infinity();
    float cosine = 0.5F;
    if (known) {
      normal *= 1.0F / std::sqrt(squared);
      cosine = std::abs(normal.dot(to_camera));
      if (cosine < least) continue;
    }
    // What may be far from the origin is added in double precision.
    if (!locate(translation + (rotation * point).cast<double>(), options.voxel_m, sample)) {
      ++view.dropped;
      continue;
    }
    const double sigma = sensor::depth_sigma(static_cast<double>(p.z));
    const double ratio = unit / sigma;
    sample.normal_known = known ? 1U : 0U;
    sample.normal = rotation * (known ? normal : to_camera);
    sample.color = Eigen::Vector3f(p.r, p.g, p.b);
    sample.weight = std::max(cosine, 1e-3F) * static_cast<float>(ratio * ratio);
    sample.variance = sample.weight * static_cast<float>(sigma * sigma);
    VoxelSample& sum = voxels.find_or_add(sample.key, sample.normal);
    if (sum.weight > 0.0F) vote(robot, 1, sum);
    sum.robot = robot;
    take_up(sample, sum);
  }
  view.samples = voxels.take();
  return view;
}

}  // namespace plumbline::cloud
