// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Many views fused in hashed voxels. The cost of a view depends on its own points only, never on the map's
// size.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "plumbline/cloud/chunks.hpp"
#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::cloud {

struct VoxelMapOptions {
  double voxel_m = 0.01;           ///< edge length
  double min_cos_incidence = 0.1;  ///< measurements seen more obliquely are not inserted
  bool robots = false;             ///< keep count of whose measurements they are; no option of a stage

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
  /// Of columns.robot (empty: one robot): by how many measurements it is ahead of the others.
  std::vector<std::uint32_t> robot_lead;
};

/// What one view measured in one side of a voxel, or a fused side of another map, in the frame of the map
/// that it goes to.
struct VoxelSample {
  std::uint64_t key = 0;            ///< of its voxel
  Eigen::Vector3f offset{0, 0, 0};  ///< metres from the voxel's centre
  Eigen::Vector3f normal{0, 0, 0};  ///< weighted sum of normals, or of directions to the camera
  Eigen::Vector3f color{0, 0, 0};   ///< 0-255
  float weight = 0.0F;
  float scatter = 0.0F;            ///< weighted sum of squared distances along the normal within it
  float variance = 0.0F;           ///< weighted sum of the sensor's variance
  std::uint32_t observations = 1;  ///< views it stands for
  std::uint32_t robot_lead : 23;   ///< measurements it stands for, less those of other robots
  std::uint32_t robot : 8;         ///< that measured it
  std::uint32_t normal_known : 1;

  VoxelSample() : robot_lead(1), robot(0), normal_known(0) {}
};

/// A view's measurements as voxels take them, in the order in which its points come to them.
struct ViewSamples {
  std::vector<VoxelSample> samples;
  std::size_t dropped = 0;  ///< points beyond +-2^20 voxels of the origin
};

class ViewVoxels;
struct ViewPoints;

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

  /// The same in two steps, for views that go to several maps of the same voxels: what insert() makes of the
  /// points of `robot` (0-254), voxel by voxel, and its taking them up. One call of begin_view() is one view.
  static ViewSamples sampled(const Cloud& camera_cloud, const geometry::Rigid3& world_from_cloud,
                             const VoxelMapOptions& options, std::uint8_t robot = 0);
  /// Into `view`, with room that serves for one view after another.
  static void sample(const ViewPoints& points, const geometry::Rigid3& world_from_cloud,
                     const VoxelMapOptions& options, std::uint8_t robot, ViewVoxels& voxels,
                     ViewSamples& view);
  void begin_view() { ++view_; }
  void add(const VoxelSample* samples, std::size_t count);
  /// Of a sample's voxel among voxels, each axis.
  [[nodiscard]] static Eigen::Vector3i voxel_of(const VoxelSample& sample) { return voxel_of(sample.key); }

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
  /// Running weighted means of one side of one voxel: a cache line.
  struct alignas(64) Side {
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
    std::uint32_t robot_lead : 23;  ///< measurements of `robot`, less those of all others
    std::uint32_t robot : 8;        ///< the majority's, where there is one (Boyer and Moore's vote)
    std::uint32_t has_back : 1;     ///< of a voxel's front

    Side() : last_observations(0), normal_known(0), robot_lead(0), robot(0), has_back(0) {}
  };
  static_assert(sizeof(Side) == 64);

  /// 4 x 4 x 4 voxels: neighbours are asked for together.
  static constexpr int kBrick = 4;
  struct Brick {
    std::array<std::uint32_t, kBrick * kBrick * kBrick> fronts{};  ///< index into sides_ + 1, 0: none
  };
  struct Slot {
    std::uint64_t key = 0;    ///< of the brick's first voxel
    std::uint32_t brick = 0;  ///< index into bricks_ + 1, 0: free
  };
  /// In order of voxels (x, then y, then z), front before back.
  struct Place {
    std::uint64_t key = 0;
    std::uint32_t side = 0;  ///< index into sides_
  };

  void add(const VoxelSample& sample, std::uint32_t& front);
  void add_to(Side& side, const VoxelSample& sample) const;
  [[nodiscard]] static Eigen::Vector3i voxel_of(std::uint64_t key);
  [[nodiscard]] std::size_t home(std::uint64_t brick) const;
  [[nodiscard]] std::uint32_t* find(std::uint64_t key);  ///< null: its brick is not there
  std::uint32_t& find_or_add(std::uint64_t key);
  Side& back_of(std::uint32_t front);
  void grow();
  [[nodiscard]] Eigen::Vector3d position(std::uint64_t key, const Side& side) const;
  [[nodiscard]] std::vector<Place> in_order() const;

  VoxelMapOptions options_;
  Chunks<Side> sides_;
  Chunks<Brick, 256> bricks_;
  std::vector<Slot> table_;                                 ///< open addressing, linear probing
  std::unordered_map<std::uint32_t, std::uint32_t> backs_;  ///< of fronts, both by their place in sides_; few
  Slot last_;  ///< found: neighbours in a picture mostly share their brick
  std::uint32_t view_ = 0;
  std::size_t dropped_ = 0;
};

}  // namespace plumbline::cloud
