// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// `plumbline map` as a call: a recording in, a result folder out.
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/live_frames.hpp"
#include "plumbline/mapping/merging/other_maps.hpp"
#include "plumbline/pipeline/run.hpp"
#include "plumbline/pipeline/summary.hpp"

namespace plumbline::pipeline {

struct MapRequest : RunRequest {
  MapRequest() { pipeline = "rgbd"; }
  std::string input;                ///< folder or synth:...
  std::vector<std::string> others;  ///< further recordings, one per robot
  dataset::OpenOptions open;        ///< format, camera, from, to, every
  /// A finished map in which the recording is located, by a pipeline with a localize stage; empty: none.
  std::filesystem::path known_map;
  /// A finished map that the recording is another visit of: it is joined to what is there, what is gone is
  /// left out, and the result holds both. The map stays as it is on disk. Empty: none.
  std::filesystem::path into;
  std::string into_contents;  ///< set by map_recording: a text that changes with that map
  bool resume = false;        ///< continue an interrupted run from OUT.partial
  /// Highest rate at which each recording is played, frames a second; 0: as fast as possible.
  double pace_hz = 0.0;
  /// Folder for one picture of the tracker's view per frame; empty: none.
  std::filesystem::path debug_video;
  /// Frames that are still arriving, instead of `input`, which is then only a name for the results. Nothing
  /// is resumed. The run ends when they are closed.
  std::shared_ptr<dataset::LiveFrames> live;
  /// Called before the first frame with the folder that the run writes into, where map.db will be, and again
  /// if the run starts again with another camera: nothing earlier is there then. May be empty.
  std::function<void(const std::filesystem::path&)> prepared;
  /// Maps of other robots that the trackers use for relocalisation and loops: the result depends on the
  /// received maps and their times; null: none.
  std::shared_ptr<const mapping::OtherMapsInbox> feedback;
  /// For tests: changes the map when tracking has ended; may be empty.
  std::function<void(maps::Map&)> alter_map;
};

/// True if there is nothing to resume: OUT is whole and no run was interrupted since. A complete result that
/// a killed run has not renamed to OUT is renamed. Error (kOutput): it cannot be, as something else is there.
core::Result<bool> is_finished(const std::filesystem::path& out, bool replace);

/// Folder in which a visit (MapRequest::into) is mapped by itself before it is joined to the map.
std::filesystem::path visit_folder(const std::filesystem::path& out);

/// Robots are numbered by the names of their folders (where these are alike, by the folders that they lie
/// in): the order of `input` and `others` changes nothing. Checks everything first (pipeline: kUsage,
/// recording: kInput, output folder: kOutput), then maps. When the result is written but should not be
/// trusted, the summary's `reason` says why. Errors leave an earlier result untouched; what a run that failed
/// on the way had stored stays in OUT.partial. `resume` with another input or configuration than that run's
/// is kUsage. `progress` may be empty.
core::Result<RunSummary> map_recording(const MapRequest& request, const core::Executor& executor,
                                       core::Log& log, const core::StopToken& stop, const Progress& progress);

}  // namespace plumbline::pipeline
