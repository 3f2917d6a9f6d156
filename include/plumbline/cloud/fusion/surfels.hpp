// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pieces of surface of a fused cloud: they make walls thin, and free space is tested against them.
//
// A voxel much smaller than the sensor's noise averages little: a wall seen from afar becomes a slab of
// voxels. Points that face the same way within a small block form a surfel; surfels of neighbouring blocks
// are taken together as long as one plane explains their points within the noise, and points come to lie on
// the plane.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/fusion/voxel_map.hpp"

namespace plumbline::cloud {

/// Points of one block that face the same way (within 45 degrees of their mean). Plain sums, metres from
/// the block's centre.
struct Surfel {
  Eigen::Vector3i block{0, 0, 0};
  Eigen::Vector3f normal_sum{0, 0, 0};
  float normal_length = 0.0F;      ///< length of normal_sum; set by fit_planes()
  Eigen::Vector3f first{0, 0, 0};  ///< weighted sum of positions
  Eigen::Matrix3f second;          ///< weighted sum of their outer products
  float weight = 0.0F;
  float variance = 0.0F;  ///< weighted sum of the sensor's noise variances, m^2
  float scatter = 0.0F;   ///< weighted sum of squared spreads within voxels, m^2
  std::uint32_t points = 0;

  // Results of fit_planes(): the plane normal . (p - origin) = 0 of this surfel and its surroundings.
  Eigen::Vector3f origin{0, 0, 0};  ///< metres from the block's centre
  Eigen::Vector3f normal{0, 0, 0};  ///< unit
  float noise_m = 0.0F;             ///< standard deviation of one measurement
  float residual2 = 0.0F;           ///< mean squared distance from the plane, m^2
  float noise2 = 0.0F;              ///< its variance by the sensor model, m^2
  std::uint32_t support = 0;        ///< points of the surroundings that face the same way, its own included
  bool flat = false;                ///< the plane explains the points within the noise

  Surfel() : second(Eigen::Matrix3f::Zero()) {}
};

/// The surfels of a cloud in blocks of `block_m`; points without normal belong to none.
class Surfels {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  Surfels(const std::vector<FusedPoint>& points, double block_m);

  [[nodiscard]] const std::vector<Surfel>& all() const { return surfels_; }
  /// Surfel of point `i` of the cloud, or kNone.
  [[nodiscard]] std::uint32_t of(std::size_t i) const { return surfel_of_[i]; }
  [[nodiscard]] double block_m() const { return block_m_; }
  [[nodiscard]] Eigen::Vector3d centre(const Eigen::Vector3i& block) const {
    return (block.cast<double>().array() + 0.5) * block_m_;
  }
  /// Mean position of a surfel's points, metres.
  [[nodiscard]] Eigen::Vector3d position(const Surfel& surfel) const;

  /// Finds the planes: over all 27 blocks around if one plane explains them, else over the surfel alone.
  void fit_planes();
  /// Moves the points of flat surfels along their normals to the planes, which are blended between blocks,
  /// and gives them the planes' normals.
  void project(std::vector<FusedPoint>& points) const;

 private:
  void add(const FusedPoint& point, std::uint32_t& surfel_of_point);
  /// First surfel of a block, or kNone.
  [[nodiscard]] std::uint32_t first_of(const Eigen::Vector3i& block) const;
  /// Visits the surfels of a block, from its first one on, that face like `normal`.
  template <typename Visit>
  void visit_alike(std::uint32_t first, const Eigen::Vector3f& normal, const Visit& visit) const;
  /// Fits a plane to the surfel and its surroundings.
  void fit_plane(Surfel& surfel) const;
  /// Plane of a weighted set of points; false when there are too few.
  static bool set_plane(const Surfel& sums, Surfel& surfel);
  [[nodiscard]] bool explained(const Surfel& surfel) const;
  /// Measures the points' real noise: median residual of the surroundings over the sensor model's
  /// expectation; a generous upper limit, 0 to 1. Exact depth must not be flattened.
  void measure_noise();

  double block_m_;
  float noise_share_ = 1.0F;
  std::vector<Surfel> surfels_;
  std::vector<std::uint32_t> next_;       ///< next surfel of the same block
  std::vector<std::uint32_t> surfel_of_;  ///< by point
  CellMap<std::uint32_t> first_;          ///< first surfel of each block
};

}  // namespace plumbline::cloud
