// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "plumbline/pipeline/rig.hpp"

namespace plumbline::pipeline {
namespace {

class RigFile : public testing::Test {
 protected:
  ~RigFile() override { std::filesystem::remove(file_); }
  core::Result<Rig> read(const std::string& text) const {
    std::ofstream(file_) << text;
    return read_rig(file_);
  }
  std::string wrong(const std::string& text) const {
    const auto rig = read(text);
    return rig ? "" : rig.error().message;
  }
  std::filesystem::path file_ = std::filesystem::path(testing::TempDir()) /
                                ("plumbline_rig_file_" + std::to_string(::getpid()) + ".yaml");
};

std::vector<maps::RobotInfo> robots(const std::vector<std::string>& names) {
  std::vector<maps::RobotInfo> robots;
  for (const std::string& name : names)
    robots.push_back({static_cast<std::int32_t>(robots.size()), name, {}});
  return robots;
}

TEST_F(RigFile, PosesWithUnitsInTheOrderOfTheFile) {
  const auto rig = read(
      "cameras:\n"
      "  front: {}\n"
      "  back: {position: [1 cm, -0.02, 0], rotation: [0, 1, 0, 0], sigma: {position: 2 mm, rotation: 0.1 "
      "deg},\n"
      "         time_offset: -12 ms}\n"
      "  above:\n"
      "    position: [0, -0.1, 0]\n"
      "    sigma: {position: [1 m, 5 mm, 1 m]}\n"
      "  left:\n");
  ASSERT_TRUE(rig) << rig.error().message;
  ASSERT_EQ(rig->cameras.size(), 4U);
  EXPECT_EQ(rig->cameras[0].name, "front");
  const RigCamera& back = rig->cameras[1];
  EXPECT_TRUE(back.given());
  EXPECT_NEAR((*back.position - Eigen::Vector3d(0.01, -0.02, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(back.rotation->y(), 1.0, 1e-12);
  EXPECT_NEAR(back.sigma_m.z(), 0.002, 1e-12);
  EXPECT_NEAR(back.sigma_rad.x(), 0.1 * M_PI / 180.0, 1e-12);
  EXPECT_NEAR(*back.time_offset_s, -0.012, 1e-12);

  // Without a rotation the position is where the search begins.
  const RigCamera& above = rig->cameras[2];
  EXPECT_FALSE(above.given());
  EXPECT_NEAR(above.sigma_m.x(), 1.0, 1e-12);
  EXPECT_NEAR(above.sigma_m.y(), 0.005, 1e-12);
  EXPECT_FALSE(above.time_offset_s);
  EXPECT_FALSE(rig->cameras[3].given());
}

TEST_F(RigFile, GivenPosesMayBeFoundMoreExactly) {
  const auto rig = read("cameras: {a: {}, b: {position: [0, 0, 0], rotation: [0, 0, 0, 1], find: on}}\n");
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_FALSE(rig->cameras[1].given());
  EXPECT_TRUE(rig->cameras[1].position && rig->cameras[1].rotation);
}

TEST_F(RigFile, MistakesAreNamedWithTheirPlace) {
  const std::string several = wrong(
      "cameras:\n"
      "  front: {position: [0, 0, 0]}\n"
      "  back: {positoin: [0, 0, 0], rotation: [1, 1, 0, 0]}\n"
      "  left: {position: [0, 0], sigma: {position: -2 mm, turn: 3}}\n"
      "camera: {}\n");
  for (const char* part : {"positoin", "did you mean position", "length 1.414", "is the reference",
                           "has 2 numbers", ":3:", ":4:", "cameras.left.sigma", "turn", "camera: unknown"}) {
    EXPECT_NE(several.find(part), std::string::npos) << part << "\n" << several;
  }
  EXPECT_NE(wrong("cameras: {front: {}}\n").find("two cameras or more"), std::string::npos);
  EXPECT_NE(wrong("cameras:\n  - {at: [0, 0, 0]}\n  - {yaw: 180 deg}\n").find("two cameras or more"),
            std::string::npos);
  EXPECT_NE(wrong("{}\n").find("two cameras or more"), std::string::npos);
  EXPECT_NE(wrong("cameras: {a: {}, b: {sigma: 3}}\n").find("cameras.b.sigma"), std::string::npos);
  EXPECT_NE(wrong("cameras: {a: {}, b: 3}\n").find("cameras.b"), std::string::npos);
  EXPECT_FALSE(read_rig("/there/is/no/rig.yaml"));
}

TEST_F(RigFile, CamerasAreRobotsOfTheRun) {
  ASSERT_TRUE(read("cameras: {front: {}, bakc: {}}\n"));
  const auto unknown = rig_of_run(file_, robots({"back", "front"}));
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("cameras.bakc"), std::string::npos);
  EXPECT_NE(unknown.error().message.find("did you mean back"), std::string::npos);
  EXPECT_EQ(unknown.error().kind, core::ErrorKind::kUsage);
  EXPECT_TRUE(rig_of_run(file_, robots({"bakc", "other", "front"})));
  EXPECT_FALSE(rig_of_run(file_, robots({"front"})));
  EXPECT_FALSE(rig_of_run({}, robots({"front"}))->has_value());
}

}  // namespace
}  // namespace plumbline::pipeline
