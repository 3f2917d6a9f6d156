// SPDX-License-Identifier: BSD-3-Clause
// Two rooms that share a door frame, each with a map of its own, joined by places that are picked in both:
// plumbline fuse --pick.
#include <fmt/format.h>

#include <random>
#include <string>
#include <vector>

#include "program.hpp"
#include "true_frame.hpp"

namespace plumbline::integration {
namespace {

/// The door is in the wall between them, shut, so that each robot sees its own side of frame and leaf.
constexpr const char* kTwoRooms = R"(name: rooms
objects:
  - floor: {from: [-0.1, -0.1], to: [3.1, 3.4], material: planks}
  - floor: {from: [3.1, -0.1], to: [6.3, 3.4], material: carpet}
  - ceiling: {from: [-0.1, -0.1], to: [6.3, 3.4], height: 2.6}
  - wall: {name: south, from: [-0.06, -0.06], to: [6.26, -0.06]}
  - wall: {name: north, from: [6.26, 3.36], to: [-0.06, 3.36]}
  - wall: {name: west, from: [-0.06, 3.36], to: [-0.06, -0.06], material: brick}
  - wall: {name: east, from: [6.26, -0.06], to: [6.26, 3.36], material: paint_green}
  - wall: {name: between, from: [3.1, 0], to: [3.1, 3.3], material: plaster,
           doors: [{at: 1.2, width: 0.9, height: 2.05, leaf: false}]}
  - lamp: {at: [1.5, 1.7, 2.6], width: 0.6, depth: 0.6, power: 3}
  - lamp: {at: [4.7, 1.7, 2.6], width: 0.6, depth: 0.6, power: 3}
  - shelf: {at: [0.9, 3.12], size: [1.2, 0.32, 1.9]}
  - desk: {at: [0.9, 0.4], yaw: 180 deg}
  - clutter: {at: [0.9, 0.4, 0.74], width: 1.2, depth: 0.4, count: 5}
  - poster: {at: [0.9, 0, 1.5], yaw: 180 deg}
  - poster: {at: [3.04, 0.55, 1.5], yaw: -90 deg}
  - picture: {at: [3.04, 2.75, 1.5], yaw: -90 deg, size: [0.6, 0.5]}
  - poster: {at: [3.16, 2.75, 1.6], yaw: 90 deg}
  - picture: {at: [3.16, 0.6, 1.5], yaw: 90 deg, size: [0.6, 0.7]}
  - cabinet: {at: [5.4, 3.05], size: [1.2, 0.45, 0.9]}
  - plant: {at: [4.3, 2.9, 0], height: 1.3}
  - sofa: {at: [5.2, 0.5], yaw: 180 deg}
  - poster: {at: [5.2, 0, 1.5], yaw: 180 deg}
  - picture: {at: [5.4, 3.3, 1.6], size: [1.0, 0.6]}
robots:
  - {name: west, closed: true, speed: 0.5, turn_rate: 0.7, height: 1.3, pitch: -6 deg,
     path: [{at: [2.3, 1.95], look: [3.1, 1.25, 1.2]}, {at: [2.3, 1.35], look: [3.1, 2.05, 1.2]},
            {at: [1.7, 1.5], look: [1.4, 3.3, 1.2]}, {at: [1.5, 1.7], look: [0, 1.7, 1.2]},
            {at: [1.6, 1.9], look: [1.0, 0, 1.1]}, {at: [2.0, 2.0], look: [2.6, 0, 1.2]}]}
  - {name: east, closed: true, speed: 0.5, turn_rate: 0.7, height: 1.4, pitch: -6 deg,
     path: [{at: [3.9, 1.35], look: [3.1, 2.05, 1.2]}, {at: [3.9, 1.95], look: [3.1, 1.25, 1.2]},
            {at: [4.4, 1.9], look: [4.8, 0, 1.1]}, {at: [4.7, 1.7], look: [6.2, 1.6, 1.2]},
            {at: [4.6, 1.4], look: [5.2, 3.3, 1.2]}, {at: [4.2, 1.3], look: [3.8, 3.3, 1.2]}]}
)";

class Picks : public ProgramTest {
 protected:
  static constexpr const char* kLean = " --set output.views= --set output.pcd=off --set fuse.voxel=3cm";

  void SetUp() override {
    write("rooms.yaml", kTwoRooms);
    const Outcome filmed =
        run("synth rooms.yaml -o world --robots 2 --frames 64 --fps 6 --width 320 --height 240 "
            "--reference-spacing 10cm -q");
    ASSERT_EQ(filmed.code, 0) << filmed;
    for (const int robot : {0, 1}) {
      const Outcome mapped =
          run(fmt::format("map world/robot{} -o m{} -q --set output.lines=off", robot, robot) + kLean);
      ASSERT_EQ(mapped.code, 0) << mapped;
      const Eigen::Matrix4d frame =
          true_frame(path(fmt::format("m{}/trajectory.txt", robot)), truth_of(robot), false);
      ASSERT_GT(frame.norm(), 0.0);
      map_from_world_.push_back(frame.inverse());
    }
  }

