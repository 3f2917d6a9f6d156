// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Source that formats are written from: one map, or one cloud, in one frame. Each piece is read when it is
// first needed.
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/exports/export.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/maps/stored_views.hpp"

namespace plumbline::exports {

/// A camera's pose in the frame of the results.
struct ExportPose {
  std::int32_t robot = 0;
  std::string robot_name;     ///< empty if there is only one robot
  core::KeyframeId keyframe;  ///< invalid: a frame between keyframes, or not known
  double stamp = 0.0;         ///< seconds
  geometry::Rigid3 world_from_camera;
};

class MapSource {
 public:
  /// Opens the map and determines frame and selection. Errors: kInput; kUsage: the selection is not valid.
  static core::Result<MapSource> open(const ExportRequest& request, const core::Executor& executor,
                                      core::Log& log, const ExportProgress& progress);

  [[nodiscard]] const ExportRequest& request() const { return *request_; }
  [[nodiscard]] const ExportOptions& options() const { return request_->options; }
  [[nodiscard]] const core::Executor& executor() const { return *executor_; }
  [[nodiscard]] core::Log& log() const { return *log_; }
  void progress(std::size_t done, std::size_t total) const {
    if (*progress_) (*progress_)(done, total);
  }
  /// The name of the exported map, for titles.
  [[nodiscard]] std::string name() const;

  /// The map's store, for data that only it holds; `what`: "free space" and the like, for the message. Errors
  /// (kInput): there is no store, with advice.
  [[nodiscard]] core::Result<const maps::StoredRun*> store(const std::string& what) const;
  [[nodiscard]] bool has_store() const { return store_.has_value(); }
  [[nodiscard]] const maps::MapPlace& place() const { return place_; }
  /// From the map's own frame into that of everything that is exported.
  [[nodiscard]] const geometry::Rigid3& world_from_map() const { return world_from_map_; }
  /// Checks that z is up. Errors (kInput): it is not, with advice; `what` is the export that needs it.
  [[nodiscard]] core::Result<void> need_upright(const std::string& what) const;
  /// The frame of all that is exported; nothing for a cloud whose file says nothing.
  [[nodiscard]] const cloud::CloudFrame& frame() const { return frame_; }
  /// Description of the frame, one line, for files that hold text.
  [[nodiscard]] std::string frame_text() const;

  /// The dense cloud in that frame, as far as it was selected, without points that are not finite. Errors
  /// (kInput): the map has no cloud, or no point is selected.
  core::Result<const cloud::CloudFile*> cloud();
  /// Tracked frames, by robot, then time; or of keyframes only. Errors (kInput): there are no poses.
  [[nodiscard]] core::Result<std::vector<ExportPose>> poses(bool keyframes_only) const;
  /// Robots that have more than one name between them.
  [[nodiscard]] const std::vector<maps::RobotInfo>& robots() const { return robots_; }

  /// Height of the floor of the selected storey, 0 where the map stands on its floor.
  [[nodiscard]] double floor_m() const { return floor_m_; }
  /// True if the position is selected.
  [[nodiscard]] bool selects(const Eigen::Vector3d& place) const { return selected_.contains(place); }
  [[nodiscard]] const Eigen::AlignedBox3d& selected() const { return selected_; }

 private:
  MapSource() = default;
  core::Result<void> open_cloud();
  core::Result<void> open_map();
  void name_frame();
  core::Result<void> level_interrupted();
  core::Result<void> select();
  core::Result<cloud::CloudFile> read_cloud() const;
  core::Result<const cloud::CloudFile*> whole_cloud();
  [[nodiscard]] core::Result<std::vector<ExportPose>> stored_poses(bool keyframes_only) const;
  [[nodiscard]] core::Result<std::vector<ExportPose>> written_poses(bool keyframes_only) const;

  const ExportRequest* request_ = nullptr;
  const core::Executor* executor_ = nullptr;
  core::Log* log_ = nullptr;
  const ExportProgress* progress_ = nullptr;
  bool cloud_only_ = false;  ///< the input is a cloud
  maps::MapPlace place_;
  std::optional<maps::StoredRun> store_;
  std::vector<maps::RobotInfo> robots_;
  geometry::Rigid3 world_from_map_;
  bool upright_ = false;
  cloud::CloudFrame frame_;
  std::optional<cloud::CloudFile> whole_;
  double whole_voxel_m_ = 0.0;  ///< voxel size of the whole cloud; 0: that of the run
  std::optional<cloud::CloudFile> chosen_;
  Eigen::AlignedBox3d selected_;
  double floor_m_ = 0.0;
};

/// Heights of the floors, lowest first: wide surfaces that face up. Empty: there is none.
std::vector<double> floor_heights(const cloud::Cloud& cloud);

}  // namespace plumbline::exports
