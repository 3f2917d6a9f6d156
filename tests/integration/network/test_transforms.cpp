// SPDX-License-Identifier: BSD-3-Clause
// Poses on ROS 2's network in a robot's own frames, beside a publisher of its URDF and one of its odometry.
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <thread>

#include "plumbline/core/log.hpp"
#include "plumbline/dataset/ros_messages.hpp"
#include "plumbline/net/ros2.hpp"

namespace plumbline::net {
namespace {

using geometry::Rigid3;
using namespace std::chrono_literals;

std::string address() { return "ros2://" + std::to_string(150 + getpid() % 60) + "?interface=lo"; }

/// base_link -> camera_link -> camera_color_optical_frame: 0.3 m ahead of and 0.5 m above the base.
Rigid3 mount() {
  Rigid3 pose;
  pose.rotation << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  pose.translation = {0.3, 0.02, 0.5};
  return pose;
}

class Transforms : public testing::Test {
 protected:
  void SetUp() override {
    const auto parsed = parse_ros2_address(address());
    ASSERT_TRUE(parsed) << parsed.error().message;
    auto sink = open_ros2_sink(*parsed);
    ASSERT_TRUE(sink) << sink.error().message;
    urdf_ = std::move(*sink);
    auto stream = open_ros2_stream(*parsed);
    ASSERT_TRUE(stream) << stream.error().message;
    heard_ = std::move(*stream);
    ASSERT_TRUE(urdf_->announce("/tf_static", "tf2_msgs/TFMessage", dataset::Retention::kLatest));
    ASSERT_TRUE(urdf_->announce("/tf", "tf2_msgs/TFMessage", dataset::Retention::kPassing));
  }

  void send(const std::string& topic, const std::vector<dataset::NamedTransform>& transforms, double stamp) {
    ASSERT_TRUE(urdf_->send(topic, *dataset::transforms_message(transforms, stamp)));
  }
  void send_mount() {
    Rigid3 link;
    link.translation = mount().translation;
    Rigid3 optical;
    optical.rotation = mount().rotation;
    send("/tf_static",
         {{"base_link", "camera_link", link}, {"camera_link", "camera_color_optical_frame", optical}}, 0.0);
  }
  core::Result<std::shared_ptr<pipeline::RunObserver>> open(const std::string& frames, OdomTf odom_tf,
                                                            bool finished_map = false) {
    auto parsed = parse_published_frames(frames);
    EXPECT_TRUE(parsed) << parsed.error().message;
    parsed->odom_tf = odom_tf;
    parsed->finished_map = finished_map;
    auto observer = open_ros2_publisher(address(), PublishedNames::kOfOne, "", *parsed, *log_);
    if (observer) (*observer)->begins({"robot"});
    return observer;
  }

  /// The camera after t seconds: it drives along its axis, 1 m/s.
  static Rigid3 ahead(double t) {
    Rigid3 pose;
    pose.translation = {0.0, 0.0, t};
    return pose;
  }

  /// All transforms on /tf for a while, "parent -> child" with the latest pose.
  std::map<std::string, Rigid3> listen(std::chrono::milliseconds most) {
    std::map<std::string, Rigid3> edges;
    const auto end = std::chrono::steady_clock::now() + most;
    while (std::chrono::steady_clock::now() < end) {
      if (!subscribed_) subscribed_ = static_cast<bool>(heard_->subscribe("/tf"));
      const auto message = heard_->next(50ms);
      if (!message) continue;
      const auto transforms = dataset::read_transforms(message->bytes);
      if (!transforms) continue;
      for (const auto& [stamp, t] : *transforms) edges[t.parent + " -> " + t.child] = t.parent_from_child;
    }
    return edges;
  }

  /// Bytes of the latest message of a topic; empty: none within two seconds.
  std::vector<std::uint8_t> received(const std::string& topic) {
    const auto end = std::chrono::steady_clock::now() + 2s;
    bool subscribed = false;
    while (std::chrono::steady_clock::now() < end) {
      if (!subscribed) subscribed = static_cast<bool>(heard_->subscribe(topic));
      auto message = heard_->next(50ms);
      if (message && message->topic == topic) return std::move(message->bytes);
    }
    return {};
  }

