// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A cloud as a mesh.
#include <filesystem>

#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::cloud {

struct MeshOptions {
  double resolution_m = 0.02;  ///< edge length of the mesh; finer ones are not better
  double reach_m = 0.05;       ///< surface farther than this from every point was not seen and is left out

  void declare(core::OptionTable& table);
};

/// Poisson surface reconstruction (Kazhdan et al., SGP 2006; PCL's) of the points with normals; surface that
/// it adds where nothing was seen is cut off again. Vertices have x y z, nx ny nz, red green blue. Same
/// cloud, same mesh. Errors (kUsage): fewer than 100 points with normals; an extent that `resolution_m` cuts
/// into more than 2^12 cells a side, with the resolution that is possible.
core::Result<PlyData> make_mesh(const Cloud& cloud, const MeshOptions& options = {});

/// .ply, or .obj: Wavefront text with colours behind the coordinates, as MeshLab and Blender read them.
/// Another ending is a kUsage error. The file appears whole or not at all.
core::Result<void> write_mesh(const std::filesystem::path& file, const PlyData& mesh);

}  // namespace plumbline::cloud
