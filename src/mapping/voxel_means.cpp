// SPDX-License-Identifier: BSD-3-Clause
#include "voxel_means.hpp"

#include <algorithm>
#include <cmath>

#include "plumbline/core/clones.hpp"
#include "surface_voxels.hpp"

namespace plumbline::mapping {

void VoxelMeans::set_frame(const Eigen::Matrix3f& rotation, const Eigen::Vector3f& translation) {
  take_waiting();
  rotation_ = rotation;
  translation_ = translation;
}

/// Moves the samples into the frame of the means; keys as of voxel_key and facing. Those that are not filled
/// as well.
PLUMBLINE_CLONES
void VoxelMeans::place(const Eigen::Matrix3f& rotation, const Eigen::Vector3f& translation, float voxel_m,
                       const Waiting& samples, Keys& keys, Shares& shares) {
  constexpr std::int32_t kHalf = 1 << (kVoxelAxisBits - 1);
  for (std::size_t from = 0; from < kTogether; from += kLanes) {
    const auto lanes = from / kLanes;
    Floats point[3];
    Floats normal[3];
    Ints cell[3];
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const float rx = rotation(axis, 0);
      const float ry = rotation(axis, 1);
      const float rz = rotation(axis, 2);
      point[axis] = rx * samples.point[0][lanes] +
                    (ry * samples.point[1][lanes] + rz * samples.point[2][lanes]) + translation[axis];
      normal[axis] =
          rx * samples.normal[0][lanes] + (ry * samples.normal[1][lanes] + rz * samples.normal[2][lanes]);
      Floats at = point[axis] / voxel_m;
      at = at > -kHalf ? at : Floats{} - kHalf;
      at = at < kHalf - 1 ? at : Floats{} + (kHalf - 1);
      cell[axis] = __builtin_convertvector(at, Ints);
      cell[axis] += __builtin_convertvector(cell[axis], Floats) > at;  // -1: it was rounded up
      cell[axis] += kHalf;
    }
    const Floats x = normal[0] < 0.0F ? -normal[0] : normal[0];
    const Floats y = normal[1] < 0.0F ? -normal[1] : normal[1];
    const Floats z = normal[2] < 0.0F ? -normal[2] : normal[2];
    const Ints by_y = y > x;
    const Ints by_z = z > (by_y ? y : x);
    const Floats longest = by_z ? normal[2] : (by_y ? normal[1] : normal[0]);
    const Ints way = (by_z ? Ints{} + 4 : (by_y ? Ints{} + 2 : Ints{})) - (longest < 0.0F);
    const Ints last = cell[2] << 3 | way;
    const Floats weight = 1.0F / (samples.sigma[lanes] * samples.sigma[lanes]);
    for (std::size_t i = 0; i < 3; ++i) {
      point[i] *= weight;
      normal[i] *= weight;
    }
    for (std::size_t i = 0; i < kLanes; ++i) {
      keys[from + i] = static_cast<std::uint64_t>(cell[0][i]) << (2 * kVoxelAxisBits + 3) |
                       static_cast<std::uint64_t>(cell[1][i]) << (kVoxelAxisBits + 3) |
                       static_cast<std::uint64_t>(last[i]);
      shares[from + i].point = {point[0][i], point[1][i], point[2][i], weight[i]};
      shares[from + i].normal = {normal[0][i], normal[1][i], normal[2][i], 1.0F};
    }
  }
}

void VoxelMeans::take_waiting() {
  Keys keys;
  Shares shares;
  place(rotation_, translation_, voxel_m_, waiting_, keys, shares);
  for (std::size_t i = 0; i < waiting_.count;) {
    Share& sum = sums_.of(keys[i]).share;
    Eigen::Array4f point = sum.point;
    Eigen::Array4f normal = sum.normal;
    const std::uint64_t key = keys[i];  // neighbours of a picture follow one another
    for (; i < waiting_.count && keys[i] == key; ++i) {
      point += shares[i].point;
      normal += shares[i].normal;
    }
    sum.point = point;
    sum.normal = normal;
  }
  waiting_.count = 0;
}

CoarseSurface VoxelMeans::take(bool combined) {
  take_waiting();
  CoarseSurface means;
  const std::vector<Sum> sums = sums_.sorted();
  means.reserve(sums.size());
  for (const Sum& sum : sums) {
    const Eigen::Vector3f point = sum.share.point.head<3>();
    const Eigen::Vector3f normal = sum.share.normal.head<3>();
    const float weight = sum.share.point[3];
    const float sigma = 1.0F / std::sqrt(combined ? weight : weight / sum.share.normal[3]);
    if (normal.norm() > 0.5F * weight) means.push_back({point / weight, normal.normalized(), sigma});
  }
  return means;
}

}  // namespace plumbline::mapping
