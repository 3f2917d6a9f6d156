// SPDX-License-Identifier: BSD-3-Clause
#include "scene/rig.hpp"

#include "plumbline/core/config.hpp"

namespace plumbline::synth {

geometry::Rigid3 body_from_camera() {
  Eigen::Matrix3d r;
  r << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {r, Eigen::Vector3d::Zero()};
}

core::Result<std::vector<geometry::Rigid3>> read_rig(const SynthOptions& options) {
  if (options.rig.empty()) return std::vector<geometry::Rigid3>{body_from_camera()};
  if (options.robots > 1) return core::usage_error("rig: is the cameras of one robot; leave robots out");
  const auto root = core::read_yaml(options.rig);
  if (!root) return tl::unexpected<core::Error>(root.error());
  const core::ConfigNode* list = root->find("cameras");

  // Problems are collected, to report all at once.
  core::ConfigProblems problems;
  std::vector<geometry::Rigid3> cameras;
  if (list == nullptr || list->items.empty() || list->items.size() > 16) {
    problems.push_back({root->mark, "cameras", "is missing (allowed: a list of 1 to 16 cameras)"});
    return tl::unexpected<core::Error>(core::to_error(problems));
  }

  // Place and direction of each camera.
  for (const core::ConfigNode& item : list->items) {
    std::vector<double> at(3, 0.0);
    double yaw = 0.0, pitch = 0.0, roll = 0.0;
    core::OptionTable table;
    table.numbers("at", at, 3, {-5.0, 5.0}, "m", "Place on the body");
    table.number("yaw", yaw, {-7.0, 7.0}, "rad", "To the left");
    table.number("pitch", pitch, {-1.6, 1.6}, "rad", "Upwards");
    table.number("roll", roll, {-7.0, 7.0}, "rad", "To the right about the viewing direction");
    table.set_all(item, "cameras", problems);
    if (at.size() != 3) continue;

    // Body: x ahead, y to the left, z up.
    const Eigen::Quaterniond turn = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(-pitch, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
    cameras.push_back(geometry::Rigid3(turn, {at[0], at[1], at[2]}) * body_from_camera());
  }

  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return cameras;
}

int recordings(const SynthOptions& options) {
  if (options.rig.empty()) return options.robots;
  const auto cameras = read_rig(options);
  return cameras ? static_cast<int>(cameras->size()) : 1;
}

}  // namespace plumbline::synth
