// SPDX-License-Identifier: BSD-3-Clause
#include "report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "plumbline/adjust/tags.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/exports/edits.hpp"
#include "plumbline/maps/stored_run.hpp"

namespace plumbline::adjust {
namespace {

constexpr double kDegrees = 180.0 / M_PI;

std::string check_text(const ControlFinding& finding) {
  if (finding.left_out) return fmt::format("BLUNDER, off by {:.0f} mm, left out", 1e3 * finding.off_m);
  if (!finding.checked) return "cannot be checked";
  return fmt::format("fine; {:.0f} mm would show", 1e3 * finding.detectable_m);
}

/// camera.yaml with the scale's standard deviation among those it tells.
std::string camera_text(const maps::RobotInfo& robot, double relative_sigma) {
  const bool refined = robot.estimate && robot.estimate->better;
  const sensor::Camera& camera = refined ? robot.estimate->found : robot.camera;
  std::string text = "# depth_scale was adjusted by control (adjust.json)\n" + sensor::to_yaml(camera);
  if (!(relative_sigma > 0.0)) return text;

  const std::string sigma = fmt::format("depth_scale: {:.3g}", relative_sigma * camera.depth_scale);
  const std::size_t at = text.find("sigma: {");
  if (at == std::string::npos) return text + "sigma: {" + sigma + "}  # standard deviations\n";

  return text.insert(at + 8, sigma + ", ");
}

std::string json_of(const Adjustment& a) {
  nlohmann::ordered_json json;
  json["similarity"] = {{"scale", a.scale},
                        {"scale_sigma", a.scale_sigma},
                        {"tilt_degrees", a.tilt_rad * kDegrees},
                        {"turn_degrees", a.turn_rad * kDegrees},
                        {"shift_m", a.shift_m}};
  json["bend"] = {{"mean_m", a.mean_bend_m}, {"largest_m", a.largest_bend_m}};

  json["observations"] = nlohmann::ordered_json::array();
  for (const ControlFinding& f : a.findings) {
    json["observations"].push_back({{"name", f.name},
                                    {"before_m", f.before_m},
                                    {"after_m", f.after_m},
                                    {"off_m", f.off_m},
                                    {"detectable_m", f.detectable_m},
                                    {"checked", f.checked},
                                    {"left_out", f.left_out}});
  }

  return core::json_text(json);
}

std::string world_json(const WorldPlace& world) {
  nlohmann::ordered_json json;
  json["what"] = "world = origin + turn about z, scale in the plane * map; metres";
  json["epsg"] = world.epsg;
  json["name"] = world.name;
  json["origin"] = {world.origin.x(), world.origin.y(), world.origin.z()};

  json["turn_degrees"] = world.turn * kDegrees;
  json["scale"] = world.scale;
  json["convergence_degrees"] = world.convergence * kDegrees;

  json["export"] = world.export_arguments();
  return core::json_text(json);
}

}  // namespace

std::string WorldPlace::export_arguments() const {
  return fmt::format("{}--origin {:.4f},{:.4f},{:.4f},{:.6f},{:.8f}",
                     epsg == 0 ? std::string("--epsg N ") : fmt::format("--epsg {} ", epsg), origin.x(),
                     origin.y(), origin.z(), -turn * kDegrees, scale);
}

void write_report(Adjustment& a) {
  std::string& text = a.text;
  if (a.scale_sigma > 0.0) {
    text +=
        fmt::format("scale      {:.5f} +- {:.5f}: lengths of the map were {:.2f} % too {}\n", a.scale,
                    a.scale_sigma, 100.0 * std::abs(1.0 / a.scale - 1.0), a.scale > 1.0 ? "short" : "long");
  }

  if (a.tilt_rad > 0.0 || a.shift_m > 0.0) {
    text += fmt::format("moved      tilted by {:.3f} and turned by {:.3f} degrees, shifted by {:.1f} mm\n",
                        a.tilt_rad * kDegrees, a.turn_rad * kDegrees, 1e3 * a.shift_m);
  }

  if (!a.findings.empty()) {
    text += fmt::format("bent       keyframes by {:.1f} mm in the mean, {:.1f} mm at most\n",
                        1e3 * a.mean_bend_m, 1e3 * a.largest_bend_m);
  }

  for (const ControlFinding& finding : a.findings) {
    text += fmt::format("observed   {}: {:+.1f} mm off before, {:+.1f} mm after; {}\n", finding.name,
                        1e3 * finding.before_m, 1e3 * finding.after_m, check_text(finding));
  }

  if (a.world) {
    text += fmt::format(
        "world      {}; grid scale {:.6f}, convergence {:.4f} degrees\n           export OUT {}\n",
        a.world->epsg == 0 ? "the site's own grid" : a.world->name, a.world->scale,
        a.world->convergence * kDegrees, a.world->export_arguments());
  }
  a.json = json_of(a);
}

std::function<core::Result<std::map<std::string, std::string>>(maps::StoredMaps&)> change_of(
    AdjustRequest request, const core::Executor& executor, core::Log& log) {
  return [request = std::move(request), &executor,
          &log](maps::StoredMaps& maps) -> core::Result<std::map<std::string, std::string>> {
    std::map<std::string, std::string> files;
    AdjustRequest own = request;

    // Tags become observations like those of the command line.
    std::vector<Tag> tags;
    if (!request.tags.empty()) {
      const auto told = read_tags(request.tags);
      if (!told) return tl::unexpected(told.error());
      auto found = find_tags(maps, told->family, executor);
      if (!found) return tl::unexpected(found.error());
      tags = std::move(*found);
      std::vector<std::string> messages;

      for (Control& control : control_of(*told, tags, messages)) own.control.push_back(std::move(control));
      for (const std::string& message : messages) log.warning(message);
    }

    const auto adjustment = adjust_map(maps, own, executor);
    if (!adjustment) return tl::unexpected(adjustment.error());
    log.info(adjustment->text.substr(0, adjustment->text.size() - 1));
    for (const ControlFinding& finding : adjustment->findings) {
      if (finding.left_out) log.warning(finding.name + ": " + check_text(finding));
    }

    // Files that are in metres of the map change their scale with it.
    files["adjust.json"] = adjustment->json;
    if (!request.tags.empty())
      files["tags.csv"] = tags_table(tags, maps.parts().front().run.stored(), adjustment->scale);
    const std::vector<maps::RobotInfo>& robots = maps.robots();
    for (const maps::RobotInfo& robot : robots) {
      const std::string folder = robots.size() == 1 ? "" : "robots/" + robot.name + "/";
      files[folder + "camera.yaml"] = camera_text(robot, adjustment->scale_sigma / adjustment->scale);
    }

    // Edits given here replace those kept beside the map.
    std::error_code ec;
    std::filesystem::path edits = request.edits;
    if (edits.empty()) edits = maps.parts().front().run.file().parent_path() / exports::kEditsFile;
    if (!request.edits.empty() || std::filesystem::is_regular_file(edits, ec)) {
      auto text = exports::edits_text(edits, adjustment->scale);
      if (!text) return tl::unexpected(text.error());
      files[exports::kEditsFile] = std::move(*text);
    }

    if (adjustment->world) files["georeference.json"] = world_json(*adjustment->world);
    return files;
  };
}

core::Result<std::vector<std::string>> fusion_settings(const std::filesystem::path& map) {
  const auto place = maps::find_map(map);
  if (!place) return tl::unexpected(place.error());
  if (place->store.empty()) {
    return core::input_error(
        map.string() +
        ": has no map.db, which is what is adjusted; map the recording again with a pipeline "
        "that tracks, without store.enabled=off");
  }

  // The cloud is made again as the map's own run made it; only settings that differ from the defaults are
  // passed on.
  const auto run = maps::StoredRun::open_main(*place);
  if (!run) return tl::unexpected(run.error());

  cloud::DenseFusionOptions options = run->fusion_options(), usual;
  core::OptionTable table, defaults;
  options.declare(table);
  usual.declare(defaults);
  std::vector<std::string> settings{"refine.adjust=off"};
  for (const core::OptionSpec& spec : table.specs()) {
    const std::string value = table.value(spec.key);
    if (value != defaults.value(spec.key)) settings.push_back("fuse." + spec.key + "=" + value);
  }

  return settings;
}

}  // namespace plumbline::adjust
