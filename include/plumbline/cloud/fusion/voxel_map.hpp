// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Many views fused in hashed voxels. The cost of a view depends on its own points only, never on the map's
// size.
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::cloud {

struct VoxelMapOptions {
  double voxel_m = 0.01;           ///< edge length
  double min_cos_incidence = 0.1;  ///< measurements seen more obliquely are not inserted

  void declare(core::OptionTable& table);
};

/// A fused point and its statistics.
struct FusedPoint {
  Point point;
  float weight = 0.0F;             ///< sum over the measurements, see VoxelMap
  float spread_m = 0.0F;           ///< standard deviation of the measurements along the normal
  float noise_m = 0.0F;            ///< standard deviation that the sensor's noise lets one measurement have
  std::uint32_t observations = 0;  ///< views that saw it
  std::uint32_t robot = 0;         ///< robot that measured it most, 0-254
  std::uint32_t robot_lead = 0;    ///< measurements of `robot`, less those of all others
};

/// A fused cloud, its columns observations and confidence (weight / (weight + 1)), and robot if there are
/// several.
struct FusedCloud {
  CloudPtr cloud;
  CloudColumns columns;
};

/// Puts points behind those of `cloud`.
void append(const std::vector<FusedPoint>& points, bool robots, FusedCloud& cloud);

/// Weighted means of the measurements of one side of a voxel, by one view or by many: a cache line.
struct VoxelSide {
  Eigen::Vector3f mean{0, 0, 0};    ///< metres from the voxel's centre
  Eigen::Vector3f normal{0, 0, 0};  ///< weighted sum; while none is known, of directions to the camera
  Eigen::Vector3f color{0, 0, 0};   ///< 0-255
  float weight = 0.0F;
  float scatter = 0.0F;   ///< weighted sum of squared distances from the mean along the normal
  float variance = 0.0F;  ///< weighted sum of the sensor's variance of the measurements
  std::uint32_t observations = 1;
  std::uint32_t last_view = 0;
  std::uint32_t last_observations = 0;  ///< added by the last view
  std::uint32_t robot_lead : 23;        ///< measurements of `robot`, less those of all others
  std::uint32_t robot : 8;              ///< the majority's, where there is one (Boyer and Moore's vote)
  std::uint32_t normal_known : 1;

  VoxelSide() : robot_lead(1), robot(0), normal_known(0) {}
};
static_assert(sizeof(VoxelSide) == 64);

/// Measurement of a voxel.
struct VoxelSample {
  Eigen::Vector3i voxel{0, 0, 0};
  VoxelSide side;
};

/// A voxel keeps the weighted means of position, normal and colour of its measurements; the weight is
/// cos(incidence) / sigma_z(z)^2, 1 for a measurement at 1 m face on. A voxel has two sides: measurements
/// whose normals oppose each other (a thin wall seen from both rooms) are never averaged. Deterministic: the
/// same inserts in the same order give the same bytes.
class VoxelMap {
 public:
  explicit VoxelMap(const VoxelMapOptions& options = {}) : options_(options) {
    places_.max_load_factor(0.8F);  // a small table: inserting is mostly waiting for it
  }

  /// The measurements of one view. `camera_cloud` is in the camera frame (z along the optical axis gives the
  /// depth noise); points that are not finite or beyond +-2^20 voxels of the origin are passed over, points
  /// without normal count half and take the side they are seen from.
  static std::vector<VoxelSample> measured(const Cloud& camera_cloud,
                                           const geometry::Rigid3& world_from_cloud,
                                           const VoxelMapOptions& options, std::uint8_t robot = 0);

  /// Fuses one view: one observation of every voxel it touches.
  void insert(const Cloud& camera_cloud, const geometry::Rigid3& world_from_cloud);
  /// The same for the samples of measured() that lie in `region` (voxels, both ends included).
  void insert(const std::vector<VoxelSample>& view, const Eigen::AlignedBox3i& region);
  /// Fuses points again that were fused before and have moved since. A voxel counts as many observations as
  /// its most seen point. In the order of points().
  static std::vector<FusedPoint> merged(const std::vector<FusedPoint>& points,
                                        const VoxelMapOptions& options);

  /// In the order of their voxel (x, then y, then z), front before back; `curvature` is 0.
  [[nodiscard]] std::vector<FusedPoint> points() const;
  /// The same as a cloud.
  [[nodiscard]] FusedCloud extract() const;

  [[nodiscard]] std::size_t size() const { return sides_.size(); }  ///< occupied voxel sides

 private:
  void add(const VoxelSample& sample);
  VoxelSide& side_at(std::uint64_t key);
  static void combine(const VoxelSide& sample, std::uint32_t view, VoxelSide& side);
  static FusedPoint point_of(std::uint64_t key, const VoxelSide& side, double voxel_m);

  VoxelMapOptions options_;
  std::deque<VoxelSide> sides_;
  CellMap<std::uint32_t> places_;  ///< among the sides, by voxel, the lowest bit the side
  std::pair<std::uint64_t, std::uint32_t> last_{0, 0};  ///< voxel and index of the last look-up
  std::uint32_t view_ = 0;
};

}  // namespace plumbline::cloud