  std::shared_ptr<core::Log> log_ = core::null_log();
  std::unique_ptr<dataset::MessageSink> urdf_;
  std::unique_ptr<dataset::MessageStream> heard_;
  bool subscribed_ = false;
};

TEST_F(Transforms, OfTheBaseAreThoseOfTheCameraThroughItsMount) {
  send_mount();
  const auto observer = open("base=base_link", OdomTf::kAuto);
  ASSERT_TRUE(observer) << observer.error().message;
  listen(500ms);
  for (int i = 0; i <= 10; ++i) {
    (*observer)->tracked(0, 100.0 + 0.1 * i, ahead(0.1 * i), ahead(0.1 * i));
    std::this_thread::sleep_for(10ms);
  }
  const auto edges = listen(1500ms);
  ASSERT_EQ(edges.size(), 2U) << edges.begin()->first;
  const Rigid3& base = edges.at("odom -> base_link");
  EXPECT_LT((base.translation - Eigen::Vector3d(1.0, 0.0, 0.0)).norm(), 1e-9) << base.translation.transpose();
  EXPECT_LT((edges.at("map -> odom").translation).norm(), 1e-9);
}

TEST_F(Transforms, ABaseThatSomebodyElseMovesKeepsOneParent) {
  send_mount();
  for (int i = 0; i < 3; ++i) {
    Rigid3 odometry;  // 2 % long, and elsewhere
    odometry.translation = {5.0 + 1.02 * 0.5 * i, 1.0, 0.0};
    send("/tf", {{"odom", "base_link", odometry}}, 100.0 + 0.5 * i);
  }
  const auto parsed = open("base=base_link", OdomTf::kOther);
  ASSERT_TRUE(parsed) << parsed.error().message;
  listen(500ms);
  for (int i = 0; i <= 10; ++i) {
    Rigid3 odometry;
    odometry.translation = {5.0 + 1.02 * 0.1 * i, 1.0, 0.0};
    send("/tf", {{"odom", "base_link", odometry}}, 100.0 + 0.1 * i);
    std::this_thread::sleep_for(60ms);
    (*parsed)->tracked(0, 100.0 + 0.1 * i, ahead(0.1 * i), ahead(0.1 * i));
  }
  const auto edges = listen(1500ms);
  const Rigid3& correction = edges.at("map -> odom");
  EXPECT_LT((correction.translation - Eigen::Vector3d(1.0 - 5.0 - 1.02, -1.0, 0.0)).norm(), 1e-6)
      << correction.translation.transpose();
  EXPECT_LT((edges.at("odom -> base_link").translation - Eigen::Vector3d(6.02, 1.0, 0.0)).norm(), 1e-6)
      << "only the other publisher's";
}

TEST_F(Transforms, ASecondParentStopsOurs) {
  send_mount();
  const auto observer = open("base=base_link", OdomTf::kAuto);
  ASSERT_TRUE(observer) << observer.error().message;
  listen(500ms);
  (*observer)->tracked(0, 100.0, ahead(0.0), ahead(0.0));
  EXPECT_EQ(listen(1000ms).count("odom -> base_link"), 1U);

  Rigid3 theirs;
  theirs.translation = {9.0, 0.0, 0.0};
  send("/tf", {{"odom", "base_link", theirs}}, 100.5);
  std::this_thread::sleep_for(500ms);
  (*observer)->tracked(0, 100.5, ahead(0.5), ahead(0.5));
  const auto edges = listen(1000ms);
  EXPECT_LT((edges.at("map -> odom").translation - Eigen::Vector3d(0.5 - 9.0, 0.0, 0.0)).norm(), 1e-6);
  const auto ours = edges.find("odom -> base_link");
  EXPECT_TRUE(ours == edges.end() || ours->second.translation.x() > 8.0);
}

TEST_F(Transforms, LostFramesKeepTheCorrection) {
  const auto observer = open("odom=wheels,camera=eye", OdomTf::kAuto);
  ASSERT_TRUE(observer) << observer.error().message;
  listen(300ms);
  (*observer)->tracked(0, 100.0, ahead(0.2), ahead(0.0));
  EXPECT_EQ(listen(800ms).size(), 2U);
  pipeline::LivePose lost;
  lost.stamp = 100.1;
  lost.state = "lost";
  (*observer)->processed(lost);
  const auto edges = listen(800ms);
  ASSERT_EQ(edges.size(), 1U);
  EXPECT_NEAR(edges.at("map -> wheels").translation.norm(), 0.2, 1e-9);
}

TEST_F(Transforms, InAFinishedMapItsFrameStaysWhereTheMapHasIt) {
  send_mount();
  const auto observer = open("base=base_link", OdomTf::kOwn, true);
  ASSERT_TRUE(observer) << observer.error().message;
  listen(500ms);

  // The base stands in the map's origin and looks along x: observers see the map turned to a camera's axes.
  Rigid3 optical_from_map;
  optical_from_map.rotation = mount().rotation.transpose();
  pipeline::LivePose pose;
  pose.stamp = 100.0;
  pose.world_from_camera = optical_from_map * mount();
  pose.sigma_position_m = 0.02;
  pose.sigma_rotation_rad = 0.01;
  (*observer)->processed(pose);
  (*observer)->tracked(0, pose.stamp, *pose.world_from_camera, *pose.world_from_camera);

  const auto edges = listen(1500ms);
  EXPECT_LT(edges.at("odom -> base_link").translation.norm(), 1e-9);
  EXPECT_LT(edges.at("map -> odom").translation.norm(), 1e-9);
  const auto bytes = received("/plumbline/pose");
  ASSERT_FALSE(bytes.empty());
  EXPECT_NE(std::string(bytes.begin(), bytes.end()).find("map"), std::string::npos);
}

TEST_F(Transforms, ABaseGetsAGridOfWhatKeyframesSaw) {
  send_mount();
  const auto observer = open("base=base_link", OdomTf::kOwn);
  ASSERT_TRUE(observer) << observer.error().message;
  listen(500ms);

  // A wall 2 m ahead, from the floor to 1 m over it, in the camera's axes.
  cloud::Cloud wall;
  for (float x = -0.5F; x < 0.5F; x += 0.01F) {
    for (float y = -0.5F; y < 0.5F; y += 0.01F) {
      cloud::Point point;
      point.getVector3fMap() = Eigen::Vector3f(x, y, 2.0F);
      wall.push_back(point);
    }
  }
  (*observer)->added(0, 100.0, Rigid3(), wall);
  const auto bytes = received("/plumbline/grid");
  ASSERT_GT(bytes.size(), 128U * 128U);
  EXPECT_NE(std::count(bytes.begin() + 100, bytes.end(), 100), 0) << "no cell is occupied";
}

TEST_F(Transforms, WithoutAMountItSaysWhatToStart) {
  const auto observer = open("base=base_link,camera=eye", OdomTf::kOwn);
  ASSERT_FALSE(observer);
  EXPECT_EQ(observer.error().kind, core::ErrorKind::kUsage);
  EXPECT_NE(observer.error().message.find("from base_link to eye"), std::string::npos)
      << observer.error().message;
  EXPECT_NE(observer.error().message.find("robot_state_publisher"), std::string::npos);
}

TEST(PublishedFramesText, WhatIsWrongIsNamed) {
  EXPECT_TRUE(parse_published_frames(""));
  EXPECT_FALSE(parse_published_frames("")->given());
  EXPECT_EQ(parse_published_frames("base=b,odom=o")->odom, "o");
  for (const char* wrong : {"bse=b", "base", "base=", "base=a,base=b", "base=a,,odom=o"}) {
    const auto frames = parse_published_frames(wrong);
    ASSERT_FALSE(frames) << wrong;
    EXPECT_NE(frames.error().message.find("map, odom, base, camera"), std::string::npos) << wrong;
  }
}

}  // namespace
}  // namespace plumbline::net
