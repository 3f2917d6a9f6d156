// SPDX-License-Identifier: BSD-3-Clause
// Files as other programs write them, and recordings that say something doubtful.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iomanip>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

/// Forty poses on an arc, stamps 10, 10.1 ...; `row` makes a line of each.
template <typename Row>
std::string arc(const std::string& header, const Row& row) {
  std::string text = header;
  for (int i = 0; i < 40; ++i) {
    const double a = 0.05 * i;
    text += row(i, std::cos(a), std::sin(a), 0.01 * i * i) + "\n";
  }
  return text;
}

std::string words(const std::vector<double>& numbers, const char* separator) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(9);
  for (std::size_t i = 0; i < numbers.size(); ++i) text << (i > 0 ? separator : "") << numbers[i];
  return text.str();
}

class ForeignTrajectories : public ProgramTest {
 protected:
  void SetUp() override {
    // the camera turns about z by 2 a, so that w and z differ
    write("tum.txt", arc("", [](int i, double x, double y, double z) {
            return words({10.0 + 0.1 * i, x, y, z, 0, 0, y, x}, " ");
          }));
    write("euroc.csv", arc("#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
                           "q_RS_y [], q_RS_z []\n",
                           [](int i, double x, double y, double z) {
                             return std::to_string(10'000'000'000LL + 100'000'000LL * i) + "," +
                                    words({x, y, z, x, 0, 0, y}, ",");
                           }));
    write("kitti.txt", arc("", [](int, double x, double y, double z) {
            const double c = x * x - y * y;
            const double s = 2.0 * x * y;
            return words({c, -s, 0, x, s, c, 0, y, 0, 0, 1, z}, " ");
          }));
  }
  void expect_no_error(const std::string& estimate, const std::string& truth) const {
    const auto ran = run("evaluate trajectory " + estimate + " " + truth + " --json");
    ASSERT_EQ(ran.code, 0) << ran;
    const auto json = nlohmann::json::parse(ran.out, nullptr, false);
    EXPECT_EQ(json["matched"], 40) << ran;
    EXPECT_LT(json["ate_m"]["max"], 1e-6) << ran;
    EXPECT_LT(json["rotation_deg"]["max"], 1e-4) << ran;
  }
};

TEST_F(ForeignTrajectories, EurocAndKittiAgainstTum) {
  expect_no_error("euroc.csv", "tum.txt");
  expect_no_error("euroc.csv", "euroc.csv");
  expect_no_error("kitti.txt", "tum.txt");
  expect_no_error("tum.txt", "kitti.txt");
  expect_no_error("kitti.txt", "kitti.txt");
  EXPECT_TRUE(run("evaluate trajectory kitti.txt euroc.csv").told("paired by number: 40 poses"));
  const auto info = run("info kitti.txt");
  EXPECT_NE(info.out.find("format: KITTI"), std::string::npos) << info;
}

TEST_F(ForeignTrajectories, WhatCannotBeComparedIsRefused) {
  std::string text = slurp(path("tum.txt"));
  write("short.txt", text.substr(0, text.find('\n') + 1));
  const auto counts = run("evaluate trajectory kitti.txt short.txt");
  EXPECT_EQ(counts.code, 3) << counts;
  EXPECT_TRUE(counts.told("40 poses, 1 in the truth")) << counts;
  for (char& c : text) c = c == '.' ? ',' : c;
  write("comma.txt", text);
  const auto comma = run("evaluate trajectory comma.txt tum.txt");
  EXPECT_EQ(comma.code, 3) << comma;
  EXPECT_TRUE(comma.told("comma.txt:1: decimal comma")) << comma;
  EXPECT_EQ(run("info comma.txt").code, 3);
}

TEST_F(ForeignTrajectories, PosesOfOneStampAreSaid) {
  write("same.txt", "5 0 0 0 0 0 0 1\n5 -0.33 0.03 0 0 0 0 1\n5 -0.66 0.06 0 0 0 0 1\n");
  const auto ran = run("evaluate trajectory same.txt same.txt --json");
  ASSERT_EQ(ran.code, 0) << ran;
  EXPECT_TRUE(ran.told("3 poses share one stamp")) << ran;
  EXPECT_LT(nlohmann::json::parse(ran.out, nullptr, false)["ate_m"]["max"], 1e-9);
}

class ForeignRecordings : public ProgramTest {};

TEST_F(ForeignRecordings, CameraOfAnotherProgramIsUnderstoodAndTold) {
  write_wall(path("wall"));
  std::filesystem::remove(path("wall/camera.yaml"));
  write("orb.yaml",
        "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.fx: 262.5\nCamera.fy: 262.5\nCamera.cx: 160\nCamera.cy: "
        "120\n"
        "DepthMapFactor: 5000\n");
  const auto ran = run("map wall --camera orb.yaml -o out --to 0.2");
  EXPECT_EQ(ran.code, 0) << ran;
  EXPECT_TRUE(
      ran.told("camera file of ORB-SLAM2 or ORB-SLAM3: fx 262.5 fy 262.5 cx 160 cy 120, no distortion; size "
               "320x240 (from the images); depth scale 5000 (file)"))
      << ran;
  write("fisheye.yaml",
        "%YAML:1.0\nCamera.type: \"Omnidirectional\"\nCamera.fx: 262.5\nCamera.fy: 262.5\nCamera.cx: 160\n"
        "Camera.cy: 120\n");
  const auto refused = run("map wall --camera fisheye.yaml -o none");
  EXPECT_EQ(refused.code, 2) << refused;
  EXPECT_TRUE(refused.told("omnidirectional")) << refused;
  EXPECT_TRUE(refused.told("  fx: 262.5\n")) << refused;

  write("fisheye.yaml",
        "%YAML:1.0\nCamera.type: \"KannalaBrandt8\"\nCamera.fx: 262.5\nCamera.fy: 262.5\nCamera.cx: 160\n"
        "Camera.cy: 120\n");
  const auto fisheye = run("map wall --camera fisheye.yaml -o out --to 0.2 --force");
  EXPECT_EQ(fisheye.code, 0) << fisheye;
  EXPECT_TRUE(fisheye.told("fx 262.5 fy 262.5 cx 160 cy 120, equidistant (fisheye) k1 0 k2 0 k3 0 k4 0"))
      << fisheye;
}

TEST_F(ForeignRecordings, PosesAreTakenAsGiven) {
  write_wall(path("wall"));
  std::string truth;
  for (int f = 0; f < 12; ++f) truth += words({10.0 + f / 30.0, 0.01 * f, 0, 0, 0, 0, 0, 1}, " ") + "\n";
  write("wall/groundtruth.txt", truth);
  const auto ran = run("map wall -o out --poses given");
  EXPECT_EQ(ran.code, 0) << ran;
  const auto error = run("evaluate trajectory out wall --json");
  ASSERT_EQ(error.code, 0) << error;
  EXPECT_LT(nlohmann::json::parse(error.out, nullptr, false)["ate_m"]["max"], 1e-9) << error;
  const auto other = run("map wall -o other --poses given -p fast");
  EXPECT_EQ(other.code, 2) << other;
  EXPECT_TRUE(other.told("has no stage 'poses'")) << other;
  EXPECT_EQ(run("map wall -o other --poses maybe").code, 2);
}

TEST_F(ForeignRecordings, RecordingsOfRecord3dAreRefusedWithTheWayOut) {
  write("room.r3d", "PK\x03\x04");
  for (const char* command : {"info room.r3d", "map room.r3d -o out"}) {
    const auto ran = run(command);
    EXPECT_EQ(ran.code, 3) << ran;
    EXPECT_TRUE(ran.told("EXR + JPG sequence")) << ran;
  }
}

TEST_F(ForeignRecordings, AMedianDepthAloneIsNoDoubt) {
  WallRecording wall;
  wall.depth_scale = 1000.0;
  write_wall(path("wall"), wall);
  const auto ran = run("map wall -o out --to 0.3");
  EXPECT_FALSE(ran.told("would fit")) << ran;
  const auto summary = read_json(path("out/summary.json"));
  EXPECT_EQ(summary["reason"].get<std::string>().find("depth_scale"), std::string::npos) << summary;
  EXPECT_NE(summary["unchecked"].dump().find("scale"), std::string::npos) << summary;
}

TEST_F(ForeignRecordings, NoStampIsThereTwice) {
  write_wall(path("wall"));
  std::string list;
  for (int f = 0; f < 8; ++f) {
    const std::string stamp = words({10.0 + (f == 5 ? 4 : f) / 30.0}, "");
    list += stamp + " rgb\\" + frame_name(f) + " " + stamp + " depth\\" + frame_name(f) + "\n";
  }
  std::ofstream(path("wall/associations.txt")) << list;
  const auto ran = run("map wall -o out");
  EXPECT_EQ(ran.code, 0) << ran;
  EXPECT_TRUE(ran.told("1 of 8 frames have the stamp of the frame before and are dropped")) << ran;
  std::ifstream in(path("out/trajectory.txt"));
  std::set<std::string> stamps;
  std::string line;
  while (std::getline(in, line)) {
    if (line[0] == '#') continue;
    EXPECT_TRUE(stamps.insert(line.substr(0, line.find(' '))).second) << line;
  }
  EXPECT_EQ(stamps.size(), 7U);
}

}  // namespace
}  // namespace plumbline::integration
