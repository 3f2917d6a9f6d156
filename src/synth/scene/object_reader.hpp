// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/core/config.hpp"
#include "scene/builder.hpp"

namespace plumbline::synth {

/// Builds the list under a scene file's `objects`; reports all problems.
void read_objects(const core::ConfigNode& list, Builder& builder, core::ConfigProblems& problems);

}  // namespace plumbline::synth
