// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Begin and end of `map` and `fuse`: a pipeline that is checked whole, a result folder with summary.json.
#include <chrono>
#include <string>

#include "plumbline/maps/output_folder.hpp"
#include "plumbline/pipeline/run.hpp"
#include "plumbline/pipeline/summary.hpp"

namespace plumbline::pipeline {

using RunClock = std::chrono::steady_clock;

/// Loads the requested pipeline. Errors: kUsage.
core::Result<Graph> load_pipeline(const RunRequest& request);

/// Summary of the stages' reports. `began`: start of the whole run so far.
RunSummary summary_of_run(const Graph& graph, const RunReport& report, const RunRequest& request,
                          const std::string& input, double pace_hz, RunClock::time_point began,
                          const core::Executor& executor);

/// Announces the files of the stages, whose names the user may have chosen. Errors: kOutput.
core::Result<void> announce_files(const Graph& graph, const core::FileNames& others,
                                  maps::OutputFolder& output);

/// Writes summary.json and the stages' exports, and renames the folder to the result. An export that fails
/// causes a warning only. Errors: kOutput.
core::Result<void> commit_result(const RunSummary& summary, maps::OutputFolder& output, const Graph& graph,
                                 const RunRequest& request, const RunContext& context);

}  // namespace plumbline::pipeline
