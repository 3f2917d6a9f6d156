// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Finished maps as the source of a run: their clouds come one after another.
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/maps/stored_run.hpp"

namespace plumbline::maps {

/// One store. Its robots are renumbered so that no two stores have the same number.
struct StoredPart {
  std::string name;  ///< of its folder
  StoredRun run;
  std::vector<RobotInfo> robots;  ///< by this run's numbers; clouds are as the latest camera has them
  StoredViews views = {};         ///< its clouds
};

/// A cloud that waits in a store.
struct StoredCloud {
  std::size_t part = 0;
  std::size_t view = 0;  ///< of the part's views
};

/// Parts stand in an order that their contents decide: the one with most keyframes first. Robots are numbered
/// in this order; of several with one name, later ones get a number behind it.
class StoredMaps {
 public:
  /// `maps`: result folders, or files map.db. Errors (kInput): not there, no map.db, damaged, not finished,
  /// without keyframes; (kUsage) the same map twice.
  static core::Result<std::unique_ptr<StoredMaps>> open(const std::vector<std::filesystem::path>& maps,
                                                        const core::Executor& executor);

  [[nodiscard]] const std::vector<StoredPart>& parts() const { return parts_; }
  [[nodiscard]] const std::vector<StoredCloud>& clouds() const { return clouds_; }
  [[nodiscard]] const StoredViews& views_of(const StoredCloud& cloud) const {
    return parts_[cloud.part].views;
  }
  /// Robots of all parts, by this run's numbers.
  [[nodiscard]] const std::vector<RobotInfo>& robots() const { return robots_; }
  /// Error about a cloud that cannot be used.
  [[nodiscard]] core::Error damaged(core::KeyframeId id, FrameId frame, const core::Error& how) const;
  /// The part of that name, or that has a robot of that name. Errors (kUsage): none has.
  [[nodiscard]] core::Result<std::size_t> find_part(const std::string& name) const;

 private:
  StoredMaps() = default;
  static core::Result<StoredPart> read_part(const std::filesystem::path& map);
  core::Result<void> arrange(const core::Executor& executor);

  std::vector<StoredPart> parts_;
  std::vector<RobotInfo> robots_;
  std::vector<StoredCloud> clouds_;
};

}  // namespace plumbline::maps
