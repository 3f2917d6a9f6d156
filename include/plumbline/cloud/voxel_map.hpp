// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Many views fused in hashed voxels. The cost of a view depends on its own points only, never on the map's
// size.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::cloud {

struct VoxelMapOptions {
  double voxel_m = 0.01;           ///< edge length
  double min_cos_incidence = 0.1;  ///< measurements seen more obliquely are not inserted

  void declare(core::OptionTable& table);
};

struct VoxelExtractOptions {
  int min_observations = 1;  ///< views that must have seen a voxel

  void declare(core::OptionTable& table);
};

/// A fused cloud and what is known of each of its points.
struct FusedCloud {
  CloudPtr cloud;
  CloudColumns columns;         ///< observations and confidence (weight / (weight + 1)) of each point
  std::vector<float> spread_m;  ///< standard deviation of the measurements along the normal
  std::vector<float> weight;    ///< sum over the measurements, see VoxelMap
  std::vector<float> noise_m;   ///< standard deviation that the sensor's noise lets one measurement have
};

/// A voxel keeps the weighted means of position, normal and colour of its measurements; the weight is
/// cos(incidence) / sigma_z(z)^2, 1 for a measurement at 1 m face on. A voxel has two sides: measurements
/// whose normals oppose each other (a thin wall seen from both rooms) are never averaged. Deterministic: the
/// same inserts in the same order give the same bytes.
class VoxelMap {
 public:
  explicit VoxelMap(const VoxelMapOptions& options = {});

  /// Fuses one view. `camera_cloud` is in the camera frame (z along the optical axis gives the depth noise);
  /// points that are not finite are passed over, points without normal count half and take the side they are
  /// seen from. One call is one observation of every voxel it touches.
  /// Points outside of `region` (world; null: everywhere) are passed over.
  void insert(const Cloud& camera_cloud, const geometry::Rigid3& world_from_cloud,
              const Eigen::AlignedBox3d* region = nullptr);

  /// Fuses a finished map, weights and observations included: local maps into the global one.
  void merge(const VoxelMap& other, const geometry::Rigid3& this_from_other);
  /// The same for points that an extract() gave and that moved since.
  void merge(const FusedCloud& points);

  /// Points in the order of their voxel (x, then y, then z, front before back); `curvature` is 0.
  [[nodiscard]] FusedCloud extract(const VoxelExtractOptions& options = {}) const;

  [[nodiscard]] std::size_t size() const { return sides_.size(); }  ///< occupied voxel sides
  [[nodiscard]] std::size_t bytes() const;                          ///< memory held
  [[nodiscard]] std::size_t dropped() const {
    return dropped_;
  }  ///< points beyond +-2^20 voxels of the origin
  [[nodiscard]] double voxel_m() const { return options_.voxel_m; }
  void clear();

 private:
  /// Running weighted means of one side of one voxel.
  struct Side {
    std::uint64_t key = 0;          ///< voxel and side, ordered as the output
    Eigen::Vector3f mean{0, 0, 0};  ///< metres from the voxel's centre
    Eigen::Vector3f normal{0, 0,
                           0};       ///< weighted sum; while none is known, the direction to the first camera
    Eigen::Vector3f color{0, 0, 0};  ///< weighted mean, 0-255
    float weight = 0.0F;
    float scatter = 0.0F;   ///< weighted sum of squared distances from the mean along the normal
    float variance = 0.0F;  ///< weighted sum of the sensor's variance of the measurements
    std::uint32_t observations = 0;
    std::uint32_t last_view = 0;
    std::uint32_t last_observations : 31;  ///< what the last view added
    std::uint32_t normal_known : 1;

    Side() : last_observations(0), normal_known(0) {}
  };
  struct Sample;

  /// Finds the sample's voxel; false (and counted) when it is out of reach.
  bool locate(const Eigen::Vector3d& position, Sample& sample);
  void add_all(const std::vector<Sample>& samples);
  void add(const Sample& sample);
  [[nodiscard]] std::size_t home(std::uint64_t key) const;
  Side* find_or_add(std::uint64_t key);
  void grow();
  [[nodiscard]] Eigen::Vector3d position(const Side& side) const;

  VoxelMapOptions options_;
  std::vector<Side> sides_;
  std::vector<std::uint32_t> table_;  ///< open addressing, linear probing: index into sides_ + 1, 0 = free
  std::uint32_t view_ = 0;
  std::size_t dropped_ = 0;
};

}  // namespace plumbline::cloud
