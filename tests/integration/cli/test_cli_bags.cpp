// SPDX-License-Identifier: BSD-3-Clause
// ROS bags, as a user meets them. Bags that other programs wrote: bags/run_bags.py.
#include <sstream>
#include <string>

#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

const char* const kQuick = " -q --force --set output.views= --set fuse.voxel=2cm";

class CliBags : public ProgramTest {
 protected:
  void expect_same_map(const std::string& a, const std::string& b) const {
    for (const char* part : {"map.ply", "map.pcd", "trajectory.txt", "keyframes.txt", "frames.csv"}) {
      const std::string bytes = slurp(path(a) / part);
      EXPECT_FALSE(bytes.empty()) << part;
      EXPECT_TRUE(bytes == slurp(path(b) / part)) << part << " of " << a << " and " << b;
    }
  }
};

TEST_F(CliBags, ACopyIsMappedToTheBytesOfTheOriginal) {
  write_wall(path("wall"));
  const Outcome written = run("convert wall wall.mcap");
  ASSERT_EQ(written.code, 0) << written;
  EXPECT_NE(written.out.find("frames to wall.mcap"), std::string::npos) << written;
  ASSERT_EQ(run("convert wall.mcap copy").code, 0);
  for (const char* recording : {"wall", "wall.mcap", "copy"}) {
    const Outcome mapped = run(std::string("map ") + recording + " -o out_" + recording + kQuick);
    ASSERT_TRUE(mapped.code == 0 || mapped.code == 4) << mapped;
  }
  expect_same_map("out_wall", "out_wall.mcap");
  expect_same_map("out_wall", "out_copy");
}

TEST_F(CliBags, InfoTellsWhatIsInABagAndWhatWouldBeMapped) {
  write_wall(path("wall"));
  ASSERT_EQ(run("convert wall wall.mcap -q").code, 0);
  const Outcome told = run("info wall.mcap");
  ASSERT_EQ(told.code, 0) << told;
  for (const char* line :
       {"bag: wall.mcap (mcap)", "topic: /camera/color/camera_info sensor_msgs/CameraInfo",
        "colour: /camera/color/image_raw", "depth: /camera/aligned_depth_to_color/image_raw",
        "recording: wall (mcap)", "camera: "}) {
    EXPECT_NE(told.out.find(line), std::string::npos) << line << "\n" << told;
  }
}

TEST_F(CliBags, PartOfABagIsAPartOfTheRecording) {
  write_wall(path("wall"));
  ASSERT_EQ(run("convert wall wall.mcap -q").code, 0);
  const std::string part = " --from 0.1 --to 0.4 --every 2";
  ASSERT_EQ(run("convert wall part -q" + part).code, 0);
  ASSERT_EQ(run("convert wall.mcap part_of_bag -q" + part).code, 0);
  // A bag holds depth as metres, which a folder keeps as TIFF.
  const auto stamps = [&](const char* file) {
    std::istringstream words(slurp(path(file)));
    std::string kept;
    for (std::string word; words >> word;) {
      if (word.find('/') == std::string::npos) kept += word + " ";
    }
    return kept;
  };
  const std::string list = stamps("part/associations.txt");
  EXPECT_GT(list.size(), 40U);
  EXPECT_EQ(list, stamps("part_of_bag/associations.txt"));
}

TEST_F(CliBags, WhatIsNoBagIsRefused) {
  write("notes.mcap", "no bag at all");
  const Outcome map = run("map notes.mcap -o out");
  EXPECT_EQ(map.code, 3) << map;
  EXPECT_TRUE(map.told("notes.mcap: is a file, and no bag")) << map;
  write("short.mcap", std::string("\x89MCAP0\r\n", 8));
  const Outcome empty = run("info short.mcap");
  EXPECT_EQ(empty.code, 3) << empty;
  EXPECT_TRUE(empty.told("holds no message")) << empty;
  const Outcome topic = run("map short.mcap -o out --topic colour=/image");
  EXPECT_EQ(topic.code, 2) << topic;
  EXPECT_TRUE(topic.told("color=, depth=")) << topic;
}

TEST_F(CliBags, AnEarlierCopyIsReplacedOnlyWhenAskedFor) {
  write_wall(path("wall"));
  ASSERT_EQ(run("convert wall copy -q").code, 0);
  const Outcome again = run("convert wall copy -q");
  EXPECT_EQ(again.code, 2) << again;
  EXPECT_TRUE(again.told("--force")) << again;
  EXPECT_EQ(run("convert wall copy -q --force").code, 0);
}

}  // namespace
}  // namespace plumbline::integration
