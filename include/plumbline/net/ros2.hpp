// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Topics of ROS 2, received and sent without ROS: CycloneDDS under the names and types that ROS 2's
// middleware gives them (docs/method/network.md). CycloneDDS is in the part plumbline_ros2.so.
#include <array>
#include <memory>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/message_stream.hpp"
#include "plumbline/net/options.hpp"
#include "plumbline/pipeline/observer.hpp"

namespace plumbline::net {

/// "ros2://DOMAIN[?interface=IF&peers=HOST,HOST&color=/TOPIC&depth=/TOPIC&info=/TOPIC&depth_info=/TOPIC]"
struct Ros2Address {
  NetworkOptions network;
  dataset::TopicNames topics;
};

/// Error (kUsage): names the part of the address that is wrong, and what is allowed.
core::Result<Ros2Address> parse_ros2_address(const std::string& address);

/// Error (kUsage): the network cannot be used.
core::Result<std::unique_ptr<dataset::MessageStream>> open_ros2_stream(const Ros2Address& address);
core::Result<std::unique_ptr<dataset::MessageSink>> open_ros2_sink(const Ros2Address& address);

enum class PublishedNames {
  kOfOne,   ///< no prefix to topics and frames for a single robot, else the robots' names
  kOfEach,  ///< always the robot's name as prefix, because others may join
};

/// Who publishes the pose of the robot's base in the frame `odom` on /tf.
enum class OdomTf {
  kOwn,    ///< the publisher
  kOther,  ///< somebody else; only map -> odom is published
  kAuto,   ///< somebody else if that is heard within two seconds or later, else the publisher
};

/// Names of frames on /tf, and how the camera is mounted.
struct PublishedFrames {
  std::string map = "map";
  std::string odom = "odom";
  std::string camera;  ///< the colour camera's optical frame; "": "camera", or with a base
                       ///< "camera_color_optical_frame"
  std::string base;    ///< the robot's base, above the camera by /tf_static; "": /tf ends at the camera
  OdomTf odom_tf = OdomTf::kAuto;  ///< used with a base
  bool finished_map = false;       ///< poses are in a finished map: `map` is its frame, also with a base
  /// Heights over the base's origin, metres, lower first, between which an occupancy grid has obstacles.
  std::array<double, 2> grid_heights = {0.1, 1.8};

  /// True if any name was given.
  [[nodiscard]] bool given() const;
};

/// "map=NAME,odom=NAME,base=NAME,camera=NAME", each at most once. Error (kUsage): what is wrong, and what is
/// allowed.
core::Result<PublishedFrames> parse_published_frames(const std::string& text);

/// Publishes the results of a run, as long as the returned object lives, in a thread of its own; a subscriber
/// that is too slow misses messages and delays nothing. `name`: prefix in any case, or "". Topics are
/// /plumbline/path (the poses of the keyframes, at the end of all frames), /plumbline/points (the cloud of
/// each keyframe) and /plumbline/map (the merged cloud, at the end), of a robot or of each of several
/// /NAME/..., and /tf: map -> odom -> camera, with NAME/ in front; with a base /plumbline/grid and
/// grid_updates (occupancy as far as keyframes saw it), in a finished map /plumbline/pose (with covariance).
/// In the frame map x points forward, y left, z up as the camera stood in its first frame; with a base, as
/// that stood. map -> odom is sent with each frame, lost ones too. `frames`: their names as they are, for a
/// single robot. With a base this waits some seconds for /tf_static. The destructor waits a moment for
/// listeners to get the last messages. Error (kUsage): the network cannot be used, the address names topics,
/// or no transform leads from the base to the camera.
core::Result<std::shared_ptr<pipeline::RunObserver>> open_ros2_publisher(const std::string& address,
                                                                         PublishedNames names,
                                                                         const std::string& name,
                                                                         const PublishedFrames& frames,
                                                                         core::Log& log);

/// Function for LiveOptions::open: opens the stream of an address, whose topics replace the given ones.
core::Result<std::unique_ptr<dataset::MessageStream>> open_live_stream(const std::string& address,
                                                                       dataset::TopicNames& topics);

}  // namespace plumbline::net
