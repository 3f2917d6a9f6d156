// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// summary.json, the printed summary and timing.csv of a finished run, from the reports of its stages.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/pipeline/graph.hpp"
#include "plumbline/pipeline/run.hpp"
#include "plumbline/pipeline/summary.hpp"

namespace plumbline::pipeline {

/// Circumstances of the run.
struct RunFacts {
  std::string input;     ///< input as it was given
  std::string pipeline;  ///< likewise
  double pace_hz = 0.0;  ///< rate at which recordings were played; 0: as fast as possible
  double wall_s = 0.0;   ///< the whole run
  int threads = 0;
};

/// The stages' reports, with the gravest of their doubts.
RunSummary summary_of(const Graph& graph, const RunReport& report, const RunFacts& facts);

/// One line a frame: its number, stamp, the milliseconds of every stage and of parts of stages (empty =
/// nothing to do), and the memory the process held when the frame was done, MB.
core::Result<void> write_timing(const std::filesystem::path& file, const Graph& graph,
                                const RunReport& report, const dataset::FrameSource& source);

}  // namespace plumbline::pipeline
