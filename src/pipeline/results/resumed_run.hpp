// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Results of an interrupted run in its store, for the stages of the run that continues it.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"

namespace plumbline::pipeline {

struct ResumedRun {
  std::filesystem::path store;                   ///< its file; clouds are read from there
  std::map<std::int32_t, maps::StoredMap> maps;  ///< each robot's own
  std::optional<RobotMap> merged;  ///< or the map of all, when the run had done all but write its results
  std::vector<FrameRow> rows;      ///< of the frames that are done and could be read
  std::vector<bool> done;          ///< by frame: each robot's up to its last keyframe
  std::size_t frames = 0;          ///< number of frames done, unreadable ones included
  std::size_t keyframes = 0;
};

/// Opens the store of `folder`. None: no keyframe was stored, and the store was removed. kUsage: it was made
/// with another configuration, recording or camera; the message names the difference. kInput: damaged.
core::Result<std::optional<ResumedRun>> open_resumed(const std::filesystem::path& folder,
                                                     const std::string& configuration,
                                                     const std::string& input,
                                                     const RobotRecordings& recordings);

/// Checks that the finished run in `folder` was a visit of a map with these contents
/// (MapRequest::into_contents). Errors: kUsage, it was not; kInput, damaged.
core::Result<void> check_contents(const std::filesystem::path& folder, const std::string& contents);

/// Number of keyframes in the store of `folder`; 0 if there is no readable store.
std::size_t stored_keyframes(const std::filesystem::path& folder);

}  // namespace plumbline::pipeline
