// SPDX-License-Identifier: BSD-3-Clause
// 7-Scenes and Redwood layouts, detection, cameras.
#include <gmock/gmock.h>

#include <cstdio>
#include <opencv2/videoio.hpp>

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
  EXPECT_NEAR((*source)->info(1).stamp, 4.0 / 30.0, 1e-9);
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
  EXPECT_THAT((*source)->stored(9)->color.name, HasSubstr("12.jpg"));  // by number, not by name
  EXPECT_FLOAT_EQ((*source)->read(9)->depth.at<float>(0, 0), 2.012F);
  EXPECT_DOUBLE_EQ((*source)->info(9).stamp, 1.2);
  EXPECT_THAT(log_.warnings, HasSubstr("2 images have no partner"));
  ASSERT_TRUE((*source)->truth());
  EXPECT_EQ((*(*source)->truth())[1].world_from_camera.translation.x(), 6.0);
  EXPECT_DOUBLE_EQ((*(*source)->truth())[1].stamp, (*source)->info(1).stamp);
}

TEST_F(Redwood, LinksToNothingAreMissingFrames) {
  write_camera("depth_scale: 1000\n");
  for (int i = 0; i < 4; ++i) {
    write_image("color/" + std::to_string(i) + ".png", color_image(i));
    write_image("depth/" + std::to_string(i) + ".png", depth_image(2000));
  }
  std::filesystem::remove(folder_ / "depth/2.png");
  std::filesystem::create_symlink("nowhere/2.png", folder_ / "depth/2.png");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->size(), 3U);
  EXPECT_EQ((*source)->missing(), 1U);
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("1 of 4 frames are missing"), HasSubstr("depth/2.png")));
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

using Replica = RecordingTest;

TEST_F(Replica, FramesCameraAndTruth) {
  std::string rows;
  for (int i = 0; i < 3; ++i) {
    const std::string number = "00000" + std::to_string(i);
    write_image("room0/results/frame" + number + ".jpg", color_image(i));
    write_image("room0/results/depth" + number + ".png", depth_image(13107));
    rows += i == 1 ? "-inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf -inf\n"
                   : "1 0 0 " + std::to_string(i) + " 0 1 0 0 0 0 1 0 0 0 0 1\n";
  }
  write_text("room0/traj.txt", rows);
  write_text(
      "cam_params.json",  // beside the rooms
      "{\"camera\": {\"w\": 64, \"h\": 48, \"fx\": 52, \"fy\": 52, \"cx\": 31.5, \"cy\": 23.5, \"scale\": "
      "6553.5}}");
  MemoryLog log;
  const auto source = open_recording(folder_ / "room0", {}, log);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "replica");
  ASSERT_EQ((*source)->size(), 3U);
  EXPECT_NEAR((*source)->info(2).stamp, 2.0 / 30.0, 1e-9);
  EXPECT_FLOAT_EQ((*source)->read(0)->depth.at<float>(3, 3), 2.0F);
  ASSERT_TRUE((*source)->truth());
  ASSERT_EQ((*source)->truth()->size(), 2U);
  EXPECT_DOUBLE_EQ((*(*source)->truth())[1].stamp, 2.0 / 30.0);
  EXPECT_EQ((*(*source)->truth())[1].world_from_camera.translation.x(), 2.0);
  EXPECT_THAT(log.warnings, HasSubstr("1 of 3 rows"));
}

using ScanNet = RecordingTest;

