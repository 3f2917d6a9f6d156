// SPDX-License-Identifier: BSD-3-Clause
// 7-Scenes and Redwood layouts, detection, cameras.
#include <gmock/gmock.h>

#include <cstdio>

#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class SevenScenes : public RecordingTest {
 protected:
  void write(int first, int count, const std::string& extension, const std::string& sub = "") {
    for (int i = first; i < first + count; ++i) {
      char number[16];
      std::snprintf(number, sizeof number, "%06d", i);
      const std::string stem = sub + "frame-" + number;
      write_image(stem + ".color" + extension, color_image(i));
      write_image(stem + ".depth.png", depth_image(2000));
      write_text(stem + ".pose.txt",
                 "1 0 0 " + std::to_string(i) + "\t\r\n0 1 0 0\r\n0 0 1 0\r\n0 0 0 1\r\n");
    }
    write_camera("depth_scale: 1000\nfps: 30\n");
  }
};

TEST_F(SevenScenes, ReadsPairsAndPoses) {
  write(0, 5, ".png");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "7scenes");
  ASSERT_EQ((*source)->size(), 5U);
  EXPECT_DOUBLE_EQ((*source)->info(3).stamp, 0.1);
  EXPECT_EQ((*source)->read(3)->depth.at<float>(1, 1), 2.0F);
  ASSERT_TRUE((*source)->truth());
  ASSERT_EQ((*source)->truth()->size(), 5U);
  EXPECT_EQ((*(*source)->truth())[3].world_from_camera.translation.x(), 3.0);
}

TEST_F(SevenScenes, JpegAndGapsAndLostPoses) {
  write(2, 4, ".jpg");
  std::filesystem::remove(folder_ / "frame-000003.depth.png");
  write_text("frame-000004.pose.txt", "nan nan nan nan\nnan nan nan nan\nnan nan nan nan\n0 0 0 1\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 3U);
  EXPECT_DOUBLE_EQ((*source)->info(1).stamp, 4.0 / 30.0);
  EXPECT_EQ((*source)->truth()->size(), 2U);
  EXPECT_THAT(log_.warnings, HasSubstr("1 frames lack colour or depth"));
}

TEST_F(SevenScenes, SceneFolderSaysWhichSequenceToGive) {
  write(0, 1, ".png", "seq-02/");
  write(0, 1, ".png", "seq-01/");
  EXPECT_THAT(open_error(),
              AllOf(HasSubstr("give one of its folders"), HasSubstr("seq-01, "), HasSubstr("seq-02")));
}

TEST_F(SevenScenes, NoDepthAtAll) {
  write(0, 2, ".png");
  for (const char* name : {"frame-000000.depth.png", "frame-000001.depth.png"}) {
    std::filesystem::remove(folder_ / name);
  }
  EXPECT_THAT(open_error(), HasSubstr("no frame with both colour and depth"));
}

using Redwood = RecordingTest;

TEST_F(Redwood, MatchesByNumber) {
  write_camera("depth_scale: 1000\nfps: 10\n");
  for (int i = 1; i <= 12; ++i) {
    if (i != 3) write_image("image/" + std::to_string(i) + ".jpg", color_image(i));
    if (i != 7) write_image("depth/0000" + std::to_string(i) + ".png", depth_image(2000 + i));
  }
  write_text("trajectory.log",
             "0 0 1\n1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 2\n1 0 0 6\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "redwood");
  ASSERT_EQ((*source)->size(), 10U);
  EXPECT_THAT((*source)->info(9).color_file, HasSubstr("12.jpg"));  // by number, not by name
  EXPECT_FLOAT_EQ((*source)->read(9)->depth.at<float>(0, 0), 2.012F);
  EXPECT_DOUBLE_EQ((*source)->info(9).stamp, 1.2);
  EXPECT_THAT(log_.warnings, HasSubstr("2 images have no partner"));
  ASSERT_TRUE((*source)->truth());
  EXPECT_EQ((*(*source)->truth())[1].world_from_camera.translation.x(), 6.0);
  EXPECT_DOUBLE_EQ((*(*source)->truth())[1].stamp, (*source)->info(1).stamp);
}

TEST_F(Redwood, MicrosecondsInNamesAreStamps) {
  write_camera("depth_scale: 1000\n");
  write_image("rgb/0000001-000000000000.jpg", color_image(1));
  write_image("rgb/0000002-000000033000.jpg", color_image(2));
  write_image("rgb/0000003-000000066000.jpg", color_image(3));
  write_image("depth/0000001-000000036000.png", depth_image(2000));
  write_image("depth/0000002-000000069000.png", depth_image(2100));
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 2U);
  EXPECT_DOUBLE_EQ((*source)->info(0).stamp, 0.033);
  EXPECT_DOUBLE_EQ((*source)->info(1).depth_stamp, 0.069);
}

TEST_F(Redwood, NumbersThatNeverMeet) {
  write_camera();
  write_image("color/1.png", color_image(1));
  write_image("depth/2.png", depth_image());
  EXPECT_THAT(open_error(),
              AllOf(HasSubstr("matched by number"), HasSubstr("(1 to 1)"), HasSubstr("(2 to 2)")));
  std::filesystem::remove(folder_ / "depth/2.png");
  EXPECT_THAT(open_error(), HasSubstr("no numbered image"));
}

TEST_F(Redwood, Open3dIntrinsicsServeAsCamera) {
  write_image("color/1.png", color_image(1));
  write_image("depth/1.png", depth_image(2000));
  write_text("camera_intrinsic.json",
             "{\"width\": 64, \"height\": 48, \"intrinsic_matrix\": [52, 0, 0, 0, 52, 0, 31.5, 23.5, 1]}");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->read(0)->depth.at<float>(0, 0), 2.0F);
}

