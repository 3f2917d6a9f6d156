// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Measurements besides the map: lengths, points in world coordinates, levels, plumb lines
// (docs/guide/control.md). Places are those of the map's results, metres, z up.
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/ids.hpp"

namespace plumbline::adjust {

enum class ControlKind {
  kLength,  ///< distance between two places
  kPoint,   ///< world coordinates of a place
  kLevel,   ///< two places of one height
  kPlumb,   ///< two places, one straight above the other
};

struct Control {
  ControlKind kind = ControlKind::kLength;
  std::string name;                                                          ///< for messages
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), q = Eigen::Vector3d::Zero();  ///< q: of pairs
  /// Views of `p` and `q`: keyframes, and the place in their cameras' frames; empty: those whose
  /// surface holds them.
  std::vector<std::pair<core::KeyframeId, Eigen::Vector3d>> seen = {}, seen_q = {};
  double length_m = 0.0;
  Eigen::Vector3d world = Eigen::Vector3d::Zero();  ///< east, north, height
  double sigma_m = 0.005;                           ///< of the measurement, picking included; > 0
  [[nodiscard]] bool pair() const { return kind != ControlKind::kPoint; }
};

/// "x,y,z", metres; `flag` is for messages. Errors (kUsage).
core::Result<Eigen::Vector3d> place_of(const std::string& text, const std::string& flag);
/// P, Q and "4.57m", "457 cm", or "4.57m+-3mm". Errors (kUsage).
core::Result<Control> length_of(const std::array<std::string, 3>& words);
/// P and Q, for kLevel and kPlumb. Errors (kUsage).
core::Result<Control> pair_of(ControlKind kind, const std::array<std::string, 2>& words);
/// A table of points, by line: [name,] x, y, z in the map, E, N, H in the world [, sigma], metres; a line of
/// words may come first. Errors (kInput): file and line.
core::Result<std::vector<Control>> read_points(const std::filesystem::path& file);

}  // namespace plumbline::adjust
