// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A run in its store, finished or interrupted: its map, its clouds fused again, paths and lines.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/cloud/fusion/dense_fusion.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/maps/stored_views.hpp"

namespace plumbline::maps {

struct FusionState;

/// A map as the user named it.
struct MapPlace {
  std::optional<ResultFolder> result;  ///< result of a run that has ended
  std::filesystem::path store;  ///< its map.db, or that of a run that was interrupted; empty: there is none
  std::string robot = {};       ///< robot whose map it is, if those of several are not merged yet
};

/// `input`: a result folder, map.db itself, or OUT where a run was interrupted and left OUT.partial. Errors
/// (kInput): none of these.
core::Result<MapPlace> find_map(const std::filesystem::path& input);

/// A run in its store, finished or interrupted, as it was when it was opened. Paths, lines and the fused
/// cloud are given in the frame of the run's results; of a run that was interrupted, in that of its first
/// camera.
class StoredRun {
 public:
  /// `robot`: whose map, if those of several are not merged yet. Errors (kInput) as StoreReader.
  static core::Result<StoredRun> open(const std::filesystem::path& store, const std::string& robot = {});
  /// Without components that never joined: they have frames of their own.
  static core::Result<StoredRun> open_main(const std::filesystem::path& store, const std::string& robot = {});
  static core::Result<StoredRun> open_main(const MapPlace& place) {
    return open_main(place.store, place.robot);
  }

  /// Renumbers the robots of its map.
  void renumber(const RobotNumbers& numbers);
  /// Other poses and landmarks for the same keyframes; the frames are those of the map it has.
  void replace(Map map, std::vector<FramePose> frames);

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  /// Its header has the store's numbers of robots, the map and the frames those that were given last.
  [[nodiscard]] const StoredMap& stored() const { return map_; }
  /// Tracked frames, by robot, then time.
  [[nodiscard]] geometry::Trajectory trajectory() const { return poses().trajectory; }
  /// Keyframes by id, including those that have left the map.
  [[nodiscard]] std::vector<KeyframePose> keyframes() const { return poses().keyframes; }
  [[nodiscard]] geometry::Trajectory keyframe_trajectory() const { return maps::trajectory(keyframes()); }
  [[nodiscard]] std::vector<LineSegment3> lines() const;

  /// Options with which the run fused its clouds, as far as its configuration contains them; else the
  /// defaults.
  [[nodiscard]] cloud::DenseFusionOptions fusion_options() const;
  /// The filters of its merged cloud, as far as its configuration contains them. None if one of them is a
  /// plugin's, or writes a file.
  [[nodiscard]] cloud::FilterChain fusion_filters() const;
  /// The dense cloud: with the run's own options the one it wrote, filters and all. Errors (kInput): damaged,
  /// no clouds; those of filters.
  [[nodiscard]] core::Result<cloud::FusedCloud> fused(const cloud::DenseFusionOptions& options,
                                                      const core::Executor& executor) const;
  /// The frame of `fused` and of the clouds of keyframes.
  [[nodiscard]] cloud::CloudFrame frame() const;
  /// The cloud of each keyframe as FOLDER/<number, six digits>.ply; makes the folder. Returns how many.
  /// Errors (kOutput), (kInput): damaged.
  [[nodiscard]] core::Result<std::size_t> write_keyframe_clouds(const std::filesystem::path& folder) const;
  [[nodiscard]] const StoreReader& reader() const { return *reader_; }
  /// All that have a cloud, their poses in the map's own frame; as long as this lives. Errors (kInput):
  /// damaged.
  [[nodiscard]] core::Result<StoredViews> views() const;
  /// Empty where the run kept none. Errors (kInput): damaged.
  [[nodiscard]] core::Result<FusionState> fusion_state() const;

 private:
  StoredRun(std::filesystem::path file, StoreReader reader, StoredMap map);
  [[nodiscard]] MapPoses poses() const;

  std::filesystem::path file_;
  std::unique_ptr<StoreReader> reader_;
  StoredMap map_;
  RobotNumbers numbers_;
};

/// result.ply(), result.pcd() or, where neither was written, the store's cloud.
core::Result<cloud::CloudFile> read_map_cloud(const MapPlace& place, const core::Executor& executor);

}  // namespace plumbline::maps