using Detection = RecordingTest;

TEST_F(Detection, MissingFolderFileAndEmptyFolder) {
  MemoryLog log;
  const auto missing = open_recording(folder_ / "nowhere", {}, log);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, core::ErrorKind::kInput);
  EXPECT_THAT(missing.error().message, AllOf(HasSubstr("nowhere"), HasSubstr("no such folder")));
  write_text("a_file", "x");
  const auto file = open_recording(folder_ / "a_file", {}, log);
  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message, HasSubstr("is a file"));
  std::filesystem::remove(folder_ / "a_file");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("the folder is empty"), HasSubstr("rgb.txt"),
                                  HasSubstr("frame-000000"), HasSubstr("depth/")));
  write_text("notes.md", "x");
  EXPECT_THAT(open_error(), HasSubstr("no recording found"));
}

TEST_F(Detection, FormatOverrides) {
  write_tum(3);  // has rgb/ and depth/ folders too
  OpenOptions options;
  options.format = "redwood";
  const auto source = open(options);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "redwood");
  options.format = "7scenes";
  EXPECT_THAT(open_error(options), HasSubstr("frame-000000.color.png"));
  options.format = "rosbag";
  EXPECT_THAT(open_error(options), AllOf(HasSubstr("'rosbag'"), HasSubstr("7scenes")));
}

TEST_F(Detection, CameraIsNeededAndCanBeNamed) {
  write_tum(3);
  std::filesystem::rename(folder_ / "camera.yaml", folder_ / "mine.yaml");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("no camera.yaml"), HasSubstr("--camera"), HasSubstr("tum_fr1")));
  OpenOptions options;
  options.camera = (folder_ / "mine.yaml").string();
  EXPECT_TRUE(open(options));
  options.camera = "mine";
  options.cameras_folder = folder_;
  EXPECT_TRUE(open(options));
  options.camera = "mime";
  EXPECT_THAT(open_error(options), HasSubstr("did you mean mine"));
  write_text("camera.yaml", "width: 64\nheight: 48\nfy: 52\ncx: 31.5\ncy: 23.5\n");
  const auto broken = open();
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().kind, core::ErrorKind::kUsage);
  EXPECT_THAT(broken.error().message, AllOf(HasSubstr("camera.yaml"), HasSubstr("fx: is missing")));
}

TEST_F(Detection, FoldersAreNamedWhateverTheirSpelling) {
  write_tum(2);
  MemoryLog log;
  for (const auto& spelling : {folder_ / "", folder_ / ".", folder_ / "rgb" / ".."}) {
    const auto source = open_recording(spelling, {}, log);
    ASSERT_TRUE(source) << source.error().message;
    EXPECT_EQ((*source)->name(), folder_.filename().string()) << spelling;
  }
}

}  // namespace
}  // namespace plumbline::dataset
