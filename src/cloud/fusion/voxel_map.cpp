// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/fusion/voxel_map.hpp"

#include <pcl/point_cloud.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "io/scalar.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::cloud {
namespace {

constexpr float kOpposed = -0.2F;  // a fold of up to 100 degrees is still one side
constexpr double kReach = 1 << 20;

/// Finds a sample's voxel; false when it is out of reach.
bool locate(const Eigen::Vector3d& position, double voxel_m, VoxelSample& sample) {
  const Eigen::Vector3d at = position / voxel_m;
  if (!(at.minCoeff() >= -kReach && at.maxCoeff() < kReach)) return false;
  sample.voxel = cell_of(at);
  sample.side.mean =
      (position - ((sample.voxel.cast<double>().array() + 0.5) * voxel_m).matrix()).cast<float>();
  return true;
}

/// True if a sample lies on the other side of a thin wall.
bool opposed(const VoxelSide& sample, const VoxelSide& front) {
  if (!(front.weight > 0.0F)) return false;
  const float along = front.normal.dot(sample.normal);
  return along < 0.0F && along < kOpposed * front.normal.norm() * sample.normal.norm();
}

/// Majority vote on the robot that measured most of the samples (Boyer and Moore).
void vote(const VoxelSide& sample, VoxelSide& side) {
  constexpr std::uint32_t kMost = 0x7FFFFFU;
  if (side.weight == 0.0F) {
    side.robot = sample.robot;
    side.robot_lead = sample.robot_lead;
  } else if (side.robot == sample.robot) {
    side.robot_lead = std::min<std::uint32_t>(kMost, side.robot_lead + sample.robot_lead) & kMost;
  } else if (sample.robot_lead > side.robot_lead) {
    side.robot = sample.robot;
    side.robot_lead = (sample.robot_lead - side.robot_lead) & kMost;
  } else {
    side.robot_lead = (side.robot_lead - sample.robot_lead) & kMost;
  }
}

}  // namespace

void VoxelMapOptions::declare(core::OptionTable& table) {
  table.number("voxel", voxel_m, {0.001, 1.0}, "m", "Edge length of a voxel");
  table.number("min_cos_incidence", min_cos_incidence, {0.0, 1.0}, "",
               "Smallest cosine of incidence of a measurement");
}

