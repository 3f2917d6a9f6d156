// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Occupancy grid of a growing map: a scan per keyframe, drawn again where its keyframe has moved.
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "plumbline/dataset/ros_messages.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::net {

/// Frame: z up, its floor at z = 0, metres. Not thread-safe.
class LiveGrid {
 public:
  struct Options {
    double resolution_m = 0.05;
    double low_m = 0.1;  ///< obstacles reach between these heights
    double high_m = 1.8;
  };

  /// A message to send: the whole grid, or the part of it in which anything was sent since the whole was.
  struct Change {
    bool whole = false;
    dataset::GridCells cells;
  };

  explicit LiveGrid(const Options& options) : options_(options) {}

  /// The surface that a keyframe saw, `points` in the map's frame; points that are not finite are ignored.
  void add(double stamp, const geometry::Rigid3& map_from_camera, const std::vector<Eigen::Vector3f>& points);

  /// Keyframes' poses as they are now; a scan that has moved by half a cell or half a degree is drawn again.
  void move(const geometry::Trajectory& map_from_camera);

  /// The cells that changed since the last whole grid; empty: none since the last call. Memory of the grid's
  /// size.
  std::optional<Change> take();

 private:
  static constexpr std::size_t kReach = 128;  ///< cells of a beam

  /// Cells along one direction from the camera.
  struct Beam {
    float bearing = 0.0F;  ///< from the camera's direction, radians
    std::uint8_t free_from = 0;
    std::uint8_t free_to = 0;  ///< one past the last
    std::array<std::uint64_t, kReach / 64> hits{};
  };
  struct Scan {
    Eigen::Vector2d at = Eigen::Vector2d::Zero();
    double yaw = 0.0;
    std::vector<Beam> beams;
  };
  /// Scans that saw a cell free, and occupied.
  struct Cell {
    std::uint16_t free = 0;
    std::uint16_t occupied = 0;
  };

  [[nodiscard]] std::vector<Beam> beams_of(const Scan& scan,
                                           const std::vector<Eigen::Vector3f>& points) const;
  void draw(const Scan& scan, int sign);
  void make_room(const Scan& scan);
  [[nodiscard]] std::uint8_t value(std::size_t cell) const;
  [[nodiscard]] std::size_t cell_at(const Eigen::Vector2d& place) const;

  Options options_;
  std::map<double, Scan> scans_;                    ///< by stamp
  Eigen::Vector2i low_ = Eigen::Vector2i::Zero();   ///< first column and row, counted from the map's origin
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();  ///< columns, rows
  std::vector<Cell> cells_;
  std::vector<std::uint8_t> marks_;  ///< of the scan that is drawn: 0 untouched, 1 free, 2 occupied
  std::vector<std::uint8_t> sent_;   ///< values at the last take; empty: none of this size
  Eigen::AlignedBox2i part_;         ///< cells (column, row) that were taken since the last whole grid
};

}  // namespace plumbline::net
