// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Options of the calls of plumbline.hpp.
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/cloud/filters/filter.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"

namespace plumbline {

/// Options of all runs.
struct RunOptions {
  std::string pipeline;          ///< shipped name or file; empty: the shipped one for this call
  std::vector<std::string> set;  ///< options of stages: "fuse.voxel=2 cm", "track.loops=off"
  cloud::FilterRegistry filters = cloud::builtin_filters();  ///< filters of your own are added here
  std::filesystem::path pipelines_folder;  ///< shipped pipelines, cameras and scenes; empty: find_pipelines()
  bool replace = false;                    ///< replace an earlier result
  int threads = 0;                         ///< 0: one per core; results do not depend on it
  std::shared_ptr<core::Log> log;          ///< messages, from several threads; null: none
  core::StopToken stop;                    ///< ends the run in order: what is done is written
  /// Called after each frame, from one thread at a time; `total` 0: not known. May be empty.
  std::function<void(std::size_t done, std::size_t total)> progress;
};

/// Options for reading a recording.
struct RecordingOptions {
  std::string camera;           ///< shipped name or file; empty: the recording's own
  std::string format = "auto";  ///< layout
  double from_s = 0.0;          ///< seconds after the first frame
  std::optional<double> to_s;   ///< seconds after the first frame; none: to the end
  int every = 1;                ///< every n-th frame
  /// Poses that come with the recording: "prior" starts each frame's search, "given" maps with them as they
  /// are, "ignore" leaves them out.
  std::string poses = "prior";
  std::map<std::string, std::string> topics;  ///< of a bag: "color", "depth", "info", "depth_info"
};

struct MapOptions : RunOptions, RecordingOptions {
  std::vector<std::string> others;  ///< further recordings, one per robot
  bool resume = false;              ///< continue an interrupted run from OUTPUT.partial
  /// A finished map in which the recording is located, by the pipeline "localize"; empty: none.
  std::filesystem::path known_map;
  /// A finished map that the recording is another visit of: both are in `output`, in its frame; empty: none.
  std::filesystem::path into;
  std::filesystem::path rig;  ///< rig.yaml: the recordings are of cameras that are fixed to each other
};

struct FuseOptions : RunOptions {
  std::string anchor;         ///< robot whose map defines the frame; empty: the one with the largest map
  std::filesystem::path rig;  ///< rig.yaml: the maps are of cameras that are fixed to each other
};

struct MapperOptions : RunOptions {
  std::string name = "live";  ///< of the robot, in results
  std::size_t queue = 16;     ///< frames that may wait for the tracker, at least 1
  bool drop_late = false;     ///< with a full queue, drop frames instead of waiting
};

}  // namespace plumbline