std::vector<VoxelSample> VoxelMap::measured(const Cloud& camera_cloud,
                                            const geometry::Rigid3& world_from_cloud,
                                            const VoxelMapOptions& options, std::uint8_t robot) {
  const double unit = sensor::depth_sigma(1.0);
  const auto least_cosine = static_cast<float>(options.min_cos_incidence);
  const Eigen::Matrix3f turn = world_from_cloud.rotation.cast<float>();
  std::vector<VoxelSample> samples;
  samples.reserve(camera_cloud.size());
  VoxelSample sample;
  sample.side.robot = robot;
  VoxelSide& side = sample.side;

  for (const Point& p : camera_cloud.points) {
    if (!(p.z > 0.0F) || !std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;

    // Without normal, the surface faces the camera
    const Eigen::Vector3f position = p.getVector3fMap();
    Eigen::Vector3f normal = p.getNormalVector3fMap();
    const float squared = normal.squaredNorm();
    const bool known = squared > 0.25F && std::isfinite(squared);
    normal = known ? (normal / std::sqrt(squared)).eval() : (-position.normalized()).eval();

    // Depth at grazing incidence is unreliable
    const float cosine = known ? std::abs(normal.dot(position)) / position.norm() : 0.5F;
    if (known && cosine < least_cosine) continue;
    if (!locate(world_from_cloud * position.cast<double>(), options.voxel_m, sample)) continue;

    // Inverse variance of the depth, relative to 1 m
    const double sigma = sensor::depth_sigma(static_cast<double>(p.z));
    const double ratio = unit / sigma;
    side.weight = std::max(cosine, 1e-3F) * static_cast<float>(ratio * ratio);
    side.variance = side.weight * static_cast<float>(sigma * sigma);
    side.normal = side.weight * (turn * normal);
    side.normal_known = known ? 1U : 0U;
    side.color = Eigen::Vector3f(p.r, p.g, p.b);
    samples.push_back(sample);
  }

  return samples;
}

void VoxelMap::insert(const Cloud& camera_cloud, const geometry::Rigid3& world_from_cloud) {
  ++view_;
  for (const VoxelSample& sample : measured(camera_cloud, world_from_cloud, options_)) add(sample);
}

void VoxelMap::insert(const std::vector<VoxelSample>& view, const Eigen::AlignedBox3i& region) {
  ++view_;
  for (const VoxelSample& sample : view) {
    if (region.contains(sample.voxel)) add(sample);
  }
}

/// Points come mostly in the order of their voxels: they are sorted, not looked up.
std::vector<FusedPoint> VoxelMap::merged(const std::vector<FusedPoint>& points,
                                         const VoxelMapOptions& options) {
  constexpr std::uint32_t kOneView = 1;
  std::vector<VoxelSide> samples;
  std::vector<std::pair<std::uint64_t, std::size_t>> order;  // voxel and place among the samples
  samples.reserve(points.size());
  order.reserve(points.size());

  for (const FusedPoint& fused : points) {
    const Point& p = fused.point;
    VoxelSample sample;
    if (!locate(p.getVector3fMap().cast<double>(), options.voxel_m, sample)) continue;

    // A fused point is one sample of its weight
    VoxelSide& side = sample.side;
    const Eigen::Vector3f normal = p.getNormalVector3fMap();
    if (normal.allFinite()) {
      side.normal_known = 1;
      side.normal = fused.weight * normal;
    }

    side.color = Eigen::Vector3f(p.r, p.g, p.b);
    side.weight = fused.weight;
    side.scatter = fused.weight * fused.spread_m * fused.spread_m;
    side.variance = fused.weight * fused.noise_m * fused.noise_m;
    side.observations = fused.observations;
    side.robot = fused.robot & 0xFFU;
    side.robot_lead = fused.robot_lead & 0x7FFFFFU;

    order.emplace_back(pack_cell(sample.voxel) << 1U, samples.size());
    samples.push_back(side);
  }

  // Samples of one voxel next to each other
  std::sort(order.begin(), order.end());
  std::vector<FusedPoint> result;
  result.reserve(samples.size());

  // Both sides of a thin wall may be in one voxel
  for (std::size_t i = 0; i < order.size();) {
    const std::uint64_t key = order[i].first;
    std::array<VoxelSide, 2> sides;
    for (; i < order.size() && order[i].first == key; ++i) {
      const VoxelSide& sample = samples[order[i].second];
      combine(sample, kOneView, sides[opposed(sample, sides[0]) ? 1 : 0]);
    }

    for (std::uint64_t k = 0; k < 2; ++k) {
      if (sides[k].weight > 0.0F) result.push_back(point_of(key | k, sides[k], options.voxel_m));
    }
  }

  return result;
}

VoxelSide& VoxelMap::side_at(std::uint64_t key) {
  // Neighbours in an image mostly share their voxel.
  if (!sides_.empty() && last_.first == key) return sides_[last_.second];
  const auto [found, fresh] = places_.try_emplace(key, static_cast<std::uint32_t>(sides_.size()));
  last_ = {key, found->second};
  return fresh ? sides_.emplace_back() : sides_[found->second];
}

void VoxelMap::add(const VoxelSample& sample) {
  const std::uint64_t front = pack_cell(sample.voxel) << 1U;
  VoxelSide& side = side_at(front);
  combine(sample.side, view_, opposed(sample.side, side) ? side_at(front | 1U) : side);
}

void VoxelMap::combine(const VoxelSide& sample, std::uint32_t view, VoxelSide& side) {
  vote(sample, side);
  const float total = side.weight + sample.weight;
  const float share = sample.weight / total;
  const Eigen::Vector3f apart = sample.mean - side.mean;

  if (side.weight > 0.0F) {
    // West's weighted update of the scatter along the normal known so far.
    const float squared = side.normal.squaredNorm();
    const float distance = apart.dot(side.normal);
    if (squared > 0.0F) side.scatter += distance * distance / squared * side.weight * share;
  }

  // Known normals replace directions to the camera
  if (side.weight == 0.0F || (sample.normal_known != 0 && side.normal_known == 0)) {
    side.normal = sample.normal;
    side.normal_known = sample.normal_known;
  } else if (sample.normal_known != 0) {
    side.normal += sample.normal;
  }

  side.scatter += sample.scatter;
  side.variance += sample.variance;
  side.mean += share * apart;
  side.color += share * (sample.color - side.color);

  // Several samples of one view are one observation; of fused points, those of the most seen one.
  if (side.weight == 0.0F) side.observations = 0;
  if (side.last_view != view) side.last_observations = 0;

  if (sample.observations > side.last_observations) {
    side.observations += sample.observations - side.last_observations;
    side.last_observations = sample.observations;
  }

  side.last_view = view;
  side.weight = total;
}

FusedPoint VoxelMap::point_of(std::uint64_t key, const VoxelSide& side, double voxel_m) {
  const Eigen::Vector3d centre = (unpack_cell(key >> 1U).cast<double>().array() + 0.5) * voxel_m;
  FusedPoint fused;
  Point& p = fused.point;
  p.getVector3fMap() = (centre + side.mean.cast<double>()).cast<float>();

  // A normal only if some sample had one
  const bool known = side.normal_known != 0 && side.normal.squaredNorm() > 0.0F;
  p.getNormalVector3fMap() = known
                                 ? side.normal.normalized().eval()
                                 : Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()).eval();
  p.r = to_byte(static_cast<double>(side.color.x()));
  p.g = to_byte(static_cast<double>(side.color.y()));
  p.b = to_byte(static_cast<double>(side.color.z()));
  p.a = 255;

  // Statistics of the samples
  fused.weight = side.weight;
  fused.spread_m = std::sqrt(side.scatter / side.weight);
  fused.noise_m = std::sqrt(side.variance / side.weight);
  fused.observations = side.observations;
  fused.robot = side.robot;
  fused.robot_lead = side.robot_lead;
  return fused;
}

std::vector<FusedPoint> VoxelMap::points() const {
  // Sorted, since a hash map's order is arbitrary
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(places_.begin(), places_.end());
  std::sort(order.begin(), order.end());
  std::vector<FusedPoint> points;
  points.reserve(order.size());
  for (const auto& [key, place] : order) {
    points.push_back(point_of(key, sides_[place], options_.voxel_m));
  }
  return points;
}

FusedCloud VoxelMap::extract() const {
  FusedCloud cloud{std::make_shared<Cloud>(), {}};
  append(points(), false, cloud);
  return cloud;
}

void append(const std::vector<FusedPoint>& points, bool robots, FusedCloud& cloud) {
  for (const FusedPoint& p : points) {
    cloud.cloud->points.push_back(p.point);
    cloud.columns.observations.push_back(p.observations);

    // Confidence grows from 0 to 1 with the weight
    cloud.columns.confidence.push_back(p.weight / (p.weight + 1.0F));
    if (robots) cloud.columns.robot.push_back(static_cast<std::uint8_t>(p.robot));
  }
  cloud.cloud->width = static_cast<std::uint32_t>(cloud.cloud->size());
  cloud.cloud->height = 1;
  cloud.cloud->is_dense = true;
}

}  // namespace plumbline::cloud
