// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Worlds made from a number.
#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

/// Kinds of worlds that a number chooses: "home", "office", "corridor", "building".
const std::vector<std::string>& layout_kinds();

/// The world of a kind and of the options' number, with its plan and a path for each robot. The same number
/// gives the same world. Errors: kUsage (no such kind).
core::Result<Scene> make_layout(const std::string& kind, const SynthOptions& options);

/// A scene file or, if the options have a layout, the world of that number.
core::Result<Scene> open_scene(const std::string& name_or_file, const SynthOptions& options,
                               const std::filesystem::path& scenes_folder);

/// Adds people who walk about near the path of the scene's first robot until the scene has `count` walkers.
/// False if the floor has no room for them.
bool add_people(int count, int seed, Scene& scene);

/// Lets at most SynthOptions::moving_doors doors of a world made from a number swing, and moving_drawers
/// drawers of any scene slide, when no camera is near and as far as nothing is in their way.
void choose_moving_doors(const SynthOptions& options, Scene& scene);

}  // namespace plumbline::synth
