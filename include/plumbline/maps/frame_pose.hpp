// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Poses of frames that are not keyframes: kept relative to a keyframe, so that they move with it.
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "plumbline/core/ids.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::maps {

class Map;

using FrameId = core::Id<struct FrameTag>;  ///< a robot's frame: its place among the robot's FramePoses

/// A landmark in the image of a frame (features::PixelDepth): the raw measurement, independent of the
/// assumed camera.
struct SeenPoint {
  core::PointId point;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  ///< of the image before rectification
  float depth = 0.0F;                               ///< metres, as the depth camera gave it; 0: none
  float sigma_px = 1.0F;
};
/// Points that a frame saw.
struct SeenPoints {
  /// Delay of the camera at that time, which the depths are already corrected for.
  double depth_delay_s = 0.0;
  std::vector<SeenPoint> points;
};

struct FramePose {
  double stamp = 0.0;  ///< seconds
  core::KeyframeId reference;
  geometry::Rigid3 camera_from_reference;
  bool tracked = false;
  /// Motion since the previous frame as measured by the tracker; none if one of the two was not tracked.
  std::optional<geometry::Rigid3> camera_from_previous;
  double step_sigma_m = 0.0;  ///< its standard deviation where it is known worst; half as much in radians
  /// Observations for estimating its camera; null: not kept.
  std::shared_ptr<const SeenPoints> seen = nullptr;
};

/// True if the frame has a pose in `map` and became its reference keyframe.
bool became_keyframe(const FramePose& frame, const Map& map);
/// True if the frame has a pose in `map` and lies between keyframes.
bool is_between_keyframes(const FramePose& frame, const Map& map);

/// A step between neighbouring frames of the present path, with its difference from the tracker's
/// measurement.
struct PathStep {
  double stamp = 0.0;     ///< of the later frame, seconds
  core::KeyframeId from;  ///< reference of the earlier frame
  core::KeyframeId to;    ///< of the later one
  double off_m = 0.0;     ///< difference of the two
  double off_rad = 0.0;
};

struct PathCheck {
  double largest_m = 0.0;  ///< largest difference between a step and the tracker's
  double largest_rad = 0.0;
  std::vector<PathStep> tears;  ///< beyond noise: 5 cm or 3 degrees, and 4 standard deviations
};

/// Checks whether the map has torn: the path must lead from frame to frame as the tracker saw it. Frames are
/// relative to keyframes, so that steps change only where the keyframe changes, and a correction that is
/// spread over the path changes each by little. The frames of each robot are in order.
PathCheck check_path(const std::vector<FramePose>& frames, const Map& map);

/// True if a step that the tracker knows to `sigma_m` cannot be off by this much.
bool beyond_noise(double off_m, double off_rad, double sigma_m);

/// World poses of the tracked frames, in the given order, from the present poses of their keyframes in `map`.
geometry::Trajectory trajectory(const std::vector<FramePose>& frames, const Map& map);

struct KeyframePose {
  core::KeyframeId id;
  double stamp = 0.0;  ///< seconds
  geometry::Rigid3 world_from_camera;
};

std::vector<KeyframePose> keyframe_poses(const Map& map);  ///< by id
/// `robot`: those of one.
geometry::Trajectory trajectory(const std::vector<KeyframePose>& keyframes,
                                std::optional<std::int32_t> robot = std::nullopt);
geometry::Trajectory keyframe_trajectory(const Map& map);  ///< by id

struct MapPoses {
  geometry::Trajectory trajectory;      ///< tracked frames only
  std::vector<FrameId> trajectory_ids;  ///< frames of the trajectory's poses
  std::vector<KeyframePose> keyframes;  ///< by id
};

/// All present poses in `map`; frames in the given order.
MapPoses poses_of(const Map& map, const std::vector<FramePose>& frames);

/// The trajectory of each robot.
std::map<std::int32_t, geometry::Trajectory> by_robot(const MapPoses& map);

/// Transforms poses from their map's frame into another one.
void move(MapPoses& poses, const geometry::Rigid3& frame_from_map);

}  // namespace plumbline::maps
