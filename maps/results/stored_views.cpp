// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/stored_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "plumbline/cloud/compact/compact_cloud.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/cloud/transform.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::maps {

namespace {

std::int32_t number_in(const RobotNumbers& numbers, std::int32_t stored) {
  const auto found = numbers.find(stored);
  return found == numbers.end() ? stored : found->second;
}

std::int32_t stored_number(const RobotNumbers& numbers, std::int32_t robot) {
  const auto found = std::find_if(numbers.begin(), numbers.end(),
                                  [&](const auto& number) { return number.second == robot; });
  return found == numbers.end() ? robot : found->first;
}

}  // namespace

core::KeyframeId StoredViews::stored_keyframe(std::size_t view) const {
  return {stored_number(numbers, keyframes[view].robot), keyframes[view].index};
}

FrameId StoredViews::stored_frame(std::size_t view) const {
  return {stored_number(numbers, frames[view].robot), frames[view].index};
}

/// A keyframe's or a frame's cloud, corrected for later calibrations.
core::Result<cloud::CloudPtr> StoredViews::read(std::size_t view) const {
  if (keyframes[view].valid()) {
    const core::KeyframeId id = stored_keyframe(view);
    auto cloud = reader->cloud(id);
    if (cloud) cameras.apply(id, velocities[view], **cloud);
    return cloud;
  }

  const FrameId frame = stored_frame(view);
  auto cloud = reader->cloud(frame);
  if (cloud) cameras.apply(frame, velocities[view], **cloud);
  return cloud;
}

/// The encoded cloud; decoded only if the calibration changed since.
core::Result<std::vector<std::uint8_t>> StoredViews::bytes(std::size_t view) const {
  const bool of_keyframe = keyframes[view].valid();
  const bool changes =
      of_keyframe ? cameras.changes(stored_keyframe(view)) : cameras.changes(stored_frame(view));
  if (!changes) {
    return of_keyframe ? reader->cloud_bytes(stored_keyframe(view)) : reader->cloud_bytes(stored_frame(view));
  }
  const auto cloud = read(view);
  if (!cloud) return tl::unexpected(cloud.error());
  return cloud::encode_cloud(**cloud);
}

/// The surface samples of a keyframe, corrected like its cloud.
core::Result<std::optional<StoredSurface>> StoredViews::surface(std::size_t view) const {
  if (!keyframes[view].valid()) return std::nullopt;
  const core::KeyframeId id = stored_keyframe(view);
  const auto bytes = reader->surface_bytes(id);
  if (!bytes) return tl::unexpected(bytes.error());
  if (bytes->empty()) return std::nullopt;
  auto surface = unpack_surface(*bytes);
  if (!surface) return tl::unexpected(surface.error());
  cameras.apply(id, velocities[view], surface->samples);
  return std::optional(std::move(*surface));
}

core::Result<StoredViews> views_of(const StoreReader& reader, const MapPoses& map,
                                   const std::vector<RobotInfo>& robots, const Arrivals& arrivals,
                                   const RobotNumbers& numbers) {
  // Clouds of keyframes and of frames between them
  auto keyframes = reader.cloud_ids();
  if (!keyframes) return tl::unexpected(keyframes.error());
  auto frames = reader.frame_cloud_ids();
  if (!frames) return tl::unexpected(frames.error());
  for (core::KeyframeId& id : *keyframes) id.robot = number_in(numbers, id.robot);
  for (FrameId& frame : *frames) frame.robot = number_in(numbers, frame.robot);

  // Frames in the order of their arrival
  const auto arrival = [&](FrameId frame) {
    const auto found = arrivals.find(frame);
    return found == arrivals.end() ? 0 : found->second;
  };
  std::stable_sort(frames->begin(), frames->end(),
                   [&](FrameId a, FrameId b) { return arrival(a) < arrival(b); });

  // Everything that a view needs to be read
  StoredViews views;
  views.reader = &reader;
  views.cameras = CameraHistory(robots);
  views.numbers = numbers;

  // A delay's correction needs the camera's velocity
  const std::map<std::int32_t, geometry::Trajectory> paths = by_robot(map);
  const auto add = [&](core::KeyframeId keyframe, FrameId frame, double stamp,
                       const geometry::Rigid3& world_from_camera) {
    views.keyframes.push_back(keyframe);
    views.frames.push_back(frame);
    views.world_from_camera.push_back(world_from_camera);
    views.robots.push_back(keyframe.valid() ? keyframe.robot : frame.robot);
    views.stamps.push_back(stamp);

    const auto path = paths.find(views.robots.back());
    views.velocities.push_back(path == paths.end() ? geometry::Vector6d(geometry::Vector6d::Zero())
                                                   : geometry::velocity_at(path->second, stamp));
  };

  // Keyframes first, in the map's order
  const std::set<core::KeyframeId> there(keyframes->begin(), keyframes->end());
  std::set<std::pair<std::int32_t, double>> seen;  // a resumed run may make a keyframe of a stored frame
  for (const KeyframePose& keyframe : map.keyframes) {
    if (there.count(keyframe.id) == 0) continue;
    add(keyframe.id, {}, keyframe.stamp, keyframe.world_from_camera);
    seen.emplace(keyframe.id.robot, keyframe.stamp);
  }

  // Frames with a pose that are not keyframes
  std::map<FrameId, std::size_t> places;
  for (std::size_t i = 0; i < map.trajectory_ids.size(); ++i) places[map.trajectory_ids[i]] = i;
  for (const FrameId frame : *frames) {
    const auto found = places.find(frame);
    if (found == places.end()) continue;  // it was lost, or its map is left out
    const geometry::StampedPose& pose = map.trajectory[found->second];
    if (seen.count({frame.robot, pose.stamp}) == 0) add({}, frame, pose.stamp, pose.world_from_camera);
  }
  return views;
}

/// One PLY file per keyframe, in the output frame.
core::Result<std::size_t> write_keyframe_clouds(
    const std::filesystem::path& folder, const StoredViews& views, const geometry::Rigid3& output_from_map,
    const cloud::CloudFrame& frame, const std::function<core::Result<cloud::CloudPtr>(std::size_t)>& read) {
  if (auto made = core::make_folder(folder); !made) return tl::unexpected(made.error());
  std::size_t written = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const core::KeyframeId id = views.keyframes[i];
    if (!id.valid()) continue;
    const auto cloud = read(i);
    if (!cloud) return tl::unexpected(cloud.error());
    cloud::transform(**cloud, output_from_map * views.world_from_camera[i] * cloud::sensor_pose(**cloud));
    const std::string name =
        id.robot == 0 ? fmt::format("{:06}.ply", id.index) : fmt::format("{}_{:06}.ply", id.robot, id.index);
    auto done = cloud::write_ply(folder / name, **cloud, {}, Eigen::Vector3d::Zero(), frame.comments());
    if (!done) return tl::unexpected(done.error());
    ++written;
  }
  return written;
}

}  // namespace plumbline::maps
