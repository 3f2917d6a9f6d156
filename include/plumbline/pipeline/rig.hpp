// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// rig.yaml: cameras that are fixed to each other on one robot (docs/guide/several_robots.md).
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::pipeline {

/// A camera of a rig, as the file gives it. Position and rotation are reference_from_camera of the colour
/// cameras' optical frames; what is not given is found from the paths.
struct RigCamera {
  std::string name;  ///< of the robot
  std::optional<Eigen::Vector3d> position;
  std::optional<Eigen::Quaterniond> rotation;
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Constant(0.005);  ///< axes of the reference camera
  Eigen::Vector3d sigma_rad = Eigen::Vector3d::Constant(0.01);
  bool find = false;                    ///< what is given only starts the search, with its sigma
  std::optional<double> time_offset_s;  ///< reference stamp = stamp + offset; none: it is found

  [[nodiscard]] bool given() const { return position && rotation && !find; }
};

struct Rig {
  std::filesystem::path file;
  std::vector<RigCamera> cameras;  ///< the first one is the reference
};

/// Errors (kInput): it cannot be read; (kUsage) all problems of its contents.
core::Result<Rig> read_rig(const std::filesystem::path& file);

/// The rig of a run of these robots; none if `file` is empty. Errors as read_rig; (kUsage) there is one robot
/// only, or none of a camera's name.
core::Result<std::optional<Rig>> rig_of_run(const std::filesystem::path& file,
                                            const std::vector<maps::RobotInfo>& robots);

}  // namespace plumbline::pipeline