  [[nodiscard]] fs::path truth_of(int robot) const {
    return path(fmt::format("world/robot{}/groundtruth.txt", robot));
  }

  /// A place of the world in a map, as somebody picked it.
  [[nodiscard]] std::string picked(std::size_t map, const Eigen::Vector3d& place) {
    std::normal_distribution<double> noise(0.0, 0.005);
    Eigen::Vector3d p = (map_from_world_[map] * place.homogeneous()).head<3>();
    for (double& v : p) v += noise(random_);
    return fmt::format("{:.4f},{:.4f},{:.4f}", p.x(), p.y(), p.z());
  }
  /// The same place in both; `off`: what is wrong with the second one.
  [[nodiscard]] std::string pick(const Eigen::Vector3d& place,
                                 const Eigen::Vector3d& off = Eigen::Vector3d::Zero()) {
    return " --pick " + picked(0, place) + "=" + picked(1, place + off);
  }
  [[nodiscard]] Outcome fuse(const std::string& arguments) const {
    return run("fuse m0 m1 --force --set output.lines=off" + std::string(kLean) + " " + arguments);
  }

  /// Error of the second robot's path, metres, where the first one's lies as well as it can.
  [[nodiscard]] double apart(const std::string& result) const {
    const fs::path first = path(result + "/robots/m0/trajectory.txt"),
                   second = path(result + "/robots/m1/trajectory.txt");
    const Eigen::Matrix4d frame = true_frame(first, truth_of(0), false);
    const auto [from, to] = common_places(second, truth_of(1));
    if (from.size() < 30) return 1e3;
    double squares = 0.0;
    for (std::size_t i = 0; i < from.size(); ++i)
      squares += ((frame * from[i].homogeneous()).head<3>() - to[i]).squaredNorm();
    return std::sqrt(squares / static_cast<double>(from.size()));
  }

  // On the faces of both jambs that look at each other, in the middle of the wall.
  const Eigen::Vector3d south_{3.1, 1.21, 1.2}, north_{3.1, 2.09, 1.2}, low_{3.1, 1.21, 0.7},
      high_{3.1, 2.09, 1.6};
  std::vector<Eigen::Matrix4d> map_from_world_;
  std::mt19937 random_{7};
};

TEST_F(Picks, BothJambsJoinMapsThatPlacesDoNot) {
  const Outcome alone = fuse("-o alone");
  EXPECT_EQ(alone.code, 4) << alone;
  EXPECT_TRUE(alone.told("do not connect")) << alone;

  const std::string jambs = pick(south_) + pick(north_);
  const Outcome two = fuse("-o two" + jambs);
  ASSERT_EQ(two.code, 0) << two;
  EXPECT_LT(apart("two"), 0.02);
  EXPECT_EQ(read_json(path("two/summary.json"))["merges"].size(), 1U);

  // Whichever map is named first.
  std::string other = "fuse m1 m0 -o four --set output.lines=off" + std::string(kLean);
  for (const Eigen::Vector3d& place : {south_, north_, low_, high_})
    other += " --pick " + picked(1, place) + "=" + picked(0, place);
  const Outcome four = run(other);
  ASSERT_EQ(four.code, 0) << four;
  EXPECT_LT(apart("four"), 0.02);
}

TEST_F(Picks, WhatIsWrongIsNamed) {
  const Outcome single = fuse("-o none" + pick(south_));
  EXPECT_EQ(single.code, 2) << single;
  EXPECT_TRUE(single.told("a single pick")) << single;

  // One above the other: they leave the turn open, too.
  const Outcome plumb = fuse("-o none" + pick(south_) + pick(low_));
  EXPECT_EQ(plumb.code, 2) << plumb;
  EXPECT_TRUE(plumb.told("at least 20 cm from each other")) << plumb;

  const Eigen::Vector3d air(3.1, 1.65, 1.3);
  const Outcome beside = fuse("-o none" + pick(south_) + pick(north_) + pick(air));
  EXPECT_EQ(beside.code, 2) << beside;
  EXPECT_TRUE(beside.told("pick 3: in m")) << beside;
  EXPECT_TRUE(beside.told("no keyframe saw a surface")) << beside;

  const Outcome two = fuse("-o none" + pick(south_) + pick(north_, {0.0, 0.4, 0.0}));
  EXPECT_EQ(two.code, 2) << two;
  EXPECT_TRUE(two.told("picks 1 and 2 contradict each other: ")) << two;
  EXPECT_TRUE(two.told("0.8")) << two;
  EXPECT_TRUE(two.told("1.2")) << two;

  // Of four the wrong one is named, though it moves the others as well.
  const Outcome four =
      fuse("-o none" + pick(south_) + pick(low_) + pick(north_, {0.0, 0.4, 0.0}) + pick(high_));
  EXPECT_EQ(four.code, 2) << four;
  EXPECT_TRUE(four.told("pick 3 is ")) << four;
  EXPECT_FALSE(fs::exists(path("none")));

  EXPECT_EQ(fuse("-o none --pick 1,2,3").code, 2);
  EXPECT_EQ(run("fuse m0 m1 m0 -o none" + pick(south_) + pick(north_)).code, 2);
}

}  // namespace
}  // namespace plumbline::integration
