// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Points as few bytes: whole steps of a grid in Morton order, in levels of detail, each level in chunks that
// are read and drawn by themselves. viz/viewer/README.md has the form.
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "plumbline/viewer/scene.hpp"

namespace plumbline::viewer {

/// Up to kChunk points of one level that are near each other.
struct Chunk {
  int level = 0;
  std::size_t count = 0;
  std::array<std::uint16_t, 3> low{}, high{};  ///< its extent, in steps of the grid
  std::string points;                          ///< place and colour, packed
  std::string normals;                         ///< packed; empty: the cloud has none
  std::vector<std::string> layers;             ///< packed, in the order of Points::layers
};

struct EncodedCloud {
  std::array<double, 3> origin{};  ///< origin of the grid, in the frame that is shown
  double step_m = 0.002;           ///< step of the grid, metres
  std::vector<double> spacing_m;   ///< mean distance of neighbours in each level with those before
  std::vector<Chunk> chunks;       ///< by level, then in Morton order
};

/// `z_up` as Scene::z_up: else y becomes -z and z becomes y, so that up is z.
EncodedCloud encode(const Points& points, bool z_up);

/// A place in the frame that is shown.
Eigen::Vector3d shown(const Eigen::Vector3d& place, bool z_up);

}  // namespace plumbline::viewer
