// SPDX-License-Identifier: BSD-3-Clause
// plumbline map --debug-video: a picture of every frame, in a folder that is treated like a result.
#include <algorithm>
#include <vector>

#include "plumbline/dataset/image_io.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

class DebugVideo : public ProgramTest {
 protected:
  DebugVideo() { write_wall(path("wall")); }
  [[nodiscard]] Outcome map(const std::string& arguments) const {
    return run("map wall -q --set output.views= " + arguments);
  }
  [[nodiscard]] std::vector<std::string> files(const std::string& folder) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path(folder))) {
      const std::string name = entry.path().filename().string();
      if (name.front() != '.') names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    return names;
  }
};

TEST_F(DebugVideo, OnePictureAFrameAndTheMapIsTheSame) {
  ASSERT_EQ(map("-o plain").code, 0);
  const Outcome o = map("-o out --debug-video video --threads 3");
  ASSERT_EQ(o.code, 0) << o;
  const std::vector<std::string> names = files("video");
  ASSERT_EQ(names.size(), 12U);
  EXPECT_EQ(names.front(), "000000.png");
  EXPECT_EQ(names.back(), "000011.png");
  const auto raw =
      dataset::read_image(path("wall/rgb") / fs::directory_iterator(path("wall/rgb"))->path().filename());
  const auto drawn = dataset::read_image(path("video/000005.png"));
  ASSERT_TRUE(raw.has_value() && drawn.has_value());
  EXPECT_EQ(drawn->size(), raw->size());
  EXPECT_EQ(drawn->type(), CV_8UC3);
  for (const char* file : {"map.ply", "trajectory.txt", "frames.csv"}) {
    EXPECT_EQ(slurp(path("plain") / file), slurp(path("out") / file)) << file;
  }
  ASSERT_EQ(map("-o again --debug-video again/pictures --threads 1").code, 0);
  ASSERT_EQ(files("again/pictures"), names) << "inside the result folder";
  for (const std::string& name : names) {
    EXPECT_EQ(slurp(path("video") / name), slurp(path("again/pictures") / name)) << name;
  }
}

TEST_F(DebugVideo, ReplacesEarlierPicturesOnlyWhenTold) {
  ASSERT_EQ(map("-o a --debug-video video").code, 0);
  const Outcome refused = map("-o b --debug-video video");
  EXPECT_EQ(refused.code, 2) << refused;
  EXPECT_TRUE(refused.told("--force")) << refused;
  EXPECT_FALSE(fs::exists(path("b")));
  EXPECT_EQ(files("video").size(), 12U);
  ASSERT_EQ(map("-o b --debug-video video --force --to 0.15").code, 0);
  EXPECT_LT(files("video").size(), 12U) << "none of the earlier ones is left";
}

TEST_F(DebugVideo, NeverTouchesAnythingElse) {
  fs::create_directories(path("mine"));
  write("mine/000000.png", "a picture");
  EXPECT_EQ(map("-o out --debug-video mine --force").code, 2) << "numbered pictures may be a recording's";
  write("mine/letter.txt", "dear");
  EXPECT_EQ(map("-o out --debug-video mine --force").code, 2);
  EXPECT_EQ(slurp(path("mine/000000.png")), "a picture");
  EXPECT_EQ(map("-o out --debug-video .").code, 2) << "holds the result";
  EXPECT_EQ(map("-o out --debug-video out").code, 2);
  EXPECT_EQ(map("-o out --debug-video wall/rgb.txt").code, 2) << "is a file";
  const Outcome untracked = map("-o out -p known_poses --debug-video video");
  EXPECT_EQ(untracked.code, 2);
  EXPECT_TRUE(untracked.told("track")) << untracked;
  EXPECT_FALSE(fs::exists(path("out")));
  EXPECT_FALSE(fs::exists(path("video")));
}

TEST_F(DebugVideo, WhatCannotBeWrittenIsExitCodeFive) {
  const Outcome nowhere = map("-o out --debug-video /proc/video");
  EXPECT_EQ(nowhere.code, 5) << nowhere;
  EXPECT_TRUE(nowhere.told("/proc/video")) << nowhere;
  const Outcome full = run("map wall -q -o out -p robot --set store.enabled=off --debug-video video",
                           "ulimit -f 40; ");  // 20 or 40 kB a file
  EXPECT_EQ(full.code, 5) << full;
  EXPECT_TRUE(full.told("000000.png")) << full;
  for (const char* left : {"out", "out.partial", "video", "video.partial"})
    EXPECT_FALSE(fs::exists(path(left)));
}

}  // namespace
}  // namespace plumbline::integration
