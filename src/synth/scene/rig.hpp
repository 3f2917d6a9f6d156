// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Cameras on one body: x forward, y to the left, z up.
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/synth/options.hpp"

namespace plumbline::synth {

/// Pose of a camera (x right, y down, z forward) that looks ahead from the body's origin.
geometry::Rigid3 body_from_camera();

/// body_from_camera of each camera of SynthOptions::rig; one that looks ahead if there is none. Problems of
/// the file are reported together (kUsage).
core::Result<std::vector<geometry::Rigid3>> read_rig(const SynthOptions& options);

/// Number of recordings: cameras of the rig or robots. The rig must be readable.
int recordings(const SynthOptions& options);

}  // namespace plumbline::synth
