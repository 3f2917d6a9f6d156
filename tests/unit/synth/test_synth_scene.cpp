// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {
namespace {

const std::string kShippedScenes = std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes";
const std::string kRobots = "robots:\n  - path: [[0, 0], [1, 0]]\n";

std::string problem(const std::string& yaml) {
  const auto scene = parse_scene(yaml, "test.yaml");
  return scene ? "" : scene.error().message;
}

TEST(SynthScene, EveryShippedSceneLoads) {
  const auto names = core::yaml_names(kShippedScenes);
  EXPECT_EQ(names, (std::vector<std::string>{"corridor", "office", "plane", "room", "structure"}));
  for (const std::string& name : names) {
    const auto scene = load_scene(name, kShippedScenes);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->name, name);
    EXPECT_GE(scene->robots.size(), 2U);
    EXPECT_FALSE(scene->lamps.empty());
  }
}

TEST(SynthScene, UnknownSceneSuggestsOne) {
  const auto scene = load_scene("rom", kShippedScenes);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().kind, core::ErrorKind::kUsage);
  EXPECT_NE(scene.error().message.find("did you mean room"), std::string::npos) << scene.error().message;
  EXPECT_FALSE(load_scene("", kShippedScenes));
  EXPECT_FALSE(load_scene("/nowhere/at/all.yaml", kShippedScenes));
}

TEST(SynthScene, BoxHasSixFacesThatLookOutwards) {
  const auto scene =
      parse_scene("objects:\n  - box: {at: [1, 2, 3], size: [2, 4, 6], yaw: 30 deg}\n" + kRobots, "t");
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->faces.size(), 6U);
  const Eigen::Vector3d center(1.0, 2.0, 6.0);
  double area = 0.0;
  for (const Face& f : scene->faces) {
    ASSERT_EQ(f.polygon.size(), 4U);
    const Eigen::Vector2d size = f.polygon[2] - f.polygon[0];
    const Eigen::Vector3d middle =
        f.at(0.5 * (f.polygon[0] + f.polygon[2]).x(), 0.5 * (f.polygon[0] + f.polygon[2]).y());
    EXPECT_GT((middle - center).dot(f.normal), 0.9);
    EXPECT_NEAR((f.u_axis.cross(f.v_axis) - f.normal).norm(), 0.0, 1e-12);
    area += std::abs(size.x() * size.y());
  }
  EXPECT_NEAR(area, 2.0 * (2 * 4 + 2 * 6 + 4 * 6), 1e-9);
}

TEST(SynthScene, WallWithADoorLeavesTheOpeningFree) {
  const auto scene = parse_scene(
      "objects:\n  - wall: {from: [0, 0], to: [4, 0], height: 2.5, thickness: 0.1,\n"
      "           doors: [{at: 1, width: 1, height: 2, leaf: false}]}\n" +
          kRobots,
      "t");
  ASSERT_TRUE(scene) << scene.error().message;
  for (const Face& f : scene->faces) {
    if (f.material != "plaster" || std::abs(f.normal.y()) < 0.5) continue;
    for (const Eigen::Vector2d& uv : f.polygon) {
      const Eigen::Vector3d p = f.at(uv.x(), uv.y());
      EXPECT_FALSE(p.x() > 1.01 && p.x() < 1.99 && p.z() < 1.99) << p.transpose();
    }
  }
}

TEST(SynthScene, ProblemsNamePlaceAndRemedyAllAtOnce) {
  const std::string what = problem(
      "objects:\n  - wall: {from: [1, 1], to: [1, 1]}\n  - boxx: {at: [0, 0, 0]}\n"
      "  - desk: {at: [0, 0], colour: red}\n  - box: {at: [0, 0, 0], size: [0, 1, 1]}\n" +
      kRobots);
  EXPECT_NE(what.find("test.yaml:2"), std::string::npos) << what;
  EXPECT_NE(what.find("degenerate wall"), std::string::npos) << what;
  EXPECT_NE(what.find("test.yaml:3"), std::string::npos) << what;
  EXPECT_NE(what.find("did you mean box"), std::string::npos) << what;
  EXPECT_NE(what.find("test.yaml:4"), std::string::npos) << what;
  EXPECT_NE(what.find("colour"), std::string::npos) << what;
  EXPECT_NE(what.find("test.yaml:5"), std::string::npos) << what;
}

TEST(SynthScene, RefusesWhatIsNoScene) {
  EXPECT_NE(problem(""), "");
  EXPECT_NE(problem("just text"), "");
  EXPECT_NE(problem("objects: 3\n" + kRobots).find("list"), std::string::npos);
  EXPECT_NE(problem(kRobots).find("objects"), std::string::npos);
  EXPECT_NE(problem("objects:\n  - floor: {from: [0, 0], to: [1, 1]}\n").find("robot"), std::string::npos);
  EXPECT_NE(problem("objects:\n  - floor: {from: [0, 0], to: [0, 1]}\n" + kRobots).find("degenerate"),
            std::string::npos);
  EXPECT_NE(problem("objects:\n  - box: {at: [0, 0], size: [1, 1, 1]}\n" + kRobots), "");
  EXPECT_NE(problem("objects:\n  - panels: {points: [[0, 0], [0, 0]]}\n" + kRobots).find("degenerate"),
            std::string::npos);
  EXPECT_NE(
      problem("objects:\n  - wall: {from: [0, 0], to: [2, 0], doors: [{at: 1.5, width: 1}]}\n" + kRobots)
          .find("does not fit"),
      std::string::npos);
  EXPECT_NE(problem("objects:\n  - floor: {from: [0, 0], to: [1, 1]}\nrobots:\n  - path: [[0, 0], [0, 0]]\n")
                .find("same place"),
            std::string::npos);
  EXPECT_NE(
      problem("motoin: wheeled\nobjects:\n  - floor: {from: [0, 0], to: [1, 1]}\n" + kRobots).find("motion"),
      std::string::npos);
}

TEST(SynthOptionsTest, EventsAreReadAndRefused) {
  const auto events = parse_events("whiteout@3+1, blur@6+0.5*12");
  ASSERT_TRUE(events) << events.error().message;
  ASSERT_EQ(events->size(), 2U);
  EXPECT_EQ((*events)[1].kind, EventKind::kBlur);
  EXPECT_DOUBLE_EQ((*events)[1].start_s, 6.0);
  EXPECT_DOUBLE_EQ((*events)[1].duration_s, 0.5);
  EXPECT_DOUBLE_EQ((*events)[1].value, 12.0);
  EXPECT_TRUE((*events)[0].active(3.0));
  EXPECT_FALSE((*events)[0].active(4.0));
  EXPECT_TRUE(parse_events("")->empty());
  for (const char* bad : {"blur", "blur@", "blur@1", "blur@1+0", "blur@-1+1", "blur@1+1*x", "blurr@1+1",
                          "@1+1", "blur@nan+1"}) {
    EXPECT_FALSE(parse_events(bad)) << bad;
  }
  EXPECT_NE(parse_events("blurr@1+1").error().message.find("did you mean blur"), std::string::npos);
}

TEST(SynthOptionsTest, ZeroFramesAreAnError) {
  SynthOptions options;
  EXPECT_TRUE(check(options));
  options.frames = 0;
  ASSERT_FALSE(check(options));
  EXPECT_NE(check(options).error().message.find("zero frames"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::synth
