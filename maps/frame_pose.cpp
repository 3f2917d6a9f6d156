// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/frame_pose.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

bool became_keyframe(const FramePose& frame, const Map& map) {
  return frame.tracked && map.has_keyframe(frame.reference) &&
         map.keyframe(frame.reference).stamp == frame.stamp;
}

bool is_between_keyframes(const FramePose& frame, const Map& map) {
  return frame.tracked && map.has_keyframe(frame.reference) && !became_keyframe(frame, map);
}

/// Tracked frames in the map's frame, through the current poses of their reference keyframes.
geometry::Trajectory trajectory(const std::vector<FramePose>& frames, const Map& map) {
  geometry::Trajectory result;
  for (const FramePose& frame : frames) {
    if (!frame.tracked) continue;
    const geometry::Rigid3 camera_from_world =
        frame.camera_from_reference * map.camera_from_world(frame.reference);
    result.push_back({frame.stamp, camera_from_world.inverse()});
  }
  return result;
}

bool beyond_noise(double off_m, double off_rad, double sigma_m) {
  // Corrections of a tracker that has slid reach 3.1 cm between keyframes of real recordings (docs/notes).
  constexpr double kLeast_m = 0.05;
  constexpr double kLeast_rad = 0.052;  // 3 degrees
  constexpr double kSigmas = 4.0;
  return off_m > std::max(kLeast_m, kSigmas * sigma_m) ||
         off_rad > std::max(kLeast_rad, kSigmas * 0.5 * sigma_m);
}

PathCheck check_path(const std::vector<FramePose>& frames, const Map& map) {
  // One frame before, for each robot
  PathCheck check;
  std::map<std::int32_t, const FramePose*> last;  // by robot

  for (const FramePose& frame : frames) {
    if (!frame.reference.valid()) continue;

    // Only consecutive tracked frames are compared
    const FramePose* before = std::exchange(last[frame.reference.robot], &frame);
    if (before == nullptr || !before->tracked || !frame.tracked || !frame.camera_from_previous) continue;

    // Within one reference the step cannot tear
    if (before->reference == frame.reference) continue;

    // The step as optimised, against the step as tracked
    const geometry::Rigid3 step =
        frame.camera_from_reference * map.camera_from_world(frame.reference) *
        (before->camera_from_reference * map.camera_from_world(before->reference)).inverse();
    const geometry::Rigid3 off = step * frame.camera_from_previous->inverse();
    const PathStep seen{frame.stamp, before->reference, frame.reference, off.translation.norm(),
                        geometry::rotation_angle(off.rotation)};

    // A deviation beyond noise is a tear
    check.largest_m = std::max(check.largest_m, seen.off_m);
    check.largest_rad = std::max(check.largest_rad, seen.off_rad);
    if (beyond_noise(seen.off_m, seen.off_rad, frame.step_sigma_m)) check.tears.push_back(seen);
  }
  return check;
}

/// The keyframes' path; `robot` selects those of one robot.
geometry::Trajectory trajectory(const std::vector<KeyframePose>& keyframes,
                                std::optional<std::int32_t> robot) {
  geometry::Trajectory result;
  for (const KeyframePose& keyframe : keyframes) {
    if (!robot || keyframe.id.robot == *robot) result.push_back({keyframe.stamp, keyframe.world_from_camera});
  }
  return result;
}

geometry::Trajectory keyframe_trajectory(const Map& map) { return trajectory(keyframe_poses(map)); }

std::vector<KeyframePose> keyframe_poses(const Map& map) {
  std::vector<KeyframePose> poses;
  for (const core::KeyframeId id : map.keyframe_ids()) {
    poses.push_back({id, map.keyframe(id).stamp, map.camera_from_world(id).inverse()});
  }
  return poses;
}

/// Poses and their names; untracked frames count too.
MapPoses poses_of(const Map& map, const std::vector<FramePose>& frames) {
  MapPoses poses{trajectory(frames, map), {}, keyframe_poses(map)};
  std::map<std::int32_t, std::int32_t> numbers;  // by robot
  for (const FramePose& frame : frames) {
    const std::int32_t number = numbers[frame.reference.robot]++;
    if (frame.tracked) poses.trajectory_ids.push_back({frame.reference.robot, number});
  }
  return poses;
}

std::map<std::int32_t, geometry::Trajectory> by_robot(const MapPoses& map) {
  std::map<std::int32_t, geometry::Trajectory> paths;
  for (std::size_t i = 0; i < map.trajectory.size(); ++i)
    paths[map.trajectory_ids[i].robot].push_back(map.trajectory[i]);
  return paths;
}

/// Changes the reference frame of all poses.
void move(MapPoses& poses, const geometry::Rigid3& frame_from_map) {
  for (geometry::StampedPose& pose : poses.trajectory) {
    pose.world_from_camera = frame_from_map * pose.world_from_camera;
  }
  for (KeyframePose& keyframe : poses.keyframes) {
    keyframe.world_from_camera = frame_from_map * keyframe.world_from_camera;
  }
}

}  // namespace plumbline::maps
