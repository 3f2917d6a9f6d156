// SPDX-License-Identifier: BSD-3-Clause
// Maps of cameras on one body that see nothing in common: only their motion ties them.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/mapping/merging/map_fusion.hpp"
#include "random_world.hpp"
#include "robots/rig_merge.hpp"

namespace plumbline::pipeline {
namespace {

using geometry::Rigid3;

constexpr double kFrame_s = 0.1;
constexpr int kFramesOfKeyframe = 8;

Rigid3 front_from_back() {
  return {geometry::exp_so3({0.0, 3.0, 0.0}) * geometry::exp_so3({0.1, 0.0, -0.05}),
          Eigen::Vector3d(0.02, -0.03, -0.1)};
}

Rigid3 handheld(double t) {
  const Eigen::Vector3d turns(0.3 * std::sin(1.1 * t), 0.9 * std::sin(0.6 * t), 0.25 * std::sin(1.7 * t));
  return {geometry::exp_so3(turns), Eigen::Vector3d(std::sin(0.4 * t), 0.1 * std::sin(1.3 * t), 0.05 * t)};
}
Rigid3 wheels(double t) {
  return {geometry::exp_so3({0.0, 0.9 * std::sin(0.6 * t), 0.0}), Eigen::Vector3d(0.1 * t, 0.0, 0.2 * t)};
}

class Words : public core::Log {
 public:
  void write(core::LogLevel level, const std::string& message) override {
    if (level == core::LogLevel::kWarning) warnings += message + "\n";
    all += message + "\n";
  }
  std::string all, warnings;
};

/// The map of a camera that is on the body at `x`, in a world of its own. `first`: number of its first
/// keyframe.
RobotMap map_of(std::int32_t robot, const std::string& name, Rigid3 (*body)(double), const Rigid3& x,
                double from_s, double to_s, double late_s = 0.0, int first = 0) {
  RobotMap part;
  part.name = name;
  part.robots.push_back({robot, name, {}});
  part.robots.front().camera.color = {64, 48, 50.0, 50.0, 31.5, 23.5};
  auto map = std::make_shared<maps::Map>();
  const Rigid3 world(geometry::exp_so3({0.4 * robot, -1.0, 0.3}),
                     Eigen::Vector3d(3.0 * robot, 1.0, 0.1 * first));
  tests::Random random(static_cast<std::uint32_t>(robot + 1));

  core::KeyframeId reference;
  int frame = 0;
  for (double t = from_s; t < to_s; t += kFrame_s, ++frame) {
    const Rigid3 camera_from_world = (world * body(t) * x).inverse();
    if (frame % kFramesOfKeyframe == 0) {
      auto keyframe = std::make_shared<maps::Keyframe>();
      keyframe->id = {robot, first + frame / kFramesOfKeyframe};
      keyframe->stamp = 50.0 + t - late_s;
      keyframe->features = std::make_shared<features::FrameFeatures>();
      if (reference.valid()) {
        keyframe->reference = reference;
        keyframe->camera_from_reference = camera_from_world * map->camera_from_world(reference).inverse();
        keyframe->reference_sigma_m = 0.003;
      }
      reference = map->add_keyframe(keyframe, camera_from_world);
    }
    maps::FramePose pose;
    pose.stamp = 50.0 + t - late_s;
    pose.reference = reference;
    pose.camera_from_reference =
        random.step(5e-4, 2e-4) * camera_from_world * map->camera_from_world(reference).inverse();
    pose.tracked = true;
    part.frame_poses.push_back(pose);
  }
  part.map = map;
  return part;
}

Rig rig_of(const std::vector<std::string>& names) {
  Rig rig;
  rig.file = "rig.yaml";
  for (const std::string& name : names) {
    rig.cameras.emplace_back();
    rig.cameras.back().name = name;
  }
  return rig;
}

void expect_truth(const RigMerge& merge, double metres) {
  const Rigid3& found = merge.cameras.front().pose.reference_from_camera;
  EXPECT_LT((found.translation - front_from_back().translation).norm(), metres);
  EXPECT_LT(geometry::rotation_angle(found.rotation.transpose() * front_from_back().rotation), 0.003);
}

/// Both maps lie in one frame: the paths differ by the pose of the cameras alone.
void expect_one_frame(const std::vector<RobotMap>& parts, std::vector<mapping::MergeEvidence> merges,
                      Rigid3 (*body)(double), double late_s) {
  std::vector<mapping::MapPart> maps;
  for (const RobotMap& part : parts)
    maps.push_back({part.map.get(), {{part.robots.front().number, part.robots.front().camera.color}}});
  const mapping::FusedMap fused = mapping::fuse_maps(maps, merges, 0, mapping::MapFusionOptions());
  EXPECT_EQ(fused.parts.size(), parts.size());
  EXPECT_EQ(fused.rejected, 0);

  const core::KeyframeId first = fused.map.keyframe_ids().front();
  ASSERT_EQ(first.robot, 0);
  const Rigid3 world_from_body =
      fused.map.camera_from_world(first).inverse() * body(fused.map.keyframe(first).stamp - 50.0).inverse();
  for (const core::KeyframeId id : fused.map.keyframe_ids()) {
    const bool is_front = id.robot == 0;
    const double t = fused.map.keyframe(id).stamp - 50.0 + (is_front ? 0.0 : late_s);
    const Rigid3 truth = world_from_body * body(t) * (is_front ? Rigid3() : front_from_back());
    const Rigid3 pose = fused.map.camera_from_world(id).inverse();
    EXPECT_LT((pose.translation - truth.translation).norm(), 0.01) << id.robot << " " << id.index;
    EXPECT_LT(geometry::rotation_angle(pose.rotation.transpose() * truth.rotation), 0.01);
  }
}

TEST(RigMerge, CamerasBackToBackAreFoundAndJoined) {
  // The second camera takes its frames between those of the first.
  Words log;
  const std::vector<RobotMap> parts = {map_of(0, "front", handheld, {}, 0.0, 30.0),
                                       map_of(1, "back", handheld, front_from_back(), 0.033, 30.0)};
  const auto merge = rig_merge(rig_of({"front", "back"}), parts, log);
  ASSERT_TRUE(merge) << merge.error().message;
  ASSERT_EQ(merge->merges.size(), 1U);
  EXPECT_TRUE(merge->cameras.front().found);
  EXPECT_STREQ(merge->cameras.front().offset_is, "none");
  EXPECT_GT(merge->cameras.front().pairs, 30U);
  expect_truth(*merge, 0.003);
  expect_one_frame(parts, merge->merges, handheld, 0.0);
  EXPECT_NE(log.all.find("rig: back is"), std::string::npos) << log.all;
  EXPECT_EQ(section_of(*merge)["cameras"][0]["pose"], "found");
}

TEST(RigMerge, EitherCameraMayBeTheReferenceAndItsClockLate) {
  Words log;
  const double late = 0.12;
  const std::vector<RobotMap> parts = {map_of(0, "front", handheld, {}, 0.0, 30.0),
                                       map_of(1, "back", handheld, front_from_back(), 0.0, 30.0, late)};
  const auto merge = rig_merge(rig_of({"back", "front"}), parts, log);
  ASSERT_TRUE(merge) << merge.error().message;
  EXPECT_STREQ(merge->cameras.front().offset_is, "found");
  EXPECT_NEAR(merge->cameras.front().time_offset_s, -late, 0.004);
  const Rigid3 back_from_front = merge->cameras.front().pose.reference_from_camera;
  EXPECT_LT((back_from_front.inverse().translation - front_from_back().translation).norm(), 0.006);
  expect_one_frame(parts, merge->merges, handheld, late);
}

TEST(RigMerge, ACameraThatWasLostIsJoinedInBothOfItsMaps) {
  Words log;
  const std::vector<RobotMap> parts = {map_of(0, "front", handheld, {}, 0.0, 30.0),
                                       map_of(1, "back", handheld, front_from_back(), 0.0, 14.0),
                                       map_of(1, "back", handheld, front_from_back(), 16.0, 30.0, 0.0, 100)};
  const auto merge = rig_merge(rig_of({"front", "back"}), parts, log);
  ASSERT_TRUE(merge) << merge.error().message;
  EXPECT_EQ(merge->merges.size(), 2U);
  expect_truth(*merge, 0.004);
  expect_one_frame(parts, merge->merges, handheld, 0.0);
}

TEST(RigMerge, GivenPosesAreUsedAndThoseTheWrongWayRoundNoticed) {
  const std::vector<RobotMap> parts = {map_of(0, "front", handheld, {}, 0.0, 20.0),
                                       map_of(1, "back", handheld, front_from_back(), 0.0, 20.0)};
  Rig rig = rig_of({"front", "back"});
  rig.cameras[1].position = front_from_back().translation;
  rig.cameras[1].rotation = front_from_back().quaternion();
  Words quiet;
  const auto given = rig_merge(rig, parts, quiet);
  ASSERT_TRUE(given) << given.error().message;
  EXPECT_FALSE(given->cameras.front().found);
  EXPECT_TRUE(quiet.warnings.empty()) << quiet.warnings;
  expect_truth(*given, 1e-9);
  expect_one_frame(parts, given->merges, handheld, 0.0);

  // What is written is read again as given.
  const std::string yaml = to_yaml(*given);
  EXPECT_NE(yaml.find("\"back\":\n    position: [0.020000, -0.030000, -0.100000]"), std::string::npos)
      << yaml;

  Words loud;
  rig.cameras[1].position = front_from_back().inverse().translation;
  rig.cameras[1].rotation = front_from_back().inverse().quaternion();
  ASSERT_TRUE(rig_merge(rig, parts, loud));
  EXPECT_NE(loud.warnings.find("off the given one"), std::string::npos) << loud.all;
}

TEST(RigMerge, WheelsNeedTheHeightBetweenTheCameras) {
  Words log;
  const std::vector<RobotMap> parts = {map_of(0, "front", wheels, {}, 0.0, 30.0),
                                       map_of(1, "back", wheels, front_from_back(), 0.0, 30.0)};
  Rig rig = rig_of({"front", "back"});
  const auto open = rig_merge(rig, parts, log);
  ASSERT_FALSE(open);
  EXPECT_NE(open.error().message.find("its position along"), std::string::npos) << open.error().message;

  rig.cameras[1].position = Eigen::Vector3d(0.0, -0.03, 0.0);
  rig.cameras[1].sigma_m = Eigen::Vector3d(10.0, 0.003, 10.0);
  const auto known = rig_merge(rig, parts, log);
  ASSERT_TRUE(known) << known.error().message;
  expect_truth(*known, 0.006);
  expect_one_frame(parts, known->merges, wheels, 0.0);
}

TEST(RigMerge, CamerasThatWereNeverOnTogether) {
  Words log;
  const std::vector<RobotMap> parts = {map_of(0, "front", handheld, {}, 0.0, 10.0),
                                       map_of(1, "back", handheld, front_from_back(), 40.0, 50.0)};
  const auto none = rig_merge(rig_of({"front", "back"}), parts, log);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("give time_offset"), std::string::npos) << none.error().message;
}

}  // namespace
}  // namespace plumbline::pipeline
