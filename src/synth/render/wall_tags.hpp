// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Printed tags on the walls of a scene. Private to the module.
#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

/// Hangs SynthOptions::tags sheets, far from each other, where the cameras see them well, and writes them
/// down in Scene::tags. Errors: kUsage (the cameras pass too little free wall).
core::Result<void> hang_tags(const SynthOptions& options, Scene& scene);

}  // namespace plumbline::synth
