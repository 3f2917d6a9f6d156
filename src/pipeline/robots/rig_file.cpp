// SPDX-License-Identifier: BSD-3-Clause
// rig.yaml as it is given and as a result has it, and the section of summary.json.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plumbline/core/json.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/pipeline/rig.hpp"
#include "robots/rig_merge.hpp"

namespace plumbline::pipeline {
namespace {

/// Standard deviations: one number for all axes, or one for each.
void read_sigma(const core::ConfigNode& node, const std::string& path, RigCamera& camera,
                core::ConfigProblems& problems) {
  constexpr double kLeast = 1e-6;
  struct Value {
    const char* key;
    const char* unit;
    double largest;
    Eigen::Vector3d& sigma;
    double one = 0.0;
    std::vector<double> three = {};
  };
  Value values[] = {{"position", "m", 100.0, camera.sigma_m}, {"rotation", "rad", 4.0, camera.sigma_rad}};

  core::OptionTable table;
  for (Value& value : values) {
    const core::ConfigNode* given = node.find(value.key);
    if (given != nullptr && given->kind == core::ConfigNode::Kind::kSequence) {
      table.numbers(value.key, value.three, 3, {kLeast, value.largest}, value.unit, "");
    } else {
      table.number(value.key, value.one, {kLeast, value.largest}, value.unit, "");
    }
  }

  table.set_all(node, path, problems);
  for (const Value& value : values) {
    if (value.one > 0.0) value.sigma.setConstant(value.one);
    if (value.three.size() == 3) value.sigma = {value.three[0], value.three[1], value.three[2]};
  }
}

RigCamera read_camera(const std::string& name, const core::ConfigNode& node, core::ConfigProblems& problems) {
  const std::string path = "cameras." + name;
  RigCamera camera;
  camera.name = name;
  if (node.kind == core::ConfigNode::Kind::kNull) return camera;

  std::vector<double> position, rotation;
  double offset = NAN;
  core::OptionTable table;
  table.numbers("position", position, 3, {-100.0, 100.0}, "m", "");
  table.numbers("rotation", rotation, 4, {-1.01, 1.01}, "", "");
  table.number("time_offset", offset, {-1e9, 1e9}, "s", "");
  table.boolean("find", camera.find, "");
  table.set_all(node, path, problems, {"sigma"});

  if (const core::ConfigNode* sigma = node.find("sigma"))
    read_sigma(*sigma, path + ".sigma", camera, problems);
  if (position.size() == 3) camera.position = Eigen::Vector3d(position[0], position[1], position[2]);
  if (!std::isnan(offset)) camera.time_offset_s = offset;
  if (rotation.size() != 4) return camera;

  const Eigen::Quaterniond q(rotation[3], rotation[0], rotation[1], rotation[2]);
  if (std::abs(q.norm() - 1.0) > 0.01) {
    problems.push_back(
        {node.find("rotation")->mark, path + ".rotation",
         fmt::format("has the length {:.3f}; a rotation is a quaternion qx, qy, qz, qw of length 1",
                     q.norm())});
    return camera;
  }
  camera.rotation = q.normalized();
  return camera;
}

Json list_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

core::Result<Rig> read_rig(const std::filesystem::path& file) {
  const auto root = core::read_yaml(file);
  if (!root) return tl::unexpected(root.error());
  Rig rig;
  rig.file = file;
  core::ConfigProblems problems;
  core::OptionTable table;
  table.set_all(*root, "", problems, {"cameras"});

  // The other cameras' poses are relative to the first one.
  const core::ConfigNode* cameras = root->find("cameras");
  if (cameras == nullptr || cameras->entries.size() < 2) {
    problems.push_back(
        {cameras == nullptr ? root->mark : cameras->mark, "cameras",
         "must hold two cameras or more by the names of their recordings, like {front: {}, back: {}}"});
    return tl::unexpected(core::to_error(problems));
  }

  for (const auto& [name, node] : cameras->entries) rig.cameras.push_back(read_camera(name, node, problems));
  if (!cameras->entries.front().second.entries.empty()) {
    problems.push_back({cameras->entries.front().second.mark, "cameras." + rig.cameras.front().name,
                        "is the reference, which has no position of its own; write {}"});
  }

  if (!problems.empty()) return tl::unexpected(core::to_error(problems));
  return rig;
}

core::Result<std::optional<Rig>> rig_of_run(const std::filesystem::path& file,
                                            const std::vector<maps::RobotInfo>& robots) {
  if (file.empty()) return std::optional<Rig>();
  auto rig = read_rig(file);
  if (!rig) return tl::unexpected(rig.error());
  if (robots.size() < 2) {
    return core::usage_error(
        "--rig: is for the cameras of one robot; give the recording or the map of each of them");
  }

  std::vector<std::string> names;
  names.reserve(robots.size());
  for (const maps::RobotInfo& robot : robots) names.push_back(robot.name);
  for (const RigCamera& camera : rig->cameras) {
    if (std::find(names.begin(), names.end(), camera.name) != names.end()) continue;
    return core::usage_error(fmt::format("{}: cameras.{}: no recording or map has this name{}", file.string(),
                                         camera.name, core::hint(camera.name, names)));
  }

  return std::optional<Rig>(std::move(*rig));
}

Json section_of(const RigMerge& rig) {
  Json cameras = Json::array();
  for (const RigPlace& place : rig.cameras) {
    const Eigen::Quaterniond q = place.pose.reference_from_camera.quaternion();
    const Eigen::Matrix<double, 6, 1> sigma = place.pose.covariance.diagonal().cwiseSqrt();
    Json camera = {{"name", place.name},
                   {"position", list_of(place.pose.reference_from_camera.translation)},
                   {"rotation", {q.x(), q.y(), q.z(), q.w()}},
                   {"sigma_position_m", list_of(sigma.head<3>())},
                   {"sigma_rotation_rad", list_of(sigma.tail<3>())},
                   {"pose", place.found ? "found" : "given"}};

    // The evidence, not rounded: residuals of good cameras are below a tenth of a millimetre.
    camera["motions"] = place.pose.motions;
    camera["independent_motions"] = rounded(place.pose.independent);
    camera["residual_m"] = place.pose.residual_m;
    camera["residual_rad"] = place.pose.residual_rad;
    camera["time_offset_s"] = place.time_offset_s;
    camera["time_offset"] = place.offset_is;
    camera["pairs"] = place.pairs;
    cameras.push_back(std::move(camera));
  }
  return {{"reference", rig.reference}, {"cameras", cameras}};
}

std::string to_yaml(const RigMerge& rig) {
  std::string text =
      "# Cameras of one robot: position (m) and rotation (qx, qy, qz, qw) lead from a camera's optical "
      "frame\n"
      "# to that of the first one. plumbline map RECORDING RECORDING --rig rig.yaml -o OUT\n";
  text += fmt::format("cameras:\n  {}: {{}}\n", core::json_text(Json(rig.reference), -1));
  for (const RigPlace& place : rig.cameras) {
    const Eigen::Vector3d& t = place.pose.reference_from_camera.translation;
    const Eigen::Quaterniond q = place.pose.reference_from_camera.quaternion();
    const Eigen::Matrix<double, 6, 1> s = place.pose.covariance.diagonal().cwiseSqrt();

    text += fmt::format("  {}:\n", core::json_text(Json(place.name), -1));
    text += fmt::format("    position: [{:.6f}, {:.6f}, {:.6f}]\n", t.x(), t.y(), t.z());
    text += fmt::format("    rotation: [{:.9f}, {:.9f}, {:.9f}, {:.9f}]\n", q.x(), q.y(), q.z(), q.w());
    text += fmt::format("    sigma: {{position: [{:.6f}, {:.6f}, {:.6f}], ", s[0], s[1], s[2]);
    text += fmt::format("rotation: [{:.7f}, {:.7f}, {:.7f}]}}\n", s[3], s[4], s[5]);
    text += fmt::format("    time_offset: {:.6f} s\n", place.time_offset_s);
  }
  return text;
}

}  // namespace plumbline::pipeline
