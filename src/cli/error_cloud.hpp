// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A cloud coloured by its error, as a file and as a picture.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/evaluate/surface.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::cli {

/// Writes <file>.ply: float x y z [nx ny nz] error (metres), and colours; <file>.png: a picture of it with a
/// colour bar in millimetres. Colours reach from 0 to the 98th percentile of the error, rounded up. The
/// folder is made if missing. `error_m`: one per point, NaN = not measured; `cameras`: in the frame of the
/// cloud, to find out which way is up. Errors: kOutput.
core::Result<void> write_error_cloud(const std::filesystem::path& file, const std::string& title,
                                     const evaluate::SurfaceSamples& cloud, const std::vector<float>& error_m,
                                     const std::vector<geometry::Trajectory>& cameras);

}  // namespace plumbline::cli
