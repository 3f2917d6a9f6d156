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
  ASSERT_EQ(run("convert wall copy.mcap -q").code, 0);
  EXPECT_EQ(run("convert wall copy.mcap -q").code, 2);
  EXPECT_EQ(run("convert wall copy.mcap -q --force").code, 0);
  fs::create_directory(path("empty"));
  EXPECT_EQ(run("convert wall empty -q").code, 0);
}

TEST_F(CliBags, NoRecordingIsReplacedByACopy) {
  write_wall(path("wall"));
  write_wall(path("other"));
  fs::create_directory_symlink("wall", path("link"));
  const std::string list = slurp(path("wall/rgb.txt"));
  write("keep.mcap", "a letter");
  for (const char* places : {"wall wall", "wall link", "link wall", "wall wall/copy", "wall/rgb/.. wall",
                             "wall .", "wall other", "wall keep.mcap"}) {
    const Outcome refused = run(std::string("convert ") + places + " --force --every 5");
    EXPECT_EQ(refused.code, 2) << places << refused;
    EXPECT_TRUE(refused.told("choose another")) << places << refused;
    const Outcome unasked = run(std::string("convert ") + places);
    EXPECT_EQ(unasked.code, 2) << places << unasked;
    EXPECT_FALSE(unasked.told("--force replaces")) << places << unasked;
  }
  EXPECT_EQ(slurp(path("wall/rgb.txt")), list);
  EXPECT_EQ(slurp(path("other/rgb.txt")), list);
  EXPECT_EQ(slurp(path("keep.mcap")), "a letter");

  // Something of a user's own in a copy keeps it from being replaced, and so does a recording where it is
  // first written.
  ASSERT_EQ(run("convert wall copy -q").code, 0);
  write("copy/notes.txt", "mine");
  EXPECT_EQ(run("convert wall copy --force").code, 2);
  fs::rename(path("other"), path("new.partial"));
  const Outcome way = run("convert wall new");
  EXPECT_EQ(way.code, 2) << way;
  EXPECT_EQ(slurp(path("new.partial/rgb.txt")), list);
}

TEST_F(CliBags, WhatACopyCannotBeIsTold) {
  write_wall(path("wall"));
  for (const char* name : {"c.bag", "c.db3", "c.zip", "c.mp4", "c.MCAP"}) {
    EXPECT_EQ(run(std::string("convert wall ") + name).code, 2) << name;
    EXPECT_FALSE(fs::exists(path(name))) << name;
  }
  const Outcome nowhere = run("convert wall no/folder/c.mcap");
  EXPECT_EQ(nowhere.code, 5) << nowhere;
  EXPECT_TRUE(nowhere.told("make the folder first")) << nowhere;
  EXPECT_FALSE(nowhere.told("frames")) << nowhere;
  const Outcome bag = run("convert wall c.mcap");
  EXPECT_TRUE(bag.told("warning: the ground truth is not in the copy")) << bag;
  EXPECT_FALSE(run("convert wall c").told("warning")) << "a folder has it";
}

}  // namespace
}  // namespace plumbline::integration
