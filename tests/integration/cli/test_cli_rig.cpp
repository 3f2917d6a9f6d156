// SPDX-License-Identifier: BSD-3-Clause
// Several cameras on one robot: --rig.
#include <cmath>
#include <string>

#include "plumbline/core/numbers.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

using geometry::Rigid3;

Rigid3 pose_of(const nlohmann::json& position, const nlohmann::json& rotation) {
  return {Eigen::Quaterniond(rotation[3].get<double>(), rotation[0].get<double>(), rotation[1].get<double>(),
                             rotation[2].get<double>()),
          Eigen::Vector3d(position[0].get<double>(), position[1].get<double>(), position[2].get<double>())};
}

class Rig : public ProgramTest {
 protected:
  static constexpr const char* kLean =
      " -q --set output.views= --set output.pcd=off --set cloud.filters=[] --set fuse.voxel=3cm";

  /// Two cameras back to back, filmed while they are carried through a room.
  void film(const std::string& options, const std::string& scene = "room") const {
    write("body.yaml",
          "cameras:\n  - {at: [0, 0, 0]}\n  - {at: [-0.1, 0.02, 0.03], yaw: 176 deg, pitch: 4 deg}\n");
    write("unknown.yaml", "cameras: {robot0: {}, robot1: {}}\n");
    const Outcome filmed =
        run("synth " + scene + " -o world --rig body.yaml --fps 10 --reference-spacing 5cm -q " + options);
    ASSERT_EQ(filmed.code, 0) << filmed;
  }
  /// robot0_from_robot1
  [[nodiscard]] Rigid3 truth() const {
    const auto robots = read_json(path("world/scene.json"))["robots"];
    const auto on_body = [&](int i) {
      const auto& at = robots[static_cast<std::size_t>(i)]["body_from_camera"];
      return pose_of(at["position_m"], at["quaternion_xyzw"]);
    };
    return on_body(0).inverse() * on_body(1);
  }
  [[nodiscard]] Rigid3 told(const std::string& result) const {
    const auto camera = read_json(path(result) / "summary.json")["rig"]["cameras"][0];
    return pose_of(camera["position"], camera["rotation"]);
  }
  /// Both cameras' paths lie in one frame: one follows from the other.
  void expect_one_frame(const std::string& result) const {
    const auto a = dataset::read_trajectory(path(result) / "robots/robot0/trajectory.txt");
    const auto b = dataset::read_trajectory(path(result) / "robots/robot1/trajectory.txt");
    ASSERT_TRUE(a.has_value() && b.has_value());
    std::vector<double> off_m, off_rad;
    for (const auto& pose : *b) {
      const auto at = geometry::pose_at(*a, pose.stamp, 0.15);
      if (!at) continue;
      const Rigid3 follows = *at * truth();
      off_m.push_back((follows.translation - pose.world_from_camera.translation).norm());
      off_rad.push_back(
          geometry::rotation_angle(follows.rotation.transpose() * pose.world_from_camera.rotation));
    }

    // Between two frames of a fast turn the interpolated pose itself is off.
    ASSERT_GT(10 * off_m.size(), 8 * b->size());
    EXPECT_LT(core::quantile(off_m, 0.95), 0.02);
    EXPECT_LT(core::quantile(off_rad, 0.95), 0.01);
  }
  /// Share of what the cameras could see that is in the cloud.
  [[nodiscard]] double recall(const std::string& result, const std::string& path_in_it) const {
    const Outcome o = run("evaluate cloud " + result + " world --align se3 --json --trajectory " + result +
                          "/" + path_in_it + " --truth world/robot0");
    const auto report = nlohmann::json::parse(o.out, nullptr, false);
    EXPECT_EQ(o.code, 0) << o;
    return o.code == 0 ? report["at"]["20mm"]["recall"].get<double>() : 0.0;
  }
};

TEST_F(Rig, CamerasBackToBackAreFoundFromTheirMotion) {
  film("--frames 240 --width 480 --height 360");
  const Outcome one =
      run("map world/robot0 world/robot1 --rig unknown.yaml -o one" + std::string(kLean).replace(0, 3, ""));
  ASSERT_EQ(one.code, 0) << one;
  EXPECT_TRUE(one.told("rig: robot1 is")) << one;
  EXPECT_TRUE(one.told("are cameras of one rig")) << one;
  EXPECT_LT((told("one").translation - truth().translation).norm(), 0.005);
  EXPECT_LT(geometry::rotation_angle(told("one").rotation.transpose() * truth().rotation),
            0.2 * M_PI / 180.0);
  expect_one_frame("one");

  const auto summary = read_json(path("one/summary.json"));
  EXPECT_EQ(summary["rig"]["reference"], "robot0");
  EXPECT_EQ(summary["rig"]["cameras"][0]["pose"], "found");
  EXPECT_GT(summary["rig"]["cameras"][0]["pairs"], 5);
  EXPECT_EQ(summary["merges"][0]["by"], "rig");
  EXPECT_TRUE(summary["merges"][0]["accepted"]);

  // Both look at different sides of the room from the same path.
  ASSERT_EQ(run("map world/robot0 -o alone" + std::string(kLean)).code, 0);
  EXPECT_GT(recall("one", "robots/robot0/trajectory.txt"), 1.5 * recall("alone", "trajectory.txt"));
}