TEST_F(ScanNet, TwoSizesTwoCalibrationsAndNumbersWithoutZeros) {
  const auto matrix = [](double f, double cx, double cy) {
    return std::to_string(f) + " 0 " + std::to_string(cx) + " 0\n0 " + std::to_string(f) + " " +
           std::to_string(cy) + " 0\n0 0 1 0\n0 0 0 1\n";
  };
  for (int i = 0; i < 12; ++i) {
    const std::string id = std::to_string(i);
    write_image("color/" + id + ".jpg", color_image(i, {1024, 768}));
    write_image("depth/" + id + ".png", depth_image(2000));
    write_text("pose/" + id + ".txt",
               i == 5 ? "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n"
                      : "1 0 0 " + id + "\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  }
  write_text("intrinsic/intrinsic_color.txt", matrix(832, 511.5, 383.5));
  write_text("intrinsic/intrinsic_depth.txt", matrix(52, 31.5, 23.5));
  write_text("intrinsic/extrinsic_color.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  write_text("intrinsic/extrinsic_depth.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "scannet");
  ASSERT_EQ((*source)->size(), 12U);
  EXPECT_THAT((*source)->stored(2)->color.name, HasSubstr("color/2.jpg"));
  EXPECT_THAT((*source)->stored(11)->depth.name, HasSubstr("depth/11.png"));
  const sensor::Camera& camera = (*source)->camera();
  EXPECT_EQ(camera.color.width, 512);
  EXPECT_DOUBLE_EQ(camera.color.fx, 416.0);
  EXPECT_DOUBLE_EQ(camera.color.cx, 255.5);
  EXPECT_EQ(camera.depth_scale, 1000.0);
  const auto frame = (*source)->read(3);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->color.size(), cv::Size(512, 384));
  EXPECT_FLOAT_EQ(frame->depth.at<float>(190, 250), 2.0F);
  EXPECT_EQ((*source)->truth()->size(), 11U);
  EXPECT_THAT(log_.warnings, HasSubstr("1 of 12 poses"));
  const auto better = (*source)->taken_by(camera);  // as when its camera turns out to be another one
  ASSERT_NE(better, nullptr);
  EXPECT_EQ(better->read(3)->color.size(), cv::Size(512, 384));
}

using StrayScanner = RecordingTest;

TEST_F(StrayScanner, FilmMasksAndOneCalibrationForTwoSizes) {
  cv::VideoWriter film((folder_ / "rgb.mp4").string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 30.0,
                       {1920, 1440});
  if (!film.isOpened()) GTEST_SKIP() << "OpenCV writes no MPEG-4 here";
  std::string odometry = "timestamp, frame, x, y, z, qx, qy, qz, qw\n";
  for (int i = 0; i < 5; ++i) {
    const std::string number = "00000" + std::to_string(i);
    film.write(cv::Mat(1440, 1920, CV_8UC3, cv::Scalar(40.0 * i, 100, 200)));
    write_image("depth/" + number + ".png", depth_image(2000, {256, 192}));
    cv::Mat confidence(192, 256, CV_8UC1, cv::Scalar(2));
    confidence.colRange(0, 128).setTo(0);
    write_image("confidence/" + number + ".png", confidence);
    odometry +=
        std::to_string(100.0 + i / 30.0) + ", " + number + ", " + std::to_string(i) + ", 0, 0, 0, 0, 0, 1\n";
  }
  film.release();
  write_text("odometry.csv", odometry);
  write_text("camera_matrix.csv", "1560.0,0.0,959.5\n0.0,1560.0,719.5\n0.0,0.0,1.0\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "stray");
  ASSERT_EQ((*source)->size(), 5U);
  EXPECT_NEAR((*source)->info(3).stamp, 100.1, 1e-6);
  EXPECT_EQ((*source)->camera().color.width, 960);
  EXPECT_DOUBLE_EQ((*source)->camera().color.fx, 780.0);
  EXPECT_DOUBLE_EQ((*source)->camera().depth->fx, 208.0);
  for (const std::size_t i : {3, 0, 4, 1}) {  // out of order, as threads ask
    const auto frame = (*source)->read(i);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->color.size(), cv::Size(960, 720));
    EXPECT_NEAR(frame->color.at<cv::Vec3b>(300, 300)[0], 40.0 * static_cast<double>(i), 6.0) << i;
    EXPECT_FLOAT_EQ(frame->depth.at<float>(360, 700), 2.0F);
    EXPECT_EQ(frame->depth.at<float>(360, 200), 0.0F);
  }
  EXPECT_EQ((*source)->truth()->size(), 5U);
  write_text("rgb.mp4", "no film");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("rgb.mp4"), HasSubstr("not a video")));
}

using Detection = RecordingTest;

