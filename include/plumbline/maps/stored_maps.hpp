// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Finished maps as the source of a run: their clouds come one after another.
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/maps/fusion_state.hpp"
#include "plumbline/maps/stored_run.hpp"

namespace plumbline::maps {

/// One store. Its robots are renumbered so that no two stores have the same number.
struct StoredPart {
  std::string name;  ///< name of the store's folder
  StoredRun run;
  std::vector<RobotInfo> robots;  ///< with the numbers of this run, without versions of cameras
  StoredViews views = {};         ///< clouds of the store
  FusionState state = {};         ///< covariances, by this run's numbers of robots; only after replace()
};

/// A cloud in a store.
struct StoredCloud {
  std::size_t part = 0;  ///< index of the store
  std::size_t view = 0;  ///< index into the store's views
};

/// One place in the results of two maps, metres.
struct Pick {
  std::size_t first_part = 0;  ///< whose place `first` is; `second` is the other one's
  Eigen::Vector3d first = Eigen::Vector3d::Zero(), second = Eigen::Vector3d::Zero();
};

/// Order of the parts of several maps.
enum class PartOrder {
  kByContent,  ///< the one with most keyframes first
  kAsGiven,    ///< the first one is the map that the others are visits of; robots keep their names
};

/// Parts are ordered by their contents: the one with most keyframes first. Robots are numbered in this order;
/// of several with the same name, later ones get a number appended (`name-2`).
class StoredMaps {
 public:
  /// `maps`: result folders, or files map.db. Errors (kInput): missing, no map.db, damaged, not finished,
  /// no keyframes; (kUsage) the same map twice.
  static core::Result<std::unique_ptr<StoredMaps>> open(const std::vector<std::filesystem::path>& maps,
                                                        const core::Executor& executor,
                                                        PartOrder order = PartOrder::kByContent);

  [[nodiscard]] const std::vector<StoredPart>& parts() const { return parts_; }
  [[nodiscard]] const std::vector<StoredCloud>& clouds() const { return clouds_; }
  [[nodiscard]] const StoredViews& views_of(const StoredCloud& cloud) const {
    return parts_[cloud.part].views;
  }
  /// Robots of all parts, in the order of their numbers in this run.
  [[nodiscard]] const std::vector<RobotInfo>& robots() const { return robots_; }
  /// Error about a cloud that cannot be used.
  [[nodiscard]] core::Error damaged(core::KeyframeId id, FrameId frame, const core::Error& how) const;
  /// The part that has this name, or a robot of this name. Errors (kUsage): there is none.
  [[nodiscard]] core::Result<std::size_t> find_part(const std::string& name) const;
  /// Another map in place of a part's, whose lengths are `scale` times as long: clouds, covariances and the
  /// depth scales of cameras follow. Errors (kInput): damaged.
  core::Result<void> replace(std::size_t part, Map map, std::vector<FramePose> frames, double scale);
  /// A map was replaced: it keeps its poses and its frame, and nothing is joined.
  [[nodiscard]] bool replaced() const { return replaced_; }
  /// Places that two maps have in common.
  void set_picks(std::vector<Pick> picks) { picks_ = std::move(picks); }
  [[nodiscard]] const std::vector<Pick>& picks() const { return picks_; }

 private:
  StoredMaps() = default;
  static core::Result<StoredPart> read_part(const std::filesystem::path& map, PartOrder order);
  void sort_by_content(const core::Executor& executor);
  core::Result<void> arrange(const core::Executor& executor);

  std::vector<StoredPart> parts_;
  std::vector<RobotInfo> robots_;
  std::vector<StoredCloud> clouds_;
  std::vector<Pick> picks_;
  bool replaced_ = false;
};

}  // namespace plumbline::maps
