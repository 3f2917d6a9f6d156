// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The samples of a view by voxel. Few enough to stay in the caches, where a whole map does not: what a voxel
// gets from one view is summed up here first.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/voxel_map.hpp"
#include "voxel_sample.hpp"

namespace plumbline::cloud {

/// Sums of one view after another; its table is used again.
class ViewVoxels {
 public:
  /// A new view, summed up in `samples`.
  void begin(std::vector<VoxelSample>& samples) {
    samples_ = &samples;
    samples.clear();
    table_.assign(table_.empty() ? kFirstTable : table_.size(), 0);
    last_ = 0;
  }

  /// One more measurement; its normal has unit length.
  void take_up(const VoxelSample& one, std::uint32_t robot) {
    VoxelSample& sum = find_or_add(one.key, one.normal);
    if (sum.weight > 0.0F) vote(robot, 1, sum);
    sum.robot = robot & 0xFFU;
    add(one, sum);
  }

 private:
  static constexpr std::size_t kFirstTable = 1U << 14U;

  /// Where a measurement belongs: a sample that has its voxel and faces the same way; a new one if need be.
  VoxelSample& find_or_add(std::uint64_t key, const Eigen::Vector3f& normal) {
    std::vector<VoxelSample>& samples = *samples_;
    // Neighbours in a picture mostly share their voxel, or had it in the row before.
    if (last_ < samples.size() && suits(samples[last_], key, normal)) return samples[last_];
    if (2 * (samples.size() + 1) > table_.size()) grow();
    std::size_t slot = home(key);
    for (; table_[slot] != 0; slot = (slot + 1) & (table_.size() - 1)) {
      last_ = table_[slot] - 1;
      if (suits(samples[last_], key, normal)) return samples[last_];
    }
    samples.emplace_back();
    last_ = samples.size() - 1;
    table_[slot] = static_cast<std::uint32_t>(samples.size());
    samples.back().key = key;
    return samples.back();
  }

  static bool suits(const VoxelSample& sample, std::uint64_t key, const Eigen::Vector3f& normal) {
    if (sample.key != key) return false;
    const float along = sample.normal.dot(normal);
    return along >= 0.0F || along >= kOpposed * sample.normal.norm();
  }
  [[nodiscard]] std::size_t home(std::uint64_t key) const {
    return static_cast<std::size_t>((key >> 1) * 0x9E3779B97F4A7C15ULL >> 32) & (table_.size() - 1);
  }
  void grow() {
    table_.assign(2 * table_.size(), 0);
    for (std::size_t i = 0; i < samples_->size(); ++i) {
      std::size_t slot = home((*samples_)[i].key);
      while (table_[slot] != 0) slot = (slot + 1) & (table_.size() - 1);
      table_[slot] = static_cast<std::uint32_t>(i + 1);
    }
  }

  /// West's weighted update of the scatter along the normal known so far.
  static void add(const VoxelSample& one, VoxelSample& sum) {
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

  std::vector<VoxelSample>* samples_ = nullptr;
  std::vector<std::uint32_t> table_;  ///< open addressing, linear probing: index into samples + 1, 0 = free
  std::size_t last_ = 0;
};

}  // namespace plumbline::cloud