TEST_F(Detection, FolderOfNoLayoutIsToldWhatWasSeenAndTheNearest) {
  write_text("depth/a.txt", "x");
  write_text("lidar/a.bin", "x");
  write_text("rgb.mp4", "x");
  write_text("one.bag", "x");
  write_text("two.bag", "x");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("no recording found"), HasSubstr("depth/, lidar/"),
                                  HasSubstr("2 .bag files"), HasSubstr("1 .mp4 file"),
                                  HasSubstr("nearest layout"), HasSubstr("color/ or image/ or rgb/")));
}

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

const char* const kOrbCamera = "%YAML:1.0\nCamera.fx: 52\nCamera.fy: 52\nCamera.cx: 31.5\nCamera.cy: 23.5\n";

TEST_F(Detection, ForeignCameraTakesItsSizeFromTheImagesAndItsScaleFromTheLayout) {
  write_tum(3);
  std::filesystem::remove(folder_ / "camera.yaml");
  write_text("TUM1.yaml", kOrbCamera);
  const auto tum = open();
  ASSERT_TRUE(tum) << tum.error().message;
  EXPECT_EQ((*tum)->camera().color.width, 64);
  EXPECT_EQ((*tum)->camera().color.height, 48);
  EXPECT_EQ((*tum)->camera().depth_scale, 5000.0);
  EXPECT_THAT(log_.infos, AllOf(HasSubstr("TUM1.yaml"), HasSubstr("ORB-SLAM2"),
                                HasSubstr("fx 52 fy 52 cx 31.5"), HasSubstr("64x48 (from the images)"),
                                HasSubstr("no distortion"), HasSubstr("5000 (usual in the layout tum)")));
  write_text("cameras.txt",
             "1 PINHOLE 64 48 50 50 32 24\n");  // its name goes before what is found by content
  const auto colmap = open();
  ASSERT_TRUE(colmap) << colmap.error().message;
  EXPECT_EQ((*colmap)->camera().color.cx, 31.5);
  OpenOptions named;
  named.camera = (folder_ / "TUM1.yaml").string();
  EXPECT_EQ((*open(named))->camera().color.fx, 52.0);
}

TEST_F(Detection, CalibrationOfEth3dIsUsed) {
  write_tum(3);
  std::filesystem::remove(folder_ / "camera.yaml");
  write_text("calibration.txt", "52.5 52.25 31.5 23.5\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->camera().color.fy, 52.25);
  EXPECT_FALSE((*source)->camera().guess);
  write_text("calibration.txt", "made in 2019 by hand\n");
  EXPECT_THAT(open_error(), HasSubstr("no camera.yaml"));
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("calibration.txt"), HasSubstr("not used")));
}

TEST_F(Detection, TwoForeignCamerasThatDiffer) {
  write_tum(3);
  std::filesystem::remove(folder_ / "camera.yaml");
  write_text("a.yaml", kOrbCamera);
  write_text("b.yaml", kOrbCamera);
  EXPECT_TRUE(open());
  write_text("b.yaml", std::string(kOrbCamera) + "Camera.k1: 0.1\n");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("a.yaml"), HasSubstr("b.yaml"), HasSubstr("--camera")));
}

TEST_F(Detection, ForeignCameraOfAnotherSize) {
  write_tum(3);
  std::filesystem::remove(folder_ / "camera.yaml");
  write_text("calibration.txt", "520 520 319.5 239.5\n");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("calibration.txt"), HasSubstr("outside the image of 64x48")));
}

TEST_F(Detection, FramesWithOneStampAreDropped) {
  write_tum(4);
  write_text("associations.txt",
             "100.0 rgb/0.png 100.0 depth/0.png\n100.1 rgb/1.png 100.1 depth/1.png\n100.1 rgb/2.png 100.1 "
             "depth/2.png\n100.2 rgb/3.png 100.2 depth/3.png\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 3U);
  EXPECT_THAT((*source)->stored(1)->color.name, HasSubstr("1.png"));
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("1 of 4 frames"), HasSubstr("100.100000"), HasSubstr("2.png")));
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
