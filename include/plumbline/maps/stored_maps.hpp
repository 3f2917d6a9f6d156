// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Finished maps as the source of a run: their clouds come one after another.
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/maps/camera_history.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::maps {

/// One store. Its robots are renumbered so that no two stores have the same number.
struct StoredPart {
  std::string name;  ///< of its folder
  std::filesystem::path file;
  std::unique_ptr<StoreReader> reader;
  Map map;
  std::vector<FramePose> frames;
  std::vector<RobotInfo> robots;  ///< their clouds are given as the latest version of their camera has them
  CameraHistory cameras;          ///< by the store's numbers
  /// Paths of the robots in the part's map, by this run's numbers.
  std::map<std::int32_t, geometry::Trajectory> paths;
  std::map<std::int32_t, std::int32_t> numbers;  ///< of robots: from the store's to this run's
};

/// A cloud that waits in a store.
struct StoredCloud {
  std::size_t part = 0;
  std::int32_t stored_robot = 0;  ///< as its store numbers the robot; the rest is as this run does
  core::KeyframeId id;            ///< invalid: of a frame between keyframes
  FrameId frame;                  ///< of such a frame
  double stamp = 0.0;
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
  /// May be called from several threads at a time.
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> cloud_bytes(std::size_t index) const;
  /// The coarse surface of a keyframe's cloud; none: none was kept. May be called from several threads at a
  /// time.
  [[nodiscard]] core::Result<std::optional<StoredSurface>> surface(std::size_t index) const;
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
  core::Result<void> list_clouds(std::size_t part);
  [[nodiscard]] geometry::Vector6d velocity_of(const StoredCloud& cloud) const;

  std::vector<StoredPart> parts_;
  std::vector<RobotInfo> robots_;
  std::vector<StoredCloud> clouds_;
};

}  // namespace plumbline::maps
