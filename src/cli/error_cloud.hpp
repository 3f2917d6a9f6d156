// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A cloud coloured by its error, as a file and as a picture.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/evaluate/surface.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::cli {

/// Evidence of which way is up in the picture.
struct ErrorView {
  std::vector<geometry::Trajectory> cameras;  ///< in the frame of the cloud
  std::optional<Eigen::Vector3d> up;          ///< none: estimated from the cameras and the floor
};

/// Writes <file>.ply: float x y z [nx ny nz] error (metres), and colours; <file>.png: a picture of it with a
/// colour bar in millimetres. Colours reach from 0 to the 98th percentile of the error, rounded up. The
/// folder is made if missing. `error_m`: one per point, NaN = not measured; the cloud's frame goes into the
/// file. Errors: kOutput.
core::Result<void> write_error_cloud(const std::filesystem::path& file, const std::string& title,
                                     const evaluate::SurfaceSamples& cloud, const std::vector<float>& error_m,
                                     const ErrorView& view);

}  // namespace plumbline::cli
