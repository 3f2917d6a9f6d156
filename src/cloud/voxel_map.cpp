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

namespace plumbline::cloud {
namespace {

constexpr int kAxisBits = 21;
constexpr std::int64_t kHalf = std::int64_t{1} << (kAxisBits - 1);
constexpr std::size_t kFirstTable = 1024;
constexpr float kOpposed = -0.2F;  // a fold of up to 100 degrees is still one side

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

/// One measurement, or one fused side of another map, in this map's frame.
struct VoxelMap::Sample {
  std::uint64_t key = 0;
  Eigen::Vector3f offset{0, 0, 0};  ///< from the voxel's centre
  Eigen::Vector3f normal{0, 0, 0};  ///< unit: the normal, or the direction to the camera
  Eigen::Vector3f color{0, 0, 0};
  float weight = 0.0F;
  float scatter = 0.0F;            ///< within the sample itself
  float variance = 0.0F;           ///< weight times the sensor's variance
  std::uint32_t observations = 1;  ///< views it stands for
  bool normal_known = false;
};

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

bool VoxelMap::locate(const Eigen::Vector3d& position, Sample& sample) {
  sample.key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(position[axis] / options_.voxel_m);
    if (!(cell >= static_cast<double>(-kHalf) && cell < static_cast<double>(kHalf))) {
      ++dropped_;
      return false;
    }
    sample.offset[axis] = static_cast<float>(position[axis] - (cell + 0.5) * options_.voxel_m);
    sample.key =
        sample.key << kAxisBits | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + kHalf);
  }
  sample.key <<= 1;  // the lowest bit is the side
  return true;
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
  Side side;
  side.key = key;
  sides_.push_back(side);
  table_[slot] = static_cast<std::uint32_t>(sides_.size());
  return &sides_.back();
}

void VoxelMap::add_all(const std::vector<Sample>& samples) {
  // A large map lies outside the caches: ask for table and voxels a few samples ahead.
  constexpr std::size_t kTableAhead = 24;
  constexpr std::size_t kSideAhead = 12;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i + kTableAhead < samples.size()) __builtin_prefetch(&table_[home(samples[i + kTableAhead].key)]);
    if (i + kSideAhead < samples.size()) {
      const std::uint32_t side = table_[home(samples[i + kSideAhead].key)];
      if (side != 0) __builtin_prefetch(&sides_[side - 1]);
    }
    add(samples[i]);
  }
}

void VoxelMap::add(const Sample& sample) {
  Side* side = find_or_add(sample.key);
  if (side->weight > 0.0F && side->normal.dot(sample.normal) < kOpposed * side->normal.norm()) {
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
  if (side->weight == 0.0F || (sample.normal_known && side->normal_known == 0)) {
    side->normal = sample.weight * sample.normal;
    side->normal_known = sample.normal_known ? 1U : 0U;
  } else if (sample.normal_known) {
    side->normal += sample.weight * sample.normal;
  }
  side->scatter += sample.scatter;
  side->variance += sample.variance;
  side->mean += share * before;
  side->color += share * (sample.color - side->color);
  side->weight = total;
  // Several samples of one view are one observation (of a merged map: those of its most seen voxel).
  if (side->last_view != view_) side->last_observations = 0;
  side->last_view = view_;
  if (sample.observations > side->last_observations) {
    side->observations += sample.observations - side->last_observations;
    side->last_observations = sample.observations & 0x7FFFFFFFU;
  }
}

void VoxelMap::insert(const Cloud& camera_cloud, const geometry::Rigid3& world_from_cloud,
                      const Eigen::AlignedBox3d* region) {
  ++view_;
  const double unit = sensor::depth_sigma(1.0);
  std::vector<Sample> samples;
  samples.reserve(camera_cloud.size());
  for (const Point& p : camera_cloud.points) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !(p.z > 0.0F) || !std::isfinite(p.z)) continue;
    const Eigen::Vector3d point(p.x, p.y, p.z);
    const Eigen::Vector3d in_world = world_from_cloud * point;
    if (region != nullptr && !region->contains(in_world)) continue;
    const Eigen::Vector3d to_camera = -point.normalized();
    Eigen::Vector3d normal(p.normal_x, p.normal_y, p.normal_z);
    Sample sample;
    sample.normal_known = normal.allFinite() && normal.squaredNorm() > 0.25;
    double cosine = 0.5;
    if (sample.normal_known) {
      normal.normalize();
      cosine = std::abs(normal.dot(to_camera));
      if (cosine < options_.min_cos_incidence) continue;
    }
    if (!locate(in_world, sample)) continue;
    const double sigma = sensor::depth_sigma(point.z());
    const double ratio = unit / sigma;
    sample.normal = (world_from_cloud.rotation * (sample.normal_known ? normal : to_camera)).cast<float>();
    sample.color = Eigen::Vector3f(p.r, p.g, p.b);
    sample.weight = static_cast<float>(std::max(cosine, 1e-3) * ratio * ratio);
    sample.variance = sample.weight * static_cast<float>(sigma * sigma);
    samples.push_back(sample);
  }
  add_all(samples);
}

void VoxelMap::merge(const VoxelMap& other, const geometry::Rigid3& this_from_other) {
  const Eigen::Matrix3f rotation = this_from_other.rotation.cast<float>();
  ++view_;
  std::vector<Sample> samples;
  samples.reserve(other.sides_.size());
  for (const Side& side : other.sides_) {
    if (!(side.weight > 0.0F)) continue;
    Sample sample;
    if (!locate(this_from_other * other.position(side), sample)) continue;
    sample.normal = rotation * side.normal.normalized();
    sample.normal_known = side.normal_known != 0;
    sample.color = side.color;
    sample.weight = side.weight;
    sample.scatter = side.scatter;
    sample.variance = side.variance;
    sample.observations = side.observations;
    samples.push_back(sample);
  }
  add_all(samples);
}

void VoxelMap::merge(const FusedCloud& points) {
  ++view_;
  const Cloud& cloud = *points.cloud;
  std::vector<Sample> samples;
  samples.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    Sample sample;
    if (!locate(cloud[i].getVector3fMap().cast<double>(), sample)) continue;
    const Eigen::Vector3f normal = cloud[i].getNormalVector3fMap();
    sample.normal_known = normal.allFinite();
    if (sample.normal_known) sample.normal = normal;
    sample.color = Eigen::Vector3f(cloud[i].r, cloud[i].g, cloud[i].b);
    sample.weight = points.weight[i];
    sample.scatter = points.weight[i] * points.spread_m[i] * points.spread_m[i];
    sample.variance = points.weight[i] * points.noise_m[i] * points.noise_m[i];
    sample.observations = points.columns.observations[i];
    samples.push_back(sample);
  }
  add_all(samples);
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
  }
  fused.cloud->width = static_cast<std::uint32_t>(fused.cloud->size());
  fused.cloud->height = 1;
  fused.cloud->is_dense = true;
  return fused;
}

}  // namespace plumbline::cloud
