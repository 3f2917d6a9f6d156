// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/voxel_map.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "plumbline/sensor/depth_noise.hpp"
#include "scalar.hpp"
#include "voxel_key.hpp"
#include "voxel_sample.hpp"

namespace plumbline::cloud {
namespace {

constexpr std::size_t kFirstTable = 1024;

/// The bits of a key that tell the voxels of a block of 2 x 2 x 2 and their sides apart.
constexpr std::uint64_t kBlockBits =
    1U | 1U << 1 | std::uint64_t{1} << (1 + kAxisBits) | std::uint64_t{1} << (1 + 2 * kAxisBits);

std::size_t place_in_block(std::uint64_t key) {
  return static_cast<std::size_t>((key & 3U) | (key >> (1 + kAxisBits) & 1U) << 2 |
                                  (key >> (1 + 2 * kAxisBits) & 1U) << 3);
}

}  // namespace

void VoxelMapOptions::declare(core::OptionTable& table) {
  table.number("voxel", voxel_m, {0.001, 1.0}, "m", "Edge length of a voxel");
  table.number("min_cos_incidence", min_cos_incidence, {0.0, 1.0}, "",
               "Measurements seen more obliquely than this cosine are left out");
}

void VoxelExtractOptions::declare(core::OptionTable& table) {
  table.integer("min_observations", min_observations, {1, 1000}, "", "Views that must have seen a voxel");
}

VoxelMap::VoxelMap(const VoxelMapOptions& options) : options_(options), table_(kFirstTable, 0) {}

void VoxelMap::clear() {
  sides_.clear();
  table_.assign(kFirstTable, 0);
  view_ = 0;
  dropped_ = 0;
}

std::size_t VoxelMap::bytes() const {
  return sides_.capacity() * sizeof(Side) + table_.capacity() * sizeof(std::uint32_t);
}

/// Where the search for a key starts. The voxels of a block share a cache line of the table.
std::size_t VoxelMap::home(std::uint64_t key) const {
  return (mix(key & ~kBlockBits) << 4 | place_in_block(key)) & (table_.size() - 1);
}

void VoxelMap::grow() {
  table_.assign(table_.size() * 2, 0);
  const std::size_t mask = table_.size() - 1;
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    std::size_t slot = home(sides_[i].key);
    while (table_[slot] != 0) slot = (slot + 1) & mask;
    table_[slot] = static_cast<std::uint32_t>(i + 1);
  }
}

VoxelMap::Side* VoxelMap::find_or_add(std::uint64_t key) {
  if ((sides_.size() + 1) * 2 > table_.size()) grow();
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = home(key);
  while (table_[slot] != 0) {
    Side& side = sides_[table_[slot] - 1];
    if (side.key == key) return &side;
    slot = (slot + 1) & mask;
  }
  Side& side = sides_.add();
  side.key = key;
  table_[slot] = static_cast<std::uint32_t>(sides_.size());
  return &side;
}

void VoxelMap::add(const VoxelSample* samples, std::size_t count) {
  // A large map lies outside the caches: ask for table and voxels a few samples ahead.
  constexpr std::size_t kTableAhead = 24;
  constexpr std::size_t kSideAhead = 12;
  for (std::size_t i = 0; i < count; ++i) {
    if (i + kTableAhead < count) __builtin_prefetch(&table_[home(samples[i + kTableAhead].key)]);
    if (i + kSideAhead < count) {
      const std::uint32_t side = table_[home(samples[i + kSideAhead].key)];
      if (side != 0) __builtin_prefetch(&sides_[side - 1]);
    }
    add(samples[i]);
  }
}

void VoxelMap::add(const VoxelSample& sample) {
  Side* side = find_or_add(sample.key);
  if (side->weight > 0.0F &&
      side->normal.dot(sample.normal) < kOpposed * side->normal.norm() * sample.normal.norm()) {
    side = find_or_add(sample.key | 1U);
  }
  const float total = side->weight + sample.weight;
  const Eigen::Vector3f before = sample.offset - side->mean;
  const float share = sample.weight / total;
  if (side->weight > 0.0F) {
    // West's weighted update of the scatter along the normal known so far.
    const float squared = side->normal.squaredNorm();
    const float distance = before.dot(side->normal);
    if (squared > 0.0F) side->scatter += distance * distance / squared * side->weight * share;
  }
  if (side->weight == 0.0F || (sample.normal_known != 0 && side->normal_known == 0)) {
    side->normal = sample.normal;
    side->normal_known = sample.normal_known;
  } else if (sample.normal_known != 0) {
    side->normal += sample.normal;
  }
  side->scatter += sample.scatter;
  side->variance += sample.variance;
  side->mean += share * before;
  side->color += share * (sample.color - side->color);
  side->weight = total;
  vote(sample.robot, sample.robot_lead, *side);
  // Several samples of one view are one observation (of a merged map: those of its most seen voxel).
  if (side->last_view != view_) side->last_observations = 0;
  side->last_view = view_;
  if (sample.observations > side->last_observations) {
    side->observations += sample.observations - side->last_observations;
    side->last_observations = sample.observations & 0x7FFFFFFFU;
  }
}

Eigen::Vector3i VoxelMap::voxel_of(const VoxelSample& sample) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kAxisBits) - 1;
  const std::uint64_t cells = sample.key >> 1;
  const auto axis = [&](int shift) {
    return static_cast<int>(static_cast<std::int64_t>(cells >> shift & kMask) - kHalf);
  };
  return {axis(2 * kAxisBits), axis(kAxisBits), axis(0)};
}

