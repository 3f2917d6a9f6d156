// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Surfaces made coarse: means of what lies in one voxel and faces one way.
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "plumbline/cloud/sum_table.hpp"
#include "plumbline/mapping/local_map_alignment.hpp"

namespace plumbline::mapping {

/// Means of the samples of each voxel and facing, weighted by 1 / sigma^2.
class VoxelMeans {
 public:
  explicit VoxelMeans(double voxel_m) : voxel_m_(static_cast<float>(voxel_m)) {}

  /// Where the samples that are added from now on lie, in the frame of the means.
  void set_frame(const Eigen::Matrix3f& rotation, const Eigen::Vector3f& translation);
  void add(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, float sigma) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      waiting_.point[axis][waiting_.count / kLanes][waiting_.count % kLanes] =
          point[static_cast<Eigen::Index>(axis)];
      waiting_.normal[axis][waiting_.count / kLanes][waiting_.count % kLanes] =
          normal[static_cast<Eigen::Index>(axis)];
    }
    waiting_.sigma[waiting_.count / kLanes][waiting_.count % kLanes] = sigma;
    if (++waiting_.count == kTogether) take_waiting();
  }
  /// In order of voxels; once. `combined`: the samples are independent measurements, so that their mean is
  /// better than each; else it is as good as they are.
  [[nodiscard]] CoarseSurface take(bool combined);

 private:
  static constexpr std::size_t kTogether = 64;
  static constexpr std::size_t kLanes = 8;
  using Floats = float __attribute__((vector_size(4 * kLanes)));
  using Ints = std::int32_t __attribute__((vector_size(4 * kLanes)));
  using Numbers = Floats[kTogether / kLanes];
  struct alignas(32) Waiting {  // as AVX wants it, which compilers that know nothing of it do not see to
    Numbers point[3] = {};
    Numbers normal[3] = {};
    Numbers sigma = {};
    std::size_t count = 0;
  };
  struct Share {
    Eigen::Array4f point = Eigen::Array4f::Zero();   ///< times the weight, and the weight
    Eigen::Array4f normal = Eigen::Array4f::Zero();  ///< times the weight, and how many
  };
  /// Of a voxel and the way its surface faces.
  struct Sum {
    Share share;
    std::uint64_t key = 0;
  };
  using Keys = std::array<std::uint64_t, kTogether>;
  using Shares = std::array<Share, kTogether>;
  static void place(const Eigen::Matrix3f& rotation, const Eigen::Vector3f& translation, float voxel_m,
                    const Waiting& samples, Keys& keys, Shares& shares);
  void take_waiting();

  float voxel_m_;
  Eigen::Matrix3f rotation_ = Eigen::Matrix3f::Identity();
  Eigen::Vector3f translation_ = Eigen::Vector3f::Zero();
  Waiting waiting_;
  cloud::SumTable<Sum> sums_;
};

}  // namespace plumbline::mapping
