// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A cloud whose colour tells its error, as a file and as a picture.
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::cli {

struct ErrorCloud {
  std::string title;
  std::vector<Eigen::Vector3f> points;        ///< metres
  std::vector<Eigen::Vector3f> normals;       ///< empty, or one a point
  std::vector<float> error_m;                 ///< one a point; NaN = not measured
  std::vector<geometry::Trajectory> cameras;  ///< in the same frame; tells which way is up
};

/// <folder>/<name>.ply: float x y z [nx ny nz] error (metres), and colours; <folder>/<name>.png: a picture of
/// it with a colour bar in millimetres. Colours reach from 0 to the 98th percentile of the error, rounded up.
/// The folder is made if missing. Errors: kOutput.
core::Result<void> write_error_cloud(const ErrorCloud& cloud, const std::filesystem::path& folder,
                                     const std::string& name);

}  // namespace plumbline::cli
