// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pieces of surface of a fused cloud: what makes walls thin, and what free space is judged by.
//
// A voxel much smaller than the sensor's noise averages little: a wall seen from afar becomes a slab of
// voxels. Points that face the same way within a small block form a sheet; sheets of neighbouring blocks are
// taken together as long as one plane explains their points within the noise, and points come to lie on the
// plane.
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/voxel_map.hpp"

namespace plumbline::cloud {

/// Points of one block that face the same way (within 45 degrees of their mean). Plain sums, metres from
/// the block's centre.
struct Sheet {
  Eigen::Vector3i block{0, 0, 0};
  Eigen::Vector3f normal_sum{0, 0, 0};
  float normal_length = 0.0F;      ///< of normal_sum; set by fit_planes()
  Eigen::Vector3f first{0, 0, 0};  ///< weighted sum of positions
  Eigen::Matrix3f second;          ///< weighted sum of their outer products
  float weight = 0.0F;
  float variance = 0.0F;  ///< weighted sum of what the sensor's noise explains, m^2
  float scatter = 0.0F;   ///< weighted sum of squared spreads within voxels, m^2
  std::uint32_t points = 0;

  // What fit_planes() finds: the plane normal . (p - origin) = 0 of this sheet and its surroundings.
  Eigen::Vector3f origin{0, 0, 0};  ///< metres from the block's centre
  Eigen::Vector3f normal{0, 0, 0};  ///< unit
  float noise_m = 0.0F;             ///< standard deviation of one measurement
  float residual2 = 0.0F;           ///< mean squared distance from the plane, m^2
  float noise2 = 0.0F;              ///< what the sensor model lets expect of it, m^2
  std::uint32_t support = 0;        ///< points of the surroundings that face the same way, its own included
  bool flat = false;                ///< the plane explains the points within the noise

  Sheet() : second(Eigen::Matrix3f::Zero()) {}
};

/// The sheets of a cloud in blocks of `block_m`; points without normal belong to none.
class Sheets {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  Sheets(const FusedCloud& points, double block_m);

  [[nodiscard]] const std::vector<Sheet>& all() const { return sheets_; }
  /// Sheet of point `i` of the cloud, or kNone.
  [[nodiscard]] std::uint32_t of(std::size_t i) const { return sheet_of_[i]; }
  [[nodiscard]] double block_m() const { return block_m_; }
  [[nodiscard]] Eigen::Vector3d centre(const Eigen::Vector3i& block) const {
    return (block.cast<double>().array() + 0.5) * block_m_;
  }
  /// Mean position of a sheet's points, metres.
  [[nodiscard]] Eigen::Vector3d position(const Sheet& sheet) const;

  /// Blocks are kept in bricks of kBrick x kBrick x kBrick; only bricks that hold something exist.
  static constexpr int kBrick = 8;
  [[nodiscard]] std::size_t brick_count() const { return bricks_.size(); }
  /// Place of a brick, in bricks.
  [[nodiscard]] const Eigen::Vector3i& brick(std::size_t b) const { return bricks_[b].place; }
  /// Number of the brick at a place, in bricks; kNone where there is none.
  [[nodiscard]] std::uint32_t brick_at(const Eigen::Vector3i& place) const;
  [[nodiscard]] static Eigen::Vector3i brick_of(const Eigen::Vector3i& block) {
    return {block.x() >> kBrickBits, block.y() >> kBrickBits, block.z() >> kBrickBits};
  }

  /// visit(index into all()) for the sheets of the blocks from `low` to `high`, both included, of one brick.
  template <typename Visit>
  void visit_in_brick(std::size_t b, const Eigen::Vector3i& low, const Eigen::Vector3i& high,
                      const Visit& visit) const {
    const Eigen::Vector3i origin = bricks_[b].place * kBrick;
    const Eigen::Vector3i from = (low - origin).cwiseMax(0);
    const Eigen::Vector3i to = (high - origin).cwiseMin(kBrick - 1);
    for (int x = from.x(); x <= to.x(); ++x) {
      for (int y = from.y(); y <= to.y(); ++y) {
        for (int z = from.z(); z <= to.z(); ++z) {
          for (std::uint32_t s = bricks_[b].first[cell_of({x, y, z})]; s != kNone; s = next_[s]) visit(s);
        }
      }
    }
  }

  /// Finds the planes: over all 27 blocks around if one plane explains them, else over the sheet alone.
  void fit_planes();
  /// Moves the points of flat sheets along their normals to the planes, which are blended between blocks, and
  /// gives them the planes' normals.
  void settle(FusedCloud& points) const;

 private:
  static constexpr int kBrickBits = 3;
  static_assert(kBrick == 1 << kBrickBits);
  struct Brick {
    Eigen::Vector3i place{0, 0, 0};
    std::array<std::uint32_t, kBrick * kBrick * kBrick> first;  ///< sheet of each block, or kNone
  };
  /// The sheets of a brick's blocks and of those around it: kHalo x kHalo x kHalo, x first.
  static constexpr int kHalo = kBrick + 2;
  using Halo = std::array<std::uint32_t, kHalo * kHalo * kHalo>;
  /// The brick found last: the next question mostly is about the same one.
  struct Cursor {
    Eigen::Vector3i place{0, 0, 0};
    std::uint32_t brick = kNone;
    bool valid = false;
  };
  /// Of a block within its brick.
  static std::size_t cell_of(const Eigen::Vector3i& block) {
    constexpr int kMask = kBrick - 1;
    return static_cast<std::size_t>(((block.x() & kMask) << kBrickBits | (block.y() & kMask)) << kBrickBits |
                                    (block.z() & kMask));
  }
  /// Of a block that lies `step` blocks (-1 to 1 each axis) from one of the brick.
  static std::size_t halo_cell_of(const Eigen::Vector3i& in_brick) {
    return static_cast<std::size_t>((in_brick.x() + 1) * kHalo * kHalo + (in_brick.y() + 1) * kHalo +
                                    in_brick.z() + 1);
  }
  [[nodiscard]] Halo halo_of(std::size_t brick) const;
  /// Where the first sheet of a block is noted; made if need be.
  std::uint32_t& slot(const Eigen::Vector3i& block, Cursor& cursor);
  void note(std::uint32_t brick);  ///< in the table
  void add(const FusedCloud& points, std::size_t i, Cursor& cursor);
  template <typename Visit>
  void visit_alike(std::uint32_t first, const Eigen::Vector3f& normal, const Visit& visit) const;
  /// Over the sheet and what is around it.
  void fit_plane(Sheet& sheet, const Eigen::Vector3i& in_brick, const Halo& halo) const;
  /// Plane of a weighted set of points; false when there are too few.
  static bool set_plane(const Sheet& sums, Sheet& sheet);
  [[nodiscard]] bool explained(const Sheet& sheet) const;
  /// How noisy the points really are: residuals of the surroundings, the middle one, over what the sensor
  /// model lets expect; a generous upper limit, 0 to 1. Exact depth must not be flattened.
  void measure_noise();

  double block_m_;
  float noise_share_ = 1.0F;
  std::vector<Sheet> sheets_;
  std::vector<std::uint32_t> next_;      ///< next sheet of the same block
  std::vector<std::uint32_t> sheet_of_;  ///< by point
  std::vector<std::uint32_t> brick_of_;  ///< by sheet
  std::vector<Brick> bricks_;
  std::vector<Halo> halos_;           ///< by brick; of fit_planes()
  std::vector<std::uint32_t> table_;  ///< open addressing by place: brick, or kNone
};

}  // namespace plumbline::cloud
