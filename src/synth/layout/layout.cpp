// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/synth/layout.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "layout/layout.hpp"

namespace plumbline::synth {

namespace {

/// One of the worlds that a number could become, as it is made or changed; nothing if its rooms cannot all be
/// walked through.
core::Result<std::optional<Scene>> try_layout(const std::string& kind, const SynthOptions& options,
                                              int attempt, bool changed) {
  const std::optional<Scene> nothing;
  std::optional<Ground> ground;
  const int number = options.layout;
  const std::uint64_t seed = mix(static_cast<std::uint64_t>(number), static_cast<std::uint64_t>(attempt) + 1,
                                 static_cast<std::uint64_t>(kind[0]));

  Plan plan;
  plan.kind = kind;
  plan.number = number;

  // The scene can be made again from its name.
  Scene scene;
  scene.name = fmt::format("{}-{}", kind, number);
  scene.description = fmt::format("{} from the number {}", kind, number);
  scene.file = fmt::format("{}?layout={}", kind, number);
  scene.ambient = 0.35;

  // A building makes its storeys by itself.
  const bool building = kind == "building";
  plan.copies = options.copies > 1;
  if (building) {
    if (!build_building(options, seed, scene, plan)) return nothing;
  } else {
    Rng cells(seed, 1), rooms(seed, 2), openings(seed, 3), shell(seed, 4), things(seed, 5);

    // Attempts with bad shapes or unreachable rooms fail.
    if (!add_rooms(draw_cells(kind, std::max(options.like, options.copies), options.hall, cells), rooms,
                   plan) ||
        !add_openings(openings, plan) || !make_alike(plan)) {
      return nothing;
    }
    Builder builder(scene);
    build_shell(plan, shell, builder);
    ground = Ground(plan);

    furnish(plan, *ground, things, builder);
  }

  // Light of many rooms must not take longer than their making.
  scene.light_pitch = 0.12;
  for (Lamp& lamp : scene.lamps) lamp.reach = 6.0;

  scene.plan = std::move(plan);
  if (changed) {
    if (auto done = apply_changes(options, scene); !done) return tl::unexpected<core::Error>(done.error());
    if (!building) ground = furnished_ground(*scene.plan, 0);
  }

  // Every robot needs a path.
  for (int robot = 0; robot < options.robots; ++robot) {
    Rng walk(seed, 16 + static_cast<std::uint64_t>(robot));
    scene.robots.push_back(building ? plan_building_path(*scene.plan, options.path, robot, walk)
                                    : plan_path(*scene.plan, *ground, options.path, robot, walk));
    if (scene.robots.back().waypoints.empty()) return nothing;
  }

  return scene;
}

}  // namespace

const std::vector<std::string>& layout_kinds() {
  static const std::vector<std::string> kLayoutKinds = {"home", "office", "corridor", "building"};
  return kLayoutKinds;
}

core::Result<Scene> make_layout(const std::string& kind, const SynthOptions& options) {
  const auto& kinds = layout_kinds();
  if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) {
    return core::usage_error(
        fmt::format("layout: '{}' has no layouts; {} have", kind, fmt::join(kinds, ", ")));
  }

  // Not every kind has every option.
  if (std::max(options.like, options.copies) > 1 && (kind == "home" || kind == "corridor")) {
    return core::usage_error(
        fmt::format("like, copies: a {} has no rooms alike; office and building have", kind));
  }

  if (options.hall && (kind == "home" || kind == "corridor" || std::max(options.like, options.copies) > 1)) {
    return core::usage_error(
        "hall: an office or a building has one, where no rooms are alike; leave out hall, or like and "
        "copies");
  }

  // A lift needs storeys and one robot.
  if (options.lift && (kind != "building" || options.floors < 2 || options.robots > 1)) {
    return core::usage_error(
        "lift: a building of two storeys or more has one, in which one robot rides; leave out lift, or give "
        "`building`, floors and robots=1");
  }

  // Not every draw makes a valid plan.
  constexpr int kAttempts = 200;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    auto scene = try_layout(kind, options, attempt, false);
    if (!scene) return tl::unexpected<core::Error>(scene.error());
    if (!*scene) continue;
    if (options.changes.empty()) return std::move(**scene);

    // The same attempt, with the changes.
    scene = try_layout(kind, options, attempt, true);
    if (!scene) return tl::unexpected<core::Error>(scene.error());
    if (*scene) return std::move(**scene);
    return core::usage_error(fmt::format(
        "changes: {} leaves no way into one of the rooms; shut no door and move nothing that cuts it off",
        options.changes));
  }

  return core::usage_error(
      fmt::format("layout: no {} could be made from the number {}; take another one", kind, options.layout));
}

core::Result<Scene> open_scene(const std::string& name_or_file, const SynthOptions& options,
                               const std::filesystem::path& scenes_folder) {
  if (options.layout >= 0) return make_layout(name_or_file, options);

  // Some kinds exist only as layouts.
  if (name_or_file == "home" || name_or_file == "building") {
    return core::usage_error(
        fmt::format("{} is made from a number: give --layout N, in an address layout=N", name_or_file));
  }
  if (options.path != Route::kScene) {
    return core::usage_error(
        fmt::format("path: '{}' is for worlds made from a number (layout); the paths of {} are in its file",
                    to_string(options.path), name_or_file));
  }

  // Scenes from files can be changed too.
  auto scene = load_scene(name_or_file, scenes_folder);
  if (scene && !options.changes.empty()) {
    if (auto done = apply_changes(options, *scene); !done) return tl::unexpected<core::Error>(done.error());
  }
  return scene;
}

}  // namespace plumbline::synth
