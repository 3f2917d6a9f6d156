// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Filter chains on clouds that do not fit into memory: cut into tiles, which are filtered one after another.
#include <cstddef>
#include <filesystem>
#include <functional>
#include <vector>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/cloud/io/frame.hpp"

namespace plumbline::cloud {

/// A cloud in one or several files, and the file of its filtered points.
struct TiledFiles {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path output;  ///< .ply
};

struct TiledReport {
  std::size_t points_in = 0;  ///< with finite coordinates
  std::size_t points_out = 0;
  std::size_t tiles = 0;
  std::size_t fullest = 0;  ///< points of the fullest tile, with those around it that decide about its own
};

/// The frame that the header of a PLY file tells; an unknown one if it tells none, or cannot be read.
CloudFrame frame_of_ply(const std::filesystem::path& file);

/// Runs `chain` on the inputs, one cloud, and writes the output. The same points as without tiles,
/// ordered by tile. Memory depends on the fullest tile; about twice the size of the inputs is needed on the
/// disk of the output until it is written. `tile_m`: edge length of a tile, metres. `frame`: of the inputs.
/// `progress`: tiles done, and all. Errors: kUsage if a filter of the chain needs the whole cloud
/// (Filter::reach_m), or tiles are not larger than four times what a point's neighbours reach; kInput if an
/// input is not a binary PLY file of points, or has other properties than the first; kOutput. A stopped or
/// failed call leaves nothing behind.
core::Result<TiledReport> filter_in_tiles(const FilterChain& chain, const TiledFiles& files, double tile_m,
                                          CloudFrame& frame, const core::Executor* executor,
                                          const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace plumbline::cloud
