// SPDX-License-Identifier: BSD-3-Clause
// Several robots, one map: plumbline fuse.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

class Fuse : public ProgramTest {
 protected:
  static constexpr const char* kLean =
      " -q --set output.views= --set output.pcd=off --set cloud.filters=[] --set fuse.voxel=3cm";

  /// A world of which two parts of one way are mapped by two robots that begin in worlds of their own.
  void map_two() const {
    ASSERT_EQ(
        run("synth room -o world --frames 60 --fps 10 --width 320 --height 240 --reference-spacing 10cm -q")
            .code,
        0);
    const Outcome a = run("map world/robot0 -o a --to 3.5" + std::string(kLean));
    ASSERT_EQ(a.code, 0) << a;
    const Outcome b = run("map world/robot0 -o b --from 1.5" + std::string(kLean));
    ASSERT_EQ(b.code, 0) << b;
  }
  [[nodiscard]] Outcome fuse(const std::string& arguments) const {
    return run("fuse " + arguments +
               " --set output.pcd=off --set fuse.voxel=3cm --set output.views= --set merge.min_pairs=3");
  }
};

TEST_F(Fuse, TwoMapsOfOneRoomInAnyOrder) {
  map_two();
  const Outcome fused = fuse("a b -o ab --threads 1");
  ASSERT_EQ(fused.code, 0) << fused;
  EXPECT_TRUE(fused.told("overlap")) << fused;
  const auto summary = read_json(path("ab/summary.json"));
  ASSERT_EQ(summary["merges"].size(), 1U);
  EXPECT_TRUE(summary["merges"][0]["accepted"]);
  EXPECT_GE(summary["merges"][0]["agreeing"], 3);
  EXPECT_EQ(summary["merges"][0]["a_from_b"].size(), 4U);
  EXPECT_TRUE(summary["trustworthy"]);
  for (const char* robot : {"a", "b"}) {
    const auto poses = dataset::read_trajectory(path("ab/robots") / robot / "trajectory.txt");
    ASSERT_TRUE(poses.has_value());
    EXPECT_GT(poses->size(), 30U);
    EXPECT_TRUE(fs::exists(path("ab/robots") / robot / "keyframes.txt"));
  }
  EXPECT_FALSE(fs::exists(path("ab/trajectory.txt")));
  const Outcome several = run("evaluate trajectory ab world/robot0");
  EXPECT_EQ(several.code, 3) << several;
  EXPECT_TRUE(several.told("ab/robots/a")) << several;
  const Outcome posed = run("export ab -o model");
  EXPECT_TRUE(posed.told(" 0 pictures")) << posed;
  const auto cloud = cloud::read_cloud(path("ab/map.ply"));
  ASSERT_TRUE(cloud.has_value());
  ASSERT_EQ(cloud->columns.robot.size(), cloud->cloud->size());
  for (const std::uint8_t robot : {std::uint8_t{0}, std::uint8_t{1}}) {
    EXPECT_GT(std::count(cloud->columns.robot.begin(), cloud->columns.robot.end(), robot), 100);
  }
  // Frames that both robots mapped lie at one place.
  const auto a = dataset::read_trajectory(path("ab/robots/a/trajectory.txt"));
  const auto b = dataset::read_trajectory(path("ab/robots/b/trajectory.txt"));
  int common = 0;
  for (const auto& x : *a) {
    for (const auto& y : *b) {
      if (std::abs(x.stamp - y.stamp) > 1e-4) continue;
      ++common;
      EXPECT_LT((x.world_from_camera.translation - y.world_from_camera.translation).norm(), 0.03);
    }
  }
  EXPECT_GT(common, 10);

  const Outcome other = fuse("b a -o ba --threads 2 -q");
  ASSERT_EQ(other.code, 0) << other;
  for (const char* file : {"map.ply", "lines.ply", "config.yaml", "map.db", "robots/a/trajectory.txt",
                           "robots/b/keyframes.txt"}) {
    EXPECT_EQ(slurp(path("ab") / file), slurp(path("ba") / file)) << file;
  }

  // What was fused is a map again.
  EXPECT_EQ(run("info ab").code, 0);
  const Outcome drawn = run("render ab --size 200x150 -o ab.png");
  EXPECT_EQ(drawn.code, 0) << "the path of each robot is in its own folder\n" << drawn;
  // A robot of several may leave refinement and cloud to the fusion.
  const Outcome c = run("map world/robot0 -o c -p robot --from 2.5 -q --set cloud.filters=[]");
  ASSERT_EQ(c.code, 0) << c;
  EXPECT_FALSE(fs::exists(path("c/map.ply")));
  const Outcome three = fuse("c ab -o abc -q --anchor c");
  ASSERT_EQ(three.code, 0) << three;
  for (const char* robot : {"a", "b", "c"}) {
    EXPECT_TRUE(fs::exists(path("abc/robots") / robot / "trajectory.txt")) << robot;
  }
}

