// SPDX-License-Identifier: BSD-3-Clause
#include "recording/scene_file.hpp"

#include "plumbline/core/version.hpp"
#include "recording/body_sensors.hpp"

namespace plumbline::synth {
namespace {

nlohmann::json describe_camera(const sensor::Camera& c) {
  return {{"fx", c.color.fx},
          {"fy", c.color.fy},
          {"cx", c.color.cx},
          {"cy", c.color.cy},
          {"distortion", std::vector<double>(c.distortion.begin(), c.distortion.begin() + 5)},
          {"depth_slope", c.depth_slope},
          {"readout", c.readout_s.value_or(0.0)},
          {"depth_delay", c.depth_delay_s}};
}

/// Errors of an inertial sensor, as they were drawn.
nlohmann::json describe_imu_errors(const ImuModel& model, std::uint64_t seed) {
  const ImuErrors e = imu_errors(model, seed);
  const auto list = [](const Eigen::Vector3d& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
  const auto rows = [&](const Eigen::Matrix3d& m) {
    return nlohmann::json{list(m.row(0)), list(m.row(1)), list(m.row(2))};
  };
  return {{"gyro_bias", list(e.gyro_bias)},
          {"accel_bias", list(e.accel_bias)},
          {"gyro_axes", rows(e.gyro_axes)},
          {"accel_axes", rows(e.accel_axes)},
          {"delay", model.delay}};
}

nlohmann::json describe_options(const SynthOptions& o) {
  return {{"frames", o.frames},
          {"robots", o.robots},
          {"walkers", o.walkers},
          {"texture", to_string(o.texture)},
          {"sensor", to_string(o.sensor)},
          {"motion", to_string(o.motion)},
          {"seed", o.seed},
          {"width", o.width},
          {"height", o.height},
          {"fps", o.fps},
          {"speed", o.speed},
          {"readout", o.readout_s},
          {"depth_delay", o.depth_delay_s},
          {"visible_range", o.visible_range},
          {"events", o.events}};
}

/// With the options that not all worlds have.
nlohmann::json describe_options(const Scene& scene, const SynthOptions& options) {
  nlohmann::json json = describe_options(options);
  if (!options.changes.empty()) json["changes"] = options.changes;
  if (scene.plan) {
    json["layout"] = options.layout;
    json["path"] = to_string(options.path);
    json["like"] = options.like;
    json["copies"] = options.copies;
    if (scene.plan->kind == "building") json.update({{"floors", options.floors}, {"rooms", options.rooms}});
  }

  // Newer options are there only if they are used.
  SynthOptions given = options, usual;
  core::OptionTable table, defaults;
  given.declare(table);
  usual.declare(defaults);

  // Options that differ from their defaults.
  for (const core::OptionSpec& spec : table.specs()) {
    if (spec.key == "reference_spacing" || json.contains(spec.key) ||
        table.value(spec.key) == defaults.value(spec.key))
      continue;
    const auto value = core::parse_yaml(table.value(spec.key), "");
    if (value) json[spec.key] = value->scalar;
  }
  return json;
}

/// Numbers, middles and corners, in the order in which they were hung.
nlohmann::json describe_tags(const std::vector<WallTag>& tags) {
  const auto list = [](const Eigen::Vector3d& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
  nlohmann::json json = nlohmann::json::array();
  for (const WallTag& tag : tags) {
    nlohmann::json corners = nlohmann::json::array();
    for (const Eigen::Vector3d& corner : tag.corners) corners.push_back(list(corner));
    json.push_back({{"tag", tag.id}, {"middle", list(tag.middle)}, {"corners", corners}});
  }

  return json;
}

}  // namespace

nlohmann::json describe_robot(const SynthSource& source, const std::string& folder,
                              const std::string& path_name, std::size_t frames, const SynthOptions& options,
                              std::uint64_t seed) {
  const auto first = source.info(0), last = source.info(source.size() - 1);
  const geometry::Rigid3 start = source.world_from_camera(first.stamp);
  const Eigen::Quaterniond q = start.quaternion();
  const Eigen::Vector3d& t = start.translation;

  nlohmann::json json = {
      {"folder", folder},
      {"path", path_name},
      {"frames", frames},
      {"path_m", source.path_length()},
      {"first_stamp", first.stamp},
      {"last_stamp", last.stamp},
      {"start", {{"position_m", {t.x(), t.y(), t.z()}}, {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}}}};

  // Errors that estimates are compared with.
  if (!options.camera_error.empty()) {
    json["camera"] = {{"file", describe_camera(source.camera())},
                      {"true", describe_camera(source.true_camera())}};
  }

  if (!options.imu.empty()) json["imu"] = describe_imu_errors(*imu_model(options.imu), seed);

  // Place of the camera on the rig.
  if (!options.rig.empty()) {
    const Eigen::Quaterniond turn = source.body_from_camera().quaternion();
    const Eigen::Vector3d& place = source.body_from_camera().translation;
    json["body_from_camera"] = {{"position_m", {place.x(), place.y(), place.z()}},
                                {"quaternion_xyzw", {turn.x(), turn.y(), turn.z(), turn.w()}}};
  }
  return json;
}

nlohmann::json describe_world(const Scene& scene, const SynthOptions& options, const WriteSummary& summary,
                              const nlohmann::json& robots) {
  nlohmann::json json = {{"scene", scene.name},
                         {"scene_file", scene.file.filename().string()},
                         {"description", scene.description},
                         {"version", core::version()},
                         {"options", describe_options(scene, options)},
                         {"robots", robots},
                         {"reference",
                          {{"file", "reference.ply"},
                           {"spacing_m", summary.reference_spacing_m},
                           {"samples", summary.reference_samples},
                           {"visible", summary.reference_visible}}},
                         {"complete", !summary.stopped}};
  if (!scene.tags.empty()) json["tags"] = describe_tags(scene.tags);
  if (scene.plan) json["openings"] = {{"count", summary.openings}, {"seen", summary.openings_seen}};
  return json;
}

}  // namespace plumbline::synth
