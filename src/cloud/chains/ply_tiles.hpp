// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Points of PLY files, distributed to one file for each tile of space.
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "io/ply_header.hpp"

namespace plumbline::cloud {

/// Which tile of a grid: its corner with the smallest coordinates, in tiles.
using TileKey = std::array<std::int64_t, 3>;

/// The tile of a position, metres.
inline TileKey tile_of(const Eigen::Vector3d& position, double tile_m) {
  TileKey key{};
  for (Eigen::Index k = 0; k < 3; ++k)
    key[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::floor(position[k] / tile_m));
  return key;
}

class PlyTiles {
 public:
  /// `folder` exists and is empty. Points within `margin_m` of a tile belong to its file, too.
  PlyTiles(std::filesystem::path folder, double tile_m, double margin_m)
      : folder_(std::move(folder)), tile_m_(tile_m), margin_m_(margin_m) {}

  /// Distributes all points of a file. Errors as filter_in_tiles.
  core::Result<void> add(const std::filesystem::path& file);
  /// To be called after the last file: writes what is left and completes the headers.
  core::Result<void> finish();

  [[nodiscard]] std::size_t points() const { return points_; }
  [[nodiscard]] std::vector<TileKey> keys() const;
  [[nodiscard]] std::size_t points_of(const TileKey& key) const { return tiles_.at(key).points; }
  [[nodiscard]] std::filesystem::path file_of(const TileKey& key) const;
  /// Subtracted from coordinates that have more digits than a float, whole metres near their middle; else
  /// zero.
  [[nodiscard]] Eigen::Vector3d shift() const;

 private:
  struct Tile {
    std::size_t points = 0;
    std::vector<std::uint8_t> waiting;  ///< records that are not written yet
  };
  core::Result<void> take_layout(const std::filesystem::path& file, const PlyHeader& header);
  [[nodiscard]] double coordinate(const std::uint8_t* record, std::size_t axis) const;
  void sample(const std::uint8_t* record);
  void put(const std::uint8_t* record);
  core::Result<void> write_waiting();
  [[nodiscard]] std::string header(std::size_t points) const;

  std::filesystem::path folder_;
  double tile_m_;
  double margin_m_;
  PlyFormat format_ = PlyFormat::kLittleEndian;
  std::vector<PlyProperty> properties_;
  std::array<std::size_t, 3> offset_{};  ///< of x, y and z in a record
  std::array<ScalarType, 3> position_type_{};
  std::size_t record_size_ = 0;
  std::map<TileKey, Tile> tiles_;
  std::size_t waiting_ = 0;  ///< bytes of all tiles
  std::size_t points_ = 0;
  std::array<std::vector<double>, 3> sample_;  ///< coordinates of a thousand points of the first file
};

}  // namespace plumbline::cloud