TEST_F(Fuse, MapsWithoutCommonFramesAreShownTogether) {
  ASSERT_EQ(
      run("synth room -o world --frames 80 --fps 10 --width 320 --height 240 --reference-spacing 10cm -q")
          .code,
      0);
  ASSERT_EQ(run("map world/robot0 -o a --to 5.5" + std::string(kLean)).code, 0);

  // The same room on another day, from the third second on.
  fs::create_directory(path("later"));
  for (const char* part : {"rgb", "depth"})
    fs::create_directory_symlink(path("world/robot0") / part, path("later") / part);
  fs::copy(path("world/robot0/camera.yaml"), path("later/camera.yaml"));
  for (const char* list : {"rgb.txt", "depth.txt"}) {
    std::istringstream all(slurp(path("world/robot0") / list));
    std::ofstream later(path("later") / list);
    int frame = 0;
    for (std::string line; std::getline(all, line);) {
      if (line.front() == '#' || frame++ < 20) continue;
      const std::size_t blank = line.find(' ');
      later << std::to_string(std::stod(line.substr(0, blank)) + 1e5) << line.substr(blank) << "\n";
    }
  }
  ASSERT_EQ(run("map later -o b" + std::string(kLean)).code, 0);

  const Outcome shown = run("report a b -o ab.html");
  ASSERT_EQ(shown.code, 0) << shown;
  const std::string page = slurp(path("ab.html"));
  EXPECT_NE(page.find("a and b are aligned by places that both show"), std::string::npos);
  EXPECT_NE(page.find("% of the points of b lie at surfaces of a"), std::string::npos);
}

TEST_F(Fuse, WorldsThatDoNotConnectStayApart) {
  ASSERT_EQ(
      run("synth room -o room --frames 20 --fps 10 --width 320 --height 240 --reference-spacing 10cm -q")
          .code,
      0);
  ASSERT_EQ(run("synth structure -o other --frames 20 --fps 10 --width 320 --height 240 --reference-spacing "
                "10cm -q")
                .code,
            0);
  ASSERT_EQ(run("map room/robot0 -o a" + std::string(kLean)).code, 0);
  ASSERT_EQ(run("map other/robot0 -o b" + std::string(kLean)).code, 0);
  const Outcome fused = fuse("a b -o ab");
  EXPECT_EQ(fused.code, 4) << fused;
  EXPECT_TRUE(fused.told("do not connect")) << fused;
  EXPECT_TRUE(fused.told("tried")) << fused;
  const auto summary = read_json(path("ab/summary.json"));
  EXPECT_FALSE(summary["trustworthy"]);
  EXPECT_FALSE(summary["merges"][0]["accepted"]);
  EXPECT_FALSE(std::string(summary["merges"][0]["reason"]).empty());

  // Nor are they shown over one another, although all generated recordings begin at the same time.
  const Outcome shown = run("report a b -o both.html");
  EXPECT_EQ(shown.code, 4) << shown;
  EXPECT_TRUE(shown.told("a and b cannot be aligned")) << shown;
  EXPECT_FALSE(fs::exists(path("both.html")));

  // The layout is that of several robots, though one alone is in the map.
  EXPECT_FALSE(fs::exists(path("ab/trajectory.txt")));
  EXPECT_NE(fs::exists(path("ab/robots/a/trajectory.txt")), fs::exists(path("ab/robots/b/trajectory.txt")));

  const Outcome mapped =
      run("map room/robot0 other/robot0 -o both --set output.views=top" + std::string(kLean));
  EXPECT_EQ(mapped.code, 4) << mapped;
  EXPECT_FALSE(fs::exists(path("both/trajectory.txt")));
  const bool first = fs::exists(path("both/robots/robot0/trajectory.txt"));
  EXPECT_NE(first, fs::exists(path("both/robots/robot0-2/trajectory.txt")));
  const std::string name = first ? "robot0" : "robot0-2";
  EXPECT_EQ(slurp(path("both/keyframes.csv")).find("\n" + name + ",0,") != std::string::npos, true);

  const Outcome report = run("report both");
  EXPECT_EQ(report.code, 0) << report;
  EXPECT_FALSE(report.told("is not there")) << report;
  EXPECT_EQ(run("export both -o path.txt --what trajectory").code, 0);
  EXPECT_EQ(run("info both").code, 0);
  EXPECT_EQ(run("evaluate trajectory both both/robots/" + name + "/trajectory.txt").code, 0);
}