void VoxelMap::insert(const Cloud& camera_cloud, const geometry::Rigid3& world_from_cloud,
                      const Eigen::AlignedBox3d* region) {
  ViewSamples view = sampled(camera_cloud, world_from_cloud, options_);
  std::vector<VoxelSample>& samples = view.samples;
  if (region != nullptr) {
    const auto outside = [&](const VoxelSample& s) {
      const Eigen::Vector3d centre = (voxel_of(s).cast<double>().array() + 0.5) * options_.voxel_m;
      return !region->contains(centre + s.offset.cast<double>());
    };
    samples.erase(std::remove_if(samples.begin(), samples.end(), outside), samples.end());
  }
  dropped_ += view.dropped;
  begin_view();
  add(samples.data(), samples.size());
}

void VoxelMap::merge(const VoxelMap& other, const geometry::Rigid3& this_from_other) {
  const Eigen::Matrix3f rotation = this_from_other.rotation.cast<float>();
  ++view_;
  std::vector<VoxelSample> samples;
  samples.reserve(other.sides_.size());
  for (std::size_t i = 0; i < other.sides_.size(); ++i) {
    const Side& side = other.sides_[i];
    if (!(side.weight > 0.0F)) continue;
    VoxelSample sample;
    if (!locate(this_from_other * other.position(side), options_.voxel_m, sample)) {
      ++dropped_;
      continue;
    }
    sample.normal = side.weight * (rotation * side.normal.normalized());
    sample.normal_known = side.normal_known;
    sample.robot = side.robot;
    sample.robot_lead = side.robot_lead;
    sample.color = side.color;
    sample.weight = side.weight;
    sample.scatter = side.scatter;
    sample.variance = side.variance;
    sample.observations = side.observations;
    samples.push_back(sample);
  }
  add(samples.data(), samples.size());
}

void VoxelMap::merge(const FusedCloud& points) {
  ++view_;
  const Cloud& cloud = *points.cloud;
  std::vector<VoxelSample> samples;
  samples.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    VoxelSample sample;
    if (!locate(cloud[i].getVector3fMap().cast<double>(), options_.voxel_m, sample)) {
      ++dropped_;
      continue;
    }
    const Eigen::Vector3f normal = cloud[i].getNormalVector3fMap();
    if (normal.allFinite()) {
      sample.normal_known = 1;
      sample.normal = points.weight[i] * normal;
    }
    if (!points.robot_lead.empty()) {
      sample.robot = points.columns.robot[i];
      sample.robot_lead = points.robot_lead[i] & 0x7FFFFFU;
    }
    sample.color = Eigen::Vector3f(cloud[i].r, cloud[i].g, cloud[i].b);
    sample.weight = points.weight[i];
    sample.scatter = points.weight[i] * points.spread_m[i] * points.spread_m[i];
    sample.variance = points.weight[i] * points.noise_m[i] * points.noise_m[i];
    sample.observations = points.columns.observations[i];
    samples.push_back(sample);
  }
  add(samples.data(), samples.size());
}

Eigen::Vector3d VoxelMap::position(const Side& side) const {
  Eigen::Vector3d centre;
  std::uint64_t cells = side.key >> 1;
  for (int axis = 2; axis >= 0; --axis) {
    const auto cell = static_cast<std::int64_t>(cells & ((std::uint64_t{1} << kAxisBits) - 1)) - kHalf;
    centre[axis] = (static_cast<double>(cell) + 0.5) * options_.voxel_m;
    cells >>= kAxisBits;
  }
  return centre + side.mean.cast<double>();
}

FusedCloud VoxelMap::extract(const VoxelExtractOptions& options) const {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  order.reserve(sides_.size());
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    if (sides_[i].weight > 0.0F &&
        sides_[i].observations >= static_cast<std::uint32_t>(options.min_observations)) {
      order.emplace_back(sides_[i].key, static_cast<std::uint32_t>(i));
    }
  }
  std::sort(order.begin(), order.end());

  FusedCloud fused;
  fused.cloud = std::make_shared<Cloud>();
  fused.cloud->points.reserve(order.size());
  fused.columns.observations.reserve(order.size());
  fused.columns.confidence.reserve(order.size());
  fused.spread_m.reserve(order.size());
  fused.weight.reserve(order.size());
  fused.noise_m.reserve(order.size());
  if (options_.robots) {
    fused.columns.robot.reserve(order.size());
    fused.robot_lead.reserve(order.size());
  }
  for (const auto& [key, index] : order) {
    const Side& side = sides_[index];
    const Eigen::Vector3f position = this->position(side).cast<float>();
    Point p;
    p.x = position.x();
    p.y = position.y();
    p.z = position.z();
    const bool known = side.normal_known != 0 && side.normal.squaredNorm() > 0.0F;
    const Eigen::Vector3f normal =
        known ? side.normal.normalized().eval()
              : Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()).eval();
    p.normal_x = normal.x();
    p.normal_y = normal.y();
    p.normal_z = normal.z();
    p.r = to_byte(static_cast<double>(side.color.x()));
    p.g = to_byte(static_cast<double>(side.color.y()));
    p.b = to_byte(static_cast<double>(side.color.z()));
    p.a = 255;
    fused.cloud->points.push_back(p);
    fused.columns.observations.push_back(side.observations);
    fused.columns.confidence.push_back(side.weight / (side.weight + 1.0F));
    fused.spread_m.push_back(std::sqrt(side.scatter / side.weight));
    fused.weight.push_back(side.weight);
    fused.noise_m.push_back(std::sqrt(side.variance / side.weight));
    if (!options_.robots) continue;
    fused.columns.robot.push_back(static_cast<std::uint8_t>(side.robot));
    fused.robot_lead.push_back(side.robot_lead);
  }
  fused.cloud->width = static_cast<std::uint32_t>(fused.cloud->size());
  fused.cloud->height = 1;
  fused.cloud->is_dense = true;
  return fused;
}

}  // namespace plumbline::cloud
