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

/// The bits of a key that tell the voxels of a brick of 4 x 4 x 4 and their sides apart.
constexpr int kZ = 1;
constexpr int kY = kZ + kAxisBits;
constexpr int kX = kY + kAxisBits;
constexpr std::uint64_t kInBrick =
    1U | std::uint64_t{3} << kZ | std::uint64_t{3} << kY | std::uint64_t{3} << kX;

/// Of a voxel in its brick: x, then y, then z.
std::size_t place_in_brick(std::uint64_t key) {
  return static_cast<std::size_t>((key >> kZ & 3U) | (key >> kY & 3U) << 2 | (key >> kX & 3U) << 4);
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

VoxelMap::VoxelMap(const VoxelMapOptions& options) : options_(options), table_(kFirstTable) {}

void VoxelMap::clear() {
  sides_.clear();
  bricks_.clear();
  backs_.clear();
  table_.assign(kFirstTable, {});
  last_ = {};
  view_ = 0;
  dropped_ = 0;
}

std::size_t VoxelMap::bytes() const {
  return sides_.capacity() * sizeof(Side) + bricks_.capacity() * sizeof(Brick) +
         table_.capacity() * sizeof(Slot) + backs_.size() * 4 * sizeof(std::uint64_t);
}

/// Where the search for a brick starts.
std::size_t VoxelMap::home(std::uint64_t brick) const {
  return static_cast<std::size_t>(brick * 0x9E3779B97F4A7C15ULL >> 32) & (table_.size() - 1);
}

void VoxelMap::grow() {
  const std::vector<Slot> before = std::move(table_);
  table_.assign(before.size() * 2, {});
  const std::size_t mask = table_.size() - 1;
  for (const Slot& one : before) {
    if (one.brick == 0) continue;
    std::size_t slot = home(one.key);
    while (table_[slot].brick != 0) slot = (slot + 1) & mask;
    table_[slot] = one;
  }
}

std::uint32_t* VoxelMap::find(std::uint64_t key) {
  const std::uint64_t brick = key & ~kInBrick;
  if (last_.brick == 0 || last_.key != brick) {
    const std::size_t mask = table_.size() - 1;
    std::size_t slot = home(brick);
    while (table_[slot].brick != 0 && table_[slot].key != brick) slot = (slot + 1) & mask;
    if (table_[slot].brick == 0) return nullptr;
    last_ = table_[slot];
  }
  return &bricks_[last_.brick - 1].fronts[place_in_brick(key)];
}

std::uint32_t& VoxelMap::find_or_add(std::uint64_t key) {
  if (std::uint32_t* found = find(key)) return *found;
  if ((bricks_.size() + 1) * 2 > table_.size()) grow();
  const std::size_t mask = table_.size() - 1;
  Slot added;
  added.key = key & ~kInBrick;
  std::size_t slot = home(added.key);
  while (table_[slot].brick != 0) slot = (slot + 1) & mask;
  Brick& brick = bricks_.add();
  added.brick = static_cast<std::uint32_t>(bricks_.size());
  table_[slot] = last_ = added;
  return brick.fronts[place_in_brick(key)];
}

VoxelMap::Side& VoxelMap::back_of(std::uint32_t front) {
  const auto [found, fresh] = backs_.try_emplace(front, static_cast<std::uint32_t>(sides_.size()));
  if (!fresh) return sides_[found->second];
  sides_[front].has_back = 1;
  return sides_.add();
}

void VoxelMap::add(const VoxelSample* samples, std::size_t count) {
  // A large map lies outside the caches: what some samples need is asked for together, and what the next ones
  // need first, meanwhile.
  constexpr std::size_t kTogether = 32;
  std::array<std::uint32_t*, kTogether> fronts{};
  for (std::size_t first = 0; first < count; first += kTogether) {
    const std::size_t some = std::min(kTogether, count - first);
    for (std::size_t i = 0; i < some; ++i) {
      fronts[i] = find(samples[first + i].key);
      __builtin_prefetch(fronts[i]);
    }
    const std::size_t ahead = std::min(count, first + some + kTogether);
    for (std::size_t i = first + some; i < ahead; ++i)
      __builtin_prefetch(&table_[home(samples[i].key & ~kInBrick)]);
    for (std::size_t i = 0; i < some; ++i) {
      if (fronts[i] != nullptr && *fronts[i] != 0) __builtin_prefetch(&sides_[*fronts[i] - 1]);
    }
    for (std::size_t i = 0; i < some; ++i) {
      const VoxelSample& sample = samples[first + i];
      add(sample, fronts[i] != nullptr ? *fronts[i] : find_or_add(sample.key));
    }
  }
}

void VoxelMap::add(const VoxelSample& sample, std::uint32_t& front) {
  if (front == 0) {
    Side& side = sides_.add();
    front = static_cast<std::uint32_t>(sides_.size());
    return add_to(side, sample);
  }
  Side& side = sides_[front - 1];
  const float along = side.normal.dot(sample.normal);
  const bool opposed =
      side.weight > 0.0F && along < 0.0F && along < kOpposed * side.normal.norm() * sample.normal.norm();
  add_to(opposed ? back_of(front - 1) : side, sample);
}

void VoxelMap::add_to(Side& side, const VoxelSample& sample) const {
  const float total = side.weight + sample.weight;
  const Eigen::Vector3f before = sample.offset - side.mean;
  const float share = sample.weight / total;
  if (side.weight > 0.0F) {
    // West's weighted update of the scatter along the normal known so far.
    const float squared = side.normal.squaredNorm();
    const float distance = before.dot(side.normal);
    if (squared > 0.0F) side.scatter += distance * distance / squared * side.weight * share;
  }
  if (side.weight == 0.0F || (sample.normal_known != 0 && side.normal_known == 0)) {
    side.normal = sample.normal;
    side.normal_known = sample.normal_known;
  } else if (sample.normal_known != 0) {
    side.normal += sample.normal;
  }
  side.scatter += sample.scatter;
  side.variance += sample.variance;
  side.mean += share * before;
  side.color += share * (sample.color - side.color);
  side.weight = total;
  vote(sample.robot, sample.robot_lead, side);
  // Several samples of one view are one observation (of a merged map: those of its most seen voxel).
  if (side.last_view != view_) side.last_observations = 0;
  side.last_view = view_;
  if (sample.observations > side.last_observations) {
    side.observations += sample.observations - side.last_observations;
    side.last_observations = sample.observations & 0x7FFFFFFFU;
  }
}

std::vector<VoxelMap::Place> VoxelMap::in_order() const {
  std::vector<Slot> bricks;
  bricks.reserve(bricks_.size());
  for (const Slot& slot : table_) {
    if (slot.brick != 0) bricks.push_back(slot);
  }
  std::sort(bricks.begin(), bricks.end(), [](const Slot& a, const Slot& b) { return a.key < b.key; });
  std::vector<Place> order;
  order.reserve(sides_.size());
  const auto add_row = [&](const Slot& slot, std::size_t x, std::size_t y) {
    const std::uint32_t* fronts = &bricks_[slot.brick - 1].fronts[(x * kBrick + y) * kBrick];
    for (std::size_t z = 0; z < kBrick; ++z) {
      if (fronts[z] == 0) continue;
      const std::uint64_t key =
          slot.key | std::uint64_t{x} << kX | std::uint64_t{y} << kY | std::uint64_t{z} << kZ;
      order.push_back({key, fronts[z] - 1});
      if (sides_[fronts[z] - 1].has_back != 0) order.push_back({key, backs_.at(fronts[z] - 1)});
    }
  };
  const auto end_of = [&](std::size_t begin, std::size_t end, int shift) {
    std::size_t at = begin;
    while (at < end && bricks[at].key >> shift == bricks[begin].key >> shift) ++at;
    return at;
  };
  for (std::size_t slab = 0, slab_end = 0; slab < bricks.size(); slab = slab_end) {
    slab_end = end_of(slab, bricks.size(), kX);
    for (std::size_t x = 0; x < kBrick; ++x) {
      for (std::size_t bar = slab, bar_end = 0; bar < slab_end; bar = bar_end) {
        bar_end = end_of(bar, slab_end, kY);
        for (std::size_t y = 0; y < kBrick; ++y) {
          for (std::size_t b = bar; b < bar_end; ++b) add_row(bricks[b], x, y);
        }
      }
    }
  }
  return order;
}

Eigen::Vector3i VoxelMap::voxel_of(std::uint64_t key) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kAxisBits) - 1;
  const auto axis = [&](int shift) {
    return static_cast<int>(static_cast<std::int64_t>(key >> shift & kMask) - kHalf);
  };
  return {axis(kX), axis(kY), axis(kZ)};
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
  for (const Place& place : other.in_order()) {
    const Side& side = other.sides_[place.side];
    if (!(side.weight > 0.0F)) continue;
    VoxelSample sample;
    if (!locate(this_from_other * other.position(place.key, side), options_.voxel_m, sample)) {
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
  constexpr std::size_t kAtATime = 256;
  std::vector<VoxelSample> samples;
  samples.reserve(kAtATime);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (samples.size() == kAtATime) {
      add(samples.data(), samples.size());
      samples.clear();
    }
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

Eigen::Vector3d VoxelMap::position(std::uint64_t key, const Side& side) const {
  const Eigen::Vector3d centre = (voxel_of(key).cast<double>().array() + 0.5) * options_.voxel_m;
  return centre + side.mean.cast<double>();
}

FusedCloud VoxelMap::extract(const VoxelExtractOptions& options) const {
  const auto least = static_cast<std::uint32_t>(options.min_observations);
  const auto wanted = [least](const Side& s) { return s.weight > 0.0F && s.observations >= least; };
  std::size_t count = 0;
  for (std::size_t i = 0; i < sides_.size(); ++i) count += wanted(sides_[i]) ? 1 : 0;
  FusedCloud fused;
  fused.cloud = std::make_shared<Cloud>();
  fused.cloud->points.reserve(count);
  fused.columns.observations.reserve(count);
  fused.columns.confidence.reserve(count);
  fused.spread_m.reserve(count);
  fused.weight.reserve(count);
  fused.noise_m.reserve(count);
  if (options_.robots) {
    fused.columns.robot.reserve(count);
    fused.robot_lead.reserve(count);
  }
  const std::vector<Place> order = in_order();
  constexpr std::size_t kAhead = 12;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i + kAhead < order.size()) __builtin_prefetch(&sides_[order[i + kAhead].side]);
    const Side& side = sides_[order[i].side];
    if (!wanted(side)) continue;
    const Eigen::Vector3f position = this->position(order[i].key, side).cast<float>();
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