TEST_F(Fuse, RobotsSideBySideMeetWhileTheyMap) {
  ASSERT_EQ(
      run("synth room -o world --frames 30 --fps 10 --width 320 --height 240 --reference-spacing 10cm -q")
          .code,
      0);
  fs::create_directory_symlink(path("world/robot0"), path("twin"));
  const std::string lean =
      " --set output.views= --set output.pcd=off --set cloud.filters=[] --set fuse.voxel=3cm "
      "--set merge.min_pairs=3";
  const Outcome twice = run("map world/robot0 world/../world/robot0 -o two" + lean);
  EXPECT_EQ(twice.code, 2);
  EXPECT_TRUE(twice.told("is given twice")) << twice;
  const Outcome o = run("map world/robot0 twin -o two --threads 2" + lean);
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("have met")) << o;
  const auto summary = read_json(path("two/summary.json"));
  ASSERT_EQ(summary["merges"].size(), 1U);
  EXPECT_TRUE(summary["merges"][0]["accepted"]);
  EXPECT_GT(summary["merges"][0]["time_s"], 0.0);
  EXPECT_LT(summary["merges"][0]["time_s"], summary["timing"]["wall_s"]);
  EXPECT_GT(summary["merges"][0]["evident_s"], 0.0);
  ASSERT_EQ(summary["meetings"].size(), 1U);
  EXPECT_FALSE(summary["meetings"][0]["taken_back"]);
  const std::string meeting = "meetings/0001_robot0_robot0-2";
  EXPECT_TRUE(read_json(path("two") / meeting / "meeting.json")["evidence"]["accepted"]);
  EXPECT_TRUE(fs::exists(path("two") / meeting / "map.png"));
  ASSERT_EQ(summary["robots"].size(), 2U);
  EXPECT_GT(summary["robots"][0]["keyframes"], 2);
  EXPECT_EQ(summary["frames"]["tracked"], 60);
  const auto a = dataset::read_trajectory(path("two/robots/robot0/trajectory.txt"));
  const auto b = dataset::read_trajectory(path("two/robots/robot0-2/trajectory.txt"));
  ASSERT_TRUE(a.has_value() && b.has_value());
  ASSERT_EQ(a->size(), b->size());
  for (std::size_t i = 0; i < a->size(); ++i) {
    EXPECT_LT(((*a)[i].world_from_camera.translation - (*b)[i].world_from_camera.translation).norm(), 0.03);
  }
  ASSERT_EQ(run("map world/robot0 twin -o again -q --threads 1" + lean).code, 0);
  for (const char* file :
       {"map.ply", "frames.csv", "robots/robot0-2/trajectory.txt",
        "meetings/0001_robot0_robot0-2/meeting.json", "meetings/0001_robot0_robot0-2/robot0.txt"}) {
    EXPECT_EQ(slurp(path("two") / file), slurp(path("again") / file)) << file;
  }
  for (const char* pipeline : {"fast", "points_only"}) {
    const Outcome other = run(std::string("map world/robot0 twin -o x --force -p ") + pipeline + lean);
    EXPECT_EQ(other.code, 0) << pipeline << "\n" << other;
  }
  EXPECT_EQ(run("map world/robot0 twin -o x --force --debug-video video" + lean).code, 0);
  EXPECT_TRUE(fs::exists(path("video/000059.png")));
}

TEST_F(Fuse, RobotsSideBySideInAnyOrder) {
  ASSERT_EQ(
      run("synth room -o world --frames 30 --fps 10 --width 320 --height 240 --reference-spacing 10cm -q")
          .code,
      0);
  // A second robot that saw all but the first second.
  fs::create_directory(path("late"));
  for (const char* part : {"rgb", "depth"})
    fs::create_directory_symlink(path("world/robot0") / part, path("late") / part);
  fs::copy(path("world/robot0/camera.yaml"), path("late/camera.yaml"));
  for (const char* list : {"rgb.txt", "depth.txt", "associations.txt"}) {
    std::istringstream all(slurp(path("world/robot0") / list));
    std::string kept;
    int frame = 0;
    for (std::string line; std::getline(all, line);) {
      if (line.front() == '#' || frame++ >= 10) kept += line + "\n";
    }
    write(std::string("late/") + list, kept);
  }
  const std::string lean =
      " -q --set output.views= --set fuse.voxel=3cm --set cloud.filters=[] --set merge.min_pairs=3";
  const Outcome one = run("map late world/robot0 -o one --threads 2" + lean);
  ASSERT_EQ(one.code, 0) << one;
  const Outcome other = run("map world/robot0/ late -o other --threads 1" + lean);
  ASSERT_EQ(other.code, 0) << other;
  const auto summary = read_json(path("other/summary.json"));
  ASSERT_EQ(summary["robots"].size(), 2U);
  EXPECT_EQ(summary["robots"][0]["name"], "late");
  for (const char* file : {"map.ply", "map.pcd", "frames.csv", "lines.ply", "robots/robot0/trajectory.txt",
                           "robots/late/trajectory.txt"}) {
    EXPECT_EQ(slurp(path("one") / file), slurp(path("other") / file)) << file;
  }
}

TEST_F(Fuse, WhatIsNoMapIsRefused) {
  EXPECT_EQ(run("fuse a -o x").code, 2);
  EXPECT_EQ(run("fuse a b -o x").code, 3);
  fs::create_directories(path("empty"));
  write("text.db", "no map");
  const Outcome text = run("fuse empty text.db -o x");
  EXPECT_EQ(text.code, 3) << text;
  EXPECT_TRUE(text.told("map.db")) << text;
  EXPECT_FALSE(fs::exists(path("x")));
  const Outcome pipeline = run("map synth:room?frames=2 -o x -p fuse");
  EXPECT_EQ(pipeline.code, 2) << pipeline;
  EXPECT_TRUE(pipeline.told("plumbline fuse")) << pipeline;
}

}  // namespace
}  // namespace plumbline::integration
