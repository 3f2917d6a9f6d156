// SPDX-License-Identifier: BSD-3-Clause
// plumbline adjust MAP -o OUT
#include <array>
#include <memory>
#include <tuple>

#include "app.hpp"
#include "plumbline/adjust/adjust.hpp"
#include "plumbline/pipeline/fuse_maps.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

using Two = std::tuple<std::string, std::string>;
using Three = std::tuple<std::string, std::string, std::string>;

struct AdjustCommand {
  pipeline::FuseRequest fuse;
  adjust::AdjustRequest request;
  std::string map, points;
  std::vector<Three> lengths;
  std::vector<Two> levels, plumbs;
};

/// Reads what was measured. Errors (kUsage), (kInput).
core::Result<void> read_control(AdjustCommand& command) {
  std::vector<adjust::Control>& control = command.request.control;
  for (const auto& [p, q, length] : command.lengths) {
    auto one = adjust::length_of({p, q, length});
    if (!one) return tl::unexpected(one.error());
    control.push_back(std::move(*one));
  }

  for (const auto kind : {adjust::ControlKind::kLevel, adjust::ControlKind::kPlumb}) {
    for (const auto& [p, q] : kind == adjust::ControlKind::kLevel ? command.levels : command.plumbs) {
      auto one = adjust::pair_of(kind, {p, q});
      if (!one) return tl::unexpected(one.error());
      control.push_back(std::move(*one));
    }
  }

  if (command.points.empty()) return {};
  const auto points = adjust::read_points(command.points);
  if (!points) return tl::unexpected(points.error());
  control.insert(control.end(), points->begin(), points->end());
  return {};
}

int run_adjust(AdjustCommand& command, Session& session) {
  if (auto read = read_control(command); !read) return session.fail(read.error());
  const auto settings = adjust::fusion_settings(command.map);
  if (!settings) return session.fail(settings.error());
  pipeline::FuseRequest& fuse = command.fuse;
  fuse.maps = {command.map};
  fuse.overrides.insert(fuse.overrides.begin(), settings->begin(), settings->end());
  if (auto equipped = session.equip(fuse); !equipped) return session.fail(equipped.error());
  Console& console = session.console();
  fuse.change = adjust::change_of(command.request, session.executor(), console);

  const auto summary = pipeline::fuse_stored_maps(fuse, session.executor(), console, stop_on_signals(),
                                                  console.counting("clouds"));
  return session.finish(summary, fuse.output);
}

}  // namespace

void add_adjust(CLI::App& app, Session& session) {
  const auto state = std::make_shared<AdjustCommand>();
  CLI::App* command =
      add_command(app, session, "adjust", "Bring a map to scale and place by what was measured",
                  [&session, state] { return run_adjust(*state, session); });
  command->add_option("MAP", state->map, "A finished map: a result folder, or its map.db")->required();
  command->add_option("-o,--output", state->fuse.output, "Folder for the result")
      ->required()
      ->type_name("OUT");

  // Measurements between places of the map.
  command
      ->add_option("--length", state->lengths,
                   "The distance of two places as a tape or laser measured it; may be given several times")
      ->type_name("X,Y,Z X,Y,Z 4.57m");
  command->add_option("--level", state->levels, "Two places of one height; may be given several times")
      ->type_name("X,Y,Z X,Y,Z");
  command
      ->add_option("--plumb", state->plumbs,
                   "Two places, one straight above the other; may be given several times")
      ->type_name("X,Y,Z X,Y,Z");

  // The map's place in the world.
  command
      ->add_option(
          "--points", state->points,
          "Table of control points: [name,] x, y, z in the map, E, N, H in the world [, sigma], metres")
      ->type_name("FILE.csv");
  command
      ->add_option(
          "--epsg", state->request.epsg,
          "Coordinate system of the points, whose scale and convergence count; 0: the site's own grid "
          "(default: 0)")
      ->type_name("N");
  command
      ->add_option(
          "--datum", state->request.datum,
          "Where the map's origin is: latitude,longitude,heading of its x axis (degrees)[,height], for UTM")
      ->delimiter(',')
      ->expected(3, 4)
      ->type_name("LAT,LON,HEADING[,HEIGHT]");

  // Files beside the map.
  command
      ->add_option(
          "--edits", state->request.edits,
          "YAML file of what exports leave out, kept as edits.yaml of the result (default: the map's own)")
      ->type_name("FILE.yaml");
  command
      ->add_option(
          "--tags", state->request.tags,
          "YAML file with lengths between printed tags, or their world coordinates; tags are found in the "
          "pictures that store.images=whole keeps")
      ->type_name("FILE.yaml");
  add_pipeline_options(*command, session, state->fuse);
}

}  // namespace plumbline::cli
