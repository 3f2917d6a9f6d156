// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Runs a checked graph on oneTBB.
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/pipeline/graph.hpp"

namespace plumbline::pipeline {

class RunObserver;

/// Part of a pipeline that is run; another visit of a map runs them one after another.
enum class PipelinePart {
  kWhole,
  kMapping,  ///< from the recording to its own map.db
  kJoining,  ///< from finished maps to the result
};

/// Request that `map` and `fuse` have in common.
struct RunRequest {
  PipelinePart part = PipelinePart::kWhole;
  std::filesystem::path output;            ///< the result folder
  std::string pipeline;                    ///< shipped name or file
  std::vector<std::string> overrides;      ///< stage.key=value
  std::filesystem::path pipelines_folder;  ///< shipped pipelines, with cameras/, filters/ and scenes/
  cloud::FilterRegistry filters = cloud::builtin_filters();  ///< with those of plugins
  bool replace = false;                                      ///< replace an earlier result
  std::filesystem::path rig;  ///< rig.yaml: robots that are cameras fixed to each other; empty: none
  std::shared_ptr<RunObserver> observer;  ///< observer of the run; null: none
  /// Called at the end of a run with the name of each stage whose end begins ("refine", "fuse, output"). May
  /// be empty.
  std::function<void(const std::string&)> finishing;
};

struct RunReport {
  std::size_t frames = 0;  ///< number of frames that passed the graph
  std::size_t frames_available = 0;
  bool stopped = false;  ///< ended early on request
  /// First frame read to last change of the map: frames and the end of non-export stages.
  double map_s = 0.0;
  double export_s = 0.0;            ///< end of the stages that export
  double behind_s = 0.0;            ///< delay of the latest frame behind its due time; 0 without a pace
  std::vector<StageTiming> stages;  ///< in graph order
  std::vector<float> rss_mb;        ///< one per frame, when it was done; NaN = not known
};

/// Called in frame order, from one thread at a time; `total` 0: not known (live sources).
using Progress = std::function<void(std::size_t done, std::size_t total)>;

/// With a pace (`pace_hz` > 0) frame n of a recording enters the graph no earlier than n / pace_hz seconds
/// after the first frame, as a live camera would; several recordings are played together. Results do not
/// depend on it.
///
/// Frames pass the stages in graph order; several are processed at a time, never more than twice the threads
/// plus two, so that memory stays bounded. Stateless stages run in parallel, serial stages get the frames in
/// order: results do not depend on the number of threads. The run ends early, in order, when the
/// context's stop token requests it (stages still finish) or when a stage fails: then the error of the
/// earliest such frame is returned and no stage finishes. A run that continues another one begins with the
/// frame after the last one of that; the report counts its frames, too, but without times.
core::Result<RunReport> run_graph(Graph& graph, const RunContext& context, const Progress& progress,
                                  double pace_hz = 0.0);

}  // namespace plumbline::pipeline
