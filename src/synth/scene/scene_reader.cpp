// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plumbline/core/options.hpp"
#include "scene/builder.hpp"
#include "scene/object_reader.hpp"

namespace plumbline::synth {

using core::ConfigNode;
using core::ConfigProblems;
using Eigen::Vector3d;

namespace {

bool read_waypoint(const ConfigNode& node, const std::string& path, double height, double pitch, Waypoint& w,
                   ConfigProblems& problems) {
  std::vector<double> at, look;
  const std::size_t before = problems.size();
  core::OptionTable table;
  w.pitch_rad = pitch;
  w.mark = node.mark;
  table.numbers("at", at, 0, {-1000.0, 1000.0}, "m", "Position");
  table.numbers("look", look, 3, {-1000.0, 1000.0}, "m", "Point that the camera looks at");
  table.number("pitch", w.pitch_rad, {-1.5, 1.5}, "rad", "Angle by which the camera looks up");
  table.number("yaw", w.yaw_rad, {-7.0, 7.0}, "rad", "Angle by which the camera looks left");

  // The short form is the position alone.
  if (node.kind == ConfigNode::Kind::kSequence) {
    table.set("at", node, path, problems);
  } else {
    table.set_all(node, path, problems);
  }

  if (problems.size() != before) return false;
  if (at.size() != 2 && at.size() != 3) {
    problems.push_back({node.mark, path, "a waypoint is [x, y], [x, y, z] or {at: [...], look: [x, y, z]}"});
    return false;
  }

  // Height of the path unless given.
  w.position = {at[0], at[1], at.size() == 3 ? at[2] : height};
  if (!look.empty()) w.look = Vector3d(look[0], look[1], look[2]);
  return true;
}

void read_robot(const ConfigNode& node, std::size_t index, RobotPath& robot, ConfigProblems& problems) {
  const std::string path = fmt::format("robots[{}]", index);
  double height = 1.3, pitch = 0.0;
  robot.name = fmt::format("robot{}", index);

  // Settings of the robot.
  core::OptionTable table;
  table.text("name", robot.name, "Name");
  table.boolean("closed", robot.closed, "Close the path from its last waypoint to the first");
  table.number("speed", robot.speed, {0.02, 5.0}, "m/s", "Speed along the path");
  table.number("turn_rate", robot.turn_rate, {0.05, 5.0}, "rad/s",
               "Largest turn rate; the camera slows down for it");
  table.number("height", height, {-100.0, 100.0}, "m", "Height of waypoints given as [x, y]");
  table.number("pitch", pitch, {-1.5, 1.5}, "rad", "Angle by which the camera looks up");

  if (node.kind != ConfigNode::Kind::kMap) {
    problems.push_back({node.mark, path, "needs a path: a list of waypoints"});
    return;
  }

  // A path of two waypoints or more.
  table.set_all(node, path, problems, {"path"});
  const ConfigNode* list = node.find("path");
  if (list == nullptr || list->kind != ConfigNode::Kind::kSequence || list->items.size() < 2) {
    problems.push_back({node.mark, path + ".path", "needs a list of at least two waypoints"});
    return;
  }

  // Waypoints that cannot be read are reported.
  for (std::size_t i = 0; i < list->items.size(); ++i) {
    Waypoint w;
    if (!read_waypoint(list->items[i], fmt::format("{}.path[{}]", path, i), height, pitch, w, problems))
      continue;
    if (w.look && (*w.look - w.position).norm() < 0.05) {
      problems.push_back({w.mark, path, "the point looked at is the waypoint itself"});
    }
    robot.waypoints.push_back(w);
  }

  // The camera must move.
  double length = 0.0;
  for (std::size_t i = 1; i < robot.waypoints.size(); ++i) {
    length += (robot.waypoints[i].position - robot.waypoints[i - 1].position).norm();
  }
  if (robot.waypoints.size() == list->items.size() && length < 0.01) {
    problems.push_back({list->mark, path + ".path", "all waypoints are the same place"});
  }
}

void read_robots(const ConfigNode& root, Scene& scene, ConfigProblems& problems) {
  const ConfigNode* list = root.find("robots");
  if (list == nullptr || list->kind != ConfigNode::Kind::kSequence || list->items.empty()) {
    problems.push_back({list != nullptr ? list->mark : root.mark, "robots",
                        "a scene needs at least one robot with a path: '- {path: [[0, 0], [1, 0]]}'"});
    return;
  }
  for (std::size_t i = 0; i < list->items.size(); ++i) {
    RobotPath robot;
    read_robot(list->items[i], i, robot, problems);
    scene.robots.push_back(std::move(robot));
  }
}

void read_walkers(const ConfigNode& list, Scene& scene, ConfigProblems& problems) {
  if (list.kind != ConfigNode::Kind::kSequence) {
    problems.push_back({list.mark, "walkers", "must be a list: '- {from: [0, 0], to: [1, 0]}'"});
    return;
  }

  for (std::size_t i = 0; i < list.items.size(); ++i) {
    const ConfigNode& node = list.items[i];
    const std::string path = fmt::format("walkers[{}]", i);
    std::vector<double> from, to;

    // Settings of one walker.
    Walker walker;
    walker.mark = node.mark;
    core::OptionTable table;
    table.numbers("from", from, 2, {-1000.0, 1000.0}, "m", "Start of the walk");
    table.numbers("to", to, 2, {-1000.0, 1000.0}, "m", "Turning point of the walk");
    table.number("speed", walker.speed, {0.02, 5.0}, "m/s", "Speed");
    table.choice("material", walker.material, material_names(), "Material of the clothes");

    // A walk needs two places.
    const std::size_t before = problems.size();
    table.set_all(node, path, problems);
    if (problems.size() != before) continue;
    if (from.size() != 2 || to.size() != 2 || std::hypot(to[0] - from[0], to[1] - from[1]) < 0.01) {
      problems.push_back({node.mark, path, "needs from: [x, y] and to: [x, y], two places"});
      continue;
    }

    walker.from = {from[0], from[1], 0.0};
    walker.to = {to[0], to[1], 0.0};
    scene.walkers.push_back(walker);
  }
}

void read_root(const ConfigNode& root, Scene& scene, ConfigProblems& problems) {
  std::string events, motion = "handheld";
  core::OptionTable table;
  table.text("name", scene.name, "Name");
  table.text("description", scene.description, "Description of the scene; empty: none",
             core::EmptyValue::kAllowed);
  table.number("ambient", scene.ambient, {0.0, 1.0}, "", "Share of light without direction");
  table.choice("motion", motion, {"handheld", "wheeled"}, "Motion of the cameras");
  table.text("events", events, "Difficult moments, like the option of the same name");
  table.set_all(root, "", problems, {"objects", "robots", "walkers"});
  scene.motion = motion == "wheeled" ? Motion::kWheeled : Motion::kHandheld;

  // Errors in events are reported at their line.
  if (auto parsed = parse_events(events)) {
    scene.events = *parsed;
  } else {
    const ConfigNode* node = root.find("events");
    problems.push_back({node != nullptr ? node->mark : root.mark, "events", parsed.error().message});
  }

  // Things, in the order of the file.
  Builder builder(scene);
  if (const ConfigNode* objects = root.find("objects")) {
    read_objects(*objects, builder, problems);
  } else {
    problems.push_back({root.mark, "objects", "a scene needs a list of objects"});
  }

  // Robots and people, after the things around them.
  read_robots(root, scene, problems);
  if (const ConfigNode* walkers = root.find("walkers")) read_walkers(*walkers, scene, problems);
  if (problems.empty() && scene.faces.empty())
    problems.push_back({root.mark, "objects", "the world is empty"});
}

core::Result<Scene> build(const ConfigNode& root, const std::string& file) {
  Scene scene;
  scene.file = file;
  scene.name = std::filesystem::path(file).stem().string();
  ConfigProblems problems;
  if (root.kind != ConfigNode::Kind::kMap) {
    problems.push_back({root.mark, "", "a scene file has the keys name, objects and robots"});
  } else {
    read_root(root, scene, problems);
  }
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return scene;
}

}  // namespace

core::Result<Scene> parse_scene(const std::string& yaml, const std::string& file_name) {
  auto root = core::parse_yaml(yaml, file_name);
  if (!root) return tl::unexpected<core::Error>(root.error());
  return build(*root, file_name);
}

core::Result<Scene> load_scene(const std::string& name_or_file, const std::filesystem::path& scenes_folder) {
  const auto file = core::find_yaml("scene", name_or_file, scenes_folder);
  if (!file) return tl::unexpected<core::Error>(file.error());
  auto root = core::read_yaml(*file);
  if (!root) return tl::unexpected<core::Error>(root.error());
  return build(*root, file->string());
}

}  // namespace plumbline::synth
