// SPDX-License-Identifier: BSD-3-Clause
// A view's measurements, voxel by voxel.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "plumbline/cloud/view_points.hpp"
#include "plumbline/cloud/voxel_map.hpp"
#include "plumbline/core/clones.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "view_voxels.hpp"
#include "voxel_sample.hpp"

namespace plumbline::cloud {
namespace {

/// So many points are worked on at a time.
constexpr std::size_t kBlock = 256;

/// What is known of points before it is asked which voxels they share.
struct Measured {
  std::array<float, kBlock> normal_x, normal_y, normal_z;  ///< world; or direction to the camera
  std::array<float, kBlock> weight, variance;
  std::array<std::array<float, kBlock>, 3> offset;        ///< metres from the voxel's centre
  std::array<std::array<std::int32_t, kBlock>, 3> voxel;  ///< each axis
  std::array<std::uint32_t, kBlock> known;                ///< whether there is a normal
  std::array<std::uint32_t, kBlock> kept;                 ///< a measurement, and not too oblique
  std::array<std::uint32_t, kBlock> reached;              ///< within +-2^20 voxels of the origin
};

struct Frame {
  std::array<float, 9> rotation;  ///< world from camera, row after row
  std::array<double, 3> translation;
  double voxel_m;
  float least_cosine;
};

/// All of a block at once, without branches.
PLUMBLINE_CLONES void measure(const float* x, const float* y, const float* z, const float* normal_x,
                              const float* normal_y, const float* normal_z, std::size_t count,
                              const Frame& frame, Measured& to) {
  const double unit = sensor::depth_sigma(1.0);
  const double per_m = 1.0 / frame.voxel_m;
  const double voxel_m = frame.voxel_m;
  const float least = frame.least_cosine;
  const std::array<float, 9> r = frame.rotation;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < count; ++i) {
    const float px = x[i], py = y[i], pz = z[i];
    const float back = -1.0F / std::sqrt(px * px + (py * py + pz * pz));
    const float tx = px * back, ty = py * back, tz = pz * back;
    const float nx = normal_x[i], ny = normal_y[i], nz = normal_z[i];
    const float squared = nx * nx + (ny * ny + nz * nz);
    const bool known = (squared > 0.25F) & (squared < kInfinity);
    const float unit_length = 1.0F / std::sqrt(squared);
    const float ux = known ? nx * unit_length : tx;
    const float uy = known ? ny * unit_length : ty;
    const float uz = known ? nz * unit_length : tz;
    const float along = std::abs(ux * tx + (uy * ty + uz * tz));
    const float cosine = known ? along : 0.5F;
    const bool finite = (std::abs(px) < kInfinity) & (std::abs(py) < kInfinity) & (std::abs(pz) < kInfinity);
    to.known[i] = known ? 1U : 0U;
    to.kept[i] = finite & (pz > 0.0F) & !(known & (cosine < least)) ? 1U : 0U;
    const double sigma = sensor::depth_sigma(static_cast<double>(pz));
    const double ratio = unit / sigma;
    const float weight = (cosine > 1e-3F ? cosine : 1e-3F) * static_cast<float>(ratio * ratio);
    to.weight[i] = weight;
    to.variance[i] = weight * static_cast<float>(sigma * sigma);
    to.normal_x[i] = r[0] * ux + (r[1] * uy + r[2] * uz);
    to.normal_y[i] = r[3] * ux + (r[4] * uy + r[5] * uz);
    to.normal_z[i] = r[6] * ux + (r[7] * uy + r[8] * uz);
  }
  for (std::size_t i = 0; i < count; ++i) to.reached[i] = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float a = r[3 * axis], b = r[3 * axis + 1], c = r[3 * axis + 2];
    const double origin = frame.translation[axis];
    float* offset = to.offset[axis].data();
    std::int32_t* voxel = to.voxel[axis].data();
    constexpr auto kReach = static_cast<double>(kHalf);
    for (std::size_t i = 0; i < count; ++i) {
      // What may be far from the origin is added in double precision.
      const double position = origin + static_cast<double>(a * x[i] + (b * y[i] + c * z[i]));
      const double at = position * per_m;
      const bool within = (at >= -kReach) & (at < kReach);
      const double safe = within ? at : 0.0;
      // A cast and a step: there is no instruction for floor() on every machine.
      const auto truncated = static_cast<std::int32_t>(safe);
      const std::int32_t cell = truncated - (safe < static_cast<double>(truncated) ? 1 : 0);
      voxel[i] = cell;
      offset[i] = static_cast<float>(position - (static_cast<double>(cell) + 0.5) * voxel_m);
      to.reached[i] &= within ? 1U : 0U;
    }
  }
}

std::uint64_t key_of(const Measured& from, std::size_t i) {
  std::uint64_t key = 0;
  for (const auto& axis : from.voxel)
    key = key << kAxisBits | static_cast<std::uint64_t>(std::int64_t{axis[i]} + kHalf);
  return key << 1;
}

}  // namespace

void VoxelMap::sample(const ViewPoints& points, const geometry::Rigid3& world_from_cloud,
                      const VoxelMapOptions& options, std::uint8_t robot, ViewVoxels& voxels,
                      ViewSamples& view) {
  Frame frame{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      frame.rotation[static_cast<std::size_t>(3 * row + column)] =
          static_cast<float>(world_from_cloud.rotation(row, column));
    }
    frame.translation[static_cast<std::size_t>(row)] = world_from_cloud.translation[row];
  }
  frame.voxel_m = options.voxel_m;
  frame.least_cosine = static_cast<float>(options.min_cos_incidence);
  Measured measured;
  view.dropped = 0;
  voxels.begin(view.samples);
  VoxelSample one;
  for (std::size_t first = 0; first < points.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, points.size() - first);
    measure(points.x.data() + first, points.y.data() + first, points.z.data() + first,
            points.normal_x.data() + first, points.normal_y.data() + first, points.normal_z.data() + first,
            count, frame, measured);
    for (std::size_t i = 0; i < count; ++i) {
      if (measured.kept[i] == 0) continue;
      if (measured.reached[i] == 0) {
        ++view.dropped;
        continue;
      }
      one.key = key_of(measured, i);
      for (std::size_t axis = 0; axis < 3; ++axis)
        one.offset[static_cast<int>(axis)] = measured.offset[axis][i];
      one.normal = {measured.normal_x[i], measured.normal_y[i], measured.normal_z[i]};
      one.normal_known = measured.known[i] & 1U;
      one.color = Eigen::Vector3f(points.r[first + i], points.g[first + i], points.b[first + i]);
      one.weight = measured.weight[i];
      one.variance = measured.variance[i];
      voxels.take_up(one, robot);
    }
  }
}

ViewSamples VoxelMap::sampled(const Cloud& camera_cloud, const geometry::Rigid3& world_from_cloud,
                              const VoxelMapOptions& options, std::uint8_t robot) {
  ViewPoints points;
  take_points(camera_cloud, points);
  ViewVoxels voxels;
  ViewSamples view;
  sample(points, world_from_cloud, options, robot, voxels, view);
  return view;
}

}  // namespace plumbline::cloud