TEST_F(Rig, FinishedMapsWithAGivenPose) {
  film("--frames 120 --width 320 --height 240");
  for (const char* robot : {"0", "1"}) {
    const Outcome mapped = run(std::string("map world/robot") + robot + " -o robot" + robot + kLean);
    ASSERT_EQ(mapped.code, 0) << mapped;
  }
  const std::string lean = " --set output.pcd=off --set fuse.voxel=3cm --set output.views=";
  const Outcome fused = run("fuse robot0 robot1 --rig world/rig.yaml -o both" + lean);
  ASSERT_EQ(fused.code, 0) << fused;
  EXPECT_TRUE(fused.told("given")) << fused;
  EXPECT_EQ(read_json(path("both/summary.json"))["rig"]["cameras"][0]["pose"], "given");
  expect_one_frame("both");

  // The order of the maps and the threads leave no trace; the result's own file can be given, too.
  const Outcome turned = run("fuse robot1 robot0 --rig world/rig.yaml -o turned --threads 1 -q" + lean);
  ASSERT_EQ(turned.code, 0) << turned;
  for (const char* file :
       {"map.ply", "rig.yaml", "robots/robot0/trajectory.txt", "robots/robot1/trajectory.txt"})
    EXPECT_EQ(slurp(path("both") / file), slurp(path("turned") / file)) << file;
  const Outcome again = run("fuse robot0 robot1 --rig both/rig.yaml -o again -q" + lean);
  ASSERT_EQ(again.code, 0) << again;
  EXPECT_EQ(slurp(path("both/rig.yaml")), slurp(path("again/rig.yaml")));

  // A pose the other way round is noticed.
  const Rigid3 inverse = truth().inverse();
  const Eigen::Quaterniond q = inverse.quaternion();
  std::ostringstream wrong;
  wrong << "cameras: {robot0: {}, robot1: {position: [" << inverse.translation.x() << ", "
        << inverse.translation.y() << ", " << inverse.translation.z() << "], rotation: [" << q.x() << ", "
        << q.y() << ", " << q.z() << ", " << q.w() << "]}}\n";
  write("wrong.yaml", wrong.str());
  const Outcome noticed = run("fuse robot0 robot1 --rig wrong.yaml -o noticed" + lean);
  EXPECT_TRUE(noticed.told("off the given one")) << noticed;
}

TEST_F(Rig, WheelsNeedTheHeightBetweenTheCameras) {
  // A path on which the camera keeps its height and its tilt.
  std::string scene = slurp(fs::path(PLUMBLINE_SOURCE_DIR) / "pipelines/scenes/room.yaml");
  scene.erase(scene.find("robots:"));
  write("wheels.yaml", scene +
                           "robots:\n  - name: cart\n    closed: true\n    speed: 0.4\n    turn_rate: 0.5\n"
                           "    height: 1.2\n    pitch: -8 deg\n    path:\n"
                           "      - {at: [3.4, 1.0]}\n      - {at: [3.6, 2.0]}\n      - {at: [3.0, 2.8]}\n"
                           "      - {at: [2.4, 2.4]}\n      - {at: [2.3, 1.4]}\n      - {at: [2.8, 0.9]}\n");
  film("--frames 240 --width 320 --height 240 --motion wheeled", "wheels.yaml");
  const Outcome open = run("map world/robot0 world/robot1 --rig unknown.yaml -o open" + std::string(kLean));
  EXPECT_EQ(open.code, 3) << open;
  EXPECT_TRUE(open.told("the motion does not show its position along")) << open;
  EXPECT_TRUE(open.told("--resume")) << open;

  // The same run is continued with what was measured.
  write("unknown.yaml",
        "cameras: {robot0: {}, robot1: {position: [0, -0.03, 0], sigma: {position: [10 m, 3 mm, 10 m]}}}\n");
  const Outcome known =
      run("map world/robot0 world/robot1 --rig unknown.yaml -o open --resume" + std::string(kLean));
  ASSERT_EQ(known.code, 0) << known;
  EXPECT_LT((told("open").translation - truth().translation).norm(), 0.01);
  expect_one_frame("open");
}

TEST_F(Rig, MistakesOfTheCommandLine) {
  film("--frames 12 --width 320 --height 240");
  const std::string lean = kLean;
  const Outcome alone = run("map world/robot0 --rig unknown.yaml -o out" + lean);
  EXPECT_EQ(alone.code, 2) << alone;
  EXPECT_TRUE(alone.told("the cameras of one robot")) << alone;
  write("names.yaml", "cameras: {robot0: {}, robot2: {}}\n");
  const Outcome names = run("map world/robot0 world/robot1 --rig names.yaml -o out" + lean);
  EXPECT_EQ(names.code, 2) << names;
  EXPECT_TRUE(names.told("cameras.robot2")) << names;
  const Outcome into = run("map world/robot0 world/robot1 --rig unknown.yaml --into out -o out2" + lean);
  EXPECT_EQ(into.code, 2) << into;
  EXPECT_TRUE(into.told("--rig")) << into;
  const Outcome posed = run("map world/robot0 world/robot1 --rig unknown.yaml --poses given -o out" + lean);
  EXPECT_EQ(posed.code, 2) << posed;
  const Outcome localized = run("localize out world/robot0 --rig unknown.yaml -o out2");
  EXPECT_EQ(localized.code, 2) << localized;
  EXPECT_FALSE(fs::exists(path("out")));
}

}  // namespace
}  // namespace plumbline::integration
