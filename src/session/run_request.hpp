// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Requests of runs, filled from the options of the calls of plumbline.hpp.
#include <filesystem>

#include "plumbline/core/error.hpp"
#include "plumbline/pipeline/map_recording.hpp"
#include "plumbline/session/options.hpp"

namespace plumbline::session {

/// Errors (kUsage): the shipped pipelines are not there.
core::Result<void> fill(pipeline::RunRequest& request, const RunOptions& options,
                        const std::filesystem::path& output);

/// The run of a request that is filled.
core::Result<pipeline::RunSummary> run_map(const pipeline::MapRequest& request, const RunOptions& options);

}  // namespace plumbline::session
