// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// `plumbline fuse` as a call: finished maps in, one result folder out.
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/pipeline/run.hpp"
#include "plumbline/pipeline/summary.hpp"

namespace plumbline::maps {
class StoredMaps;
}

namespace plumbline::pipeline {

struct FuseRequest : RunRequest {
  FuseRequest() { pipeline = "fuse"; }
  std::vector<std::filesystem::path> maps;  ///< result folders, or files map.db
  /// Map that `maps` are visits of: its frame and, unless a new loop closes, its poses stay. It does not
  /// change on disk. Empty: all maps are equal.
  std::filesystem::path into;
  std::string anchor;  ///< robot or map that defines the common frame; empty: by content
  /// Places that the first and the second of two maps have in common: two or more, of which two lie 20 cm
  /// apart as seen from above. They join what overlaps too little.
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> picks;
  /// Changes the maps that were read, before anything else; there is one, and its frame stays. Returns
  /// further files of the result: names and texts. Empty: nothing is changed.
  std::function<core::Result<std::map<std::string, std::string>>(maps::StoredMaps&)> change;
};

/// The result does not depend on the order of `maps`; a single one is refined and fused. Errors as
/// map_recording; if maps do not connect, those that do are in the result, and the summary's `reason` names
/// the others.
core::Result<RunSummary> fuse_stored_maps(const FuseRequest& request, const core::Executor& executor,
                                          core::Log& log, const core::StopToken& stop,
                                          const Progress& progress);

}  // namespace plumbline::pipeline
