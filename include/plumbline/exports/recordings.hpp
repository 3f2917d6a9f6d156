// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The recordings that a map was made from.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/exports/export.hpp"

namespace plumbline::exports {

/// Recordings from which the map in `folder` was made, by robot, as its configuration (StoreHeader) names
/// them; empty if the map was fused from other maps or its frames were fed.
std::vector<RecordingName> recordings_of_run(const std::string& configuration,
                                             const std::filesystem::path& folder);

}  // namespace plumbline::exports
