// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Types of the values that flow between the stages of this library.
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/ids.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/mapping/adjustment/global_adjustment.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/fusion_state.hpp"
#include "plumbline/maps/line_export.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/pipeline/stage.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::pipeline {

using maps::RobotInfo;
struct RevisedClouds;

/// Fate of a frame that could be read. Bridged: lost, and given a pose by the gyroscope.
enum class FrameState : std::uint8_t { kInitialising, kTracked, kLost, kBridged, kLocated };
const char* to_string(FrameState state);

/// One line of frames.csv.
inline constexpr const char* kShowsNothing = "shows nothing";  ///< FrameRow::reason

struct FrameRow {
  std::size_t frame = 0;  ///< number within the run
  FrameState state = FrameState::kLost;
  std::string
      columns;  ///< the rest, comma-separated, as MapResult::frame_columns names it; for the file only
  std::string reason{};        ///< why it has no pose; "": it has one
  bool shows_nothing = false;  ///< hardly any depth, or a picture without contrast and corners
  bool blind = false;          ///< lost, and one of three or more in a row that show nothing
};

/// The tracker's decision about one frame.
struct TrackedFrame {
  std::int32_t robot = 0;
  core::KeyframeId keyframe;  ///< valid when this frame became a keyframe
  maps::FrameId frame;        ///< its number on the robot's path; invalid: it has no pose
  double stamp = 0.0;         ///< seconds
  FrameRow row;
  bool still = false;  ///< the camera has stood still for a second, and nothing moves before it
  geometry::Rigid3 depth_from_camera;   ///< motion between the stamps of colour and depth
  std::optional<maps::FramePose> pose;  ///< none before the map began, or where there is no map
  /// Pose in the present map, if there is an observer; none: lost.
  std::optional<geometry::Rigid3> map_from_camera;
  /// Changes of the map since the last keyframe; with each keyframe, if some stage keeps the map.
  std::shared_ptr<const maps::MapChanges> changes;
  std::shared_ptr<const maps::Map> map;  ///< for several robots: the map at this keyframe
  /// With a keyframe: all robots, if there are news of a camera since the last one. Null: there are none.
  std::shared_ptr<const std::vector<RobotInfo>> robots;
  /// With the first keyframe after the map was made anew: all frames of the robot, relative to the new map.
  std::shared_ptr<const std::vector<maps::FramePose>> frames_anew;
};

/// The map of one robot when its tracking has ended, or a finished map of one robot or several.
struct RobotMap {
  std::string name;
  std::vector<RobotInfo> robots;
  std::shared_ptr<const maps::Map> map;
  std::vector<maps::FramePose> frame_poses;
  bool component = false;  ///< one of several that its robots' map consists of
};

/// Maps to be merged.
struct RobotMaps {
  std::vector<RobotMap> maps;
  std::string frame_columns;     ///< as MapResult
  std::vector<FrameRow> frames;  ///< as MapResult
};

/// The finished map without its dense cloud; poses after all optimisation.
struct MapResult : maps::MapPoses {
  std::shared_ptr<const maps::Map> map;      ///< null when the poses come from a file
  std::vector<maps::FramePose> frame_poses;  ///< empty when `map` is null
  mapping::MapAccuracy accuracy;
  std::vector<maps::LineSegment3> lines;
  std::vector<RobotInfo> robots;  ///< by number, with the versions of their cameras; empty: one robot
  std::string frame_columns;      ///< header of FrameRow::columns
  std::vector<FrameRow> frames;   ///< by frame
  /// Components of the robots' maps that never joined this one, each in a frame of its own; they have none
  /// themselves.
  std::vector<std::shared_ptr<const MapResult>> apart;
  std::string name;  ///< of such a component
  std::shared_ptr<const RevisedClouds> revised =
      nullptr;  ///< of a map that was visited again; null: no other
};

/// Filtered cloud of one keyframe, or of a frame between keyframes, in the camera frame; or, for such a
/// frame, its free space (cloud::depth_view). Its points are those of the depth camera at the moment of the
/// depth image: cloud::sensor_pose() leads from there to the camera of the poses.
struct KeyframeCloud {
  core::KeyframeId id;    ///< not valid: a frame between keyframes
  maps::FrameId frame;    ///< as TrackedFrame
  double stamp = 0.0;     ///< seconds
  cloud::CloudPtr cloud;  ///< null: the content of `compact` is not decoded
  /// The cloud as encoded by cloud::encode_cloud; null: it is in a store.
  std::shared_ptr<const std::vector<std::uint8_t>> compact;
  std::function<core::Result<std::vector<std::uint8_t>>()> stored;  ///< reads it there
  /// mapping::coarse_surface of the keyframe's cloud; null: none was kept.
  std::shared_ptr<const maps::StoredSurface> surface;
};

/// The cloud, wherever it is. Errors (kInput): it cannot be read.
core::Result<cloud::CloudPtr> cloud_of(const KeyframeCloud& keyframe);
/// The same for a store. Errors (kInput): it cannot be read.
core::Result<maps::StoreCloud> store_cloud_of(const KeyframeCloud& keyframe);

/// Voxel size of the surfaces of keyframes that are kept with their clouds, for the stage refine.
constexpr double kSurfaceVoxel_m = 0.03;

/// The merged cloud in the output's frame, which output_from_map leads to: all results are written in it.
struct DenseCloud {
  cloud::CloudPtr cloud;
  cloud::CloudColumns columns;  ///< of the cloud's points
  double voxel_m = 0.0;
  geometry::Rigid3 output_from_map;
  bool upright = false;                                      ///< z is up in the output's frame
  std::shared_ptr<const maps::FusionState> state = nullptr;  ///< state of the maps that it was fused from
  std::vector<std::shared_ptr<const DenseCloud>> apart;      ///< of the components MapResult::apart
};

/// The poses of one robot among `map.trajectory`.
geometry::Trajectory trajectory_of(const MapResult& map, std::int32_t robot);

/// Recomputes trajectory, keyframe poses and lines of `result` from its map.
void take_poses_from_map(MapResult& result);

/// The port types of this library.
inline PortType frame_port() { return port_type<sensor::RgbdFrame>("frame"); }
inline PortType features_port() { return port_type<features::FrameFeatures>("features"); }
inline PortType track_port() { return port_type<TrackedFrame>("track"); }
inline PortType keyframe_cloud_port() { return port_type<KeyframeCloud>("keyframe_cloud"); }
inline PortType maps_port() { return port_type<RobotMaps>("maps", Rate::kEnd); }
inline PortType map_port() { return port_type<MapResult>("map", Rate::kEnd); }
inline PortType cloud_port() { return port_type<DenseCloud>("cloud", Rate::kEnd); }

}  // namespace plumbline::pipeline
