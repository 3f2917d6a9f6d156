// SPDX-License-Identifier: BSD-3-Clause
// A robot that goes on where only another one has been finds itself again by that one's map, if it may.
#include <cmath>
#include <sstream>

#include "network/network_test.hpp"

namespace plumbline::integration {
namespace {

class Feedback : public ProgramTest {
 protected:
  static constexpr double kLong_s = 120.0;  // for a busy machine
  static constexpr const char* kMap = " -q --set cloud.filters=[]";

  /// Seconds 2 to 9 of a recording, and from there on what it shows from 19.5 s to its end: the room next
  /// door.
  void cut(const fs::path& from, const fs::path& to) const {
    constexpr double kBegin_s = 102.0, kCut_s = 109.0, kGoOn_s = 119.5, kHalf_s = 0.05;
    fs::create_directories(to);
    for (const char* folder : {"rgb", "depth"}) fs::create_directory_symlink(from / folder, to / folder);
    fs::copy(from / "camera.yaml", to / "camera.yaml");
    for (const char* list : {"rgb.txt", "depth.txt", "groundtruth.txt"}) {
      std::istringstream lines(slurp(from / list));
      std::ofstream out(to / list);
      for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line[0] == '#') continue;
        double stamp = std::stod(line) + kHalf_s;
        if (stamp < kBegin_s || (stamp >= kCut_s && stamp < kGoOn_s)) continue;
        if (stamp >= kGoOn_s) stamp -= kGoOn_s - kCut_s;
        out << std::fixed << stamp - kHalf_s << line.substr(line.find(' ')) << '\n';
      }
    }
  }
  struct Position {
    double stamp = 0.0, x = 0.0, y = 0.0, z = 0.0;
  };
  static std::vector<Position> path_of(const fs::path& file) {
    std::vector<Position> path;
    std::istringstream lines(slurp(file));
    for (std::string line; std::getline(lines, line);) {
      std::istringstream numbers(line);
      Position p;
      if (numbers >> p.stamp >> p.x >> p.y >> p.z) path.push_back(p);
    }
    return path;
  }
  static double way(const std::vector<Position>& path, double from_s, double to_s) {
    const auto at = [&](double stamp) {
      return *std::min_element(path.begin(), path.end(), [&](const Position& a, const Position& b) {
        return std::abs(a.stamp - stamp) < std::abs(b.stamp - stamp);
      });
    };
    const Position a = at(from_s), b = at(to_s);
    return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z);
  }
  [[nodiscard]] Process start(const std::string& name, const std::string& arguments) const {
    const std::string network = " --interface lo --domain " + std::to_string(1 + getpid() % 200);
    return {path(""), name, arguments + network};
  }
};

TEST_F(Feedback, WhatOnlyAnotherRobotHasSeenIsRecognised) {
  const std::string film = "synth office -o world --frames 240 --fps 10 --width 320 --height 240";
  ASSERT_EQ(run(film + " --reference-spacing 20cm -q").code, 0);
  cut(path("world/robot0"), path("cut"));
  ASSERT_EQ(run("map world/robot0 -p robot -o a" + std::string(kMap)).code, 0);
  const Outcome alone = run("map cut -p robot -o alone" + std::string(kMap));
  EXPECT_EQ(alone.code, 4) << "it is lost: " << alone;
  EXPECT_FALSE(read_json(path("alone/summary.json")).contains("feedback"));
  const auto told = read_json(path("alone/summary.json"));
  std::size_t apart = 0;
  for (const auto& component : told["components"]["list"]) {
    if (!component["joined"]) apart += component["frames"].get<std::size_t>();
  }
  EXPECT_GT(apart, 0U) << "a second map that shares no place with the first: " << told["components"];
  EXPECT_LT(told["frames"]["tracked"].get<std::size_t>() - apart, 75U);

  Process h =
      start("hub", "hub -q -o out --robots 2 --set output.pcd=off --set fuse.voxel=5cm --set output.views=");
  Process a = start("a", "robot a --name a");
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told() << h.told();
  Process b = start("b", "robot cut -o b --name b --pace 8 --feedback on" + std::string(kMap));
  ASSERT_EQ(b.wait(kLong_s), 0) << b.told() << h.told();
  const auto summary = read_json(path("b/summary.json"));
  EXPECT_TRUE(summary["feedback"]["on"]);
  EXPECT_GT(summary["feedback"]["keyframes_received"], 20);
  EXPECT_GE(summary["feedback"]["relocalised"], 1);
  EXPECT_GT(summary["frames"]["tracked"], 95) << summary["feedback"];
  EXPECT_NE(slurp(path("b/config.yaml")).find("feedback: on"), std::string::npos);

  ASSERT_EQ(h.wait(kLong_s), 0) << h.told();
  const auto network = read_json(path("out/summary.json"))["network"];
  EXPECT_EQ(network["b"]["keyframes"], summary["keyframes"]) << "what it sent is its own";
  const auto walked = path_of(path("out/robots/b/trajectory.txt"));
  const auto truth = path_of(path("cut/groundtruth.txt"));
  ASSERT_GT(walked.size(), 95U);
  const double end_s = walked.back().stamp;
  EXPECT_GT(end_s, 113.0) << "it is tracked to its end";
  EXPECT_NEAR(way(walked, 103.0, end_s), way(truth, 103.0, end_s), 0.1);
}

}  // namespace
}  // namespace plumbline::integration
