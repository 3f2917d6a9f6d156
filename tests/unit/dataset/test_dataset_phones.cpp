// SPDX-License-Identifier: BSD-3-Clause
// Recordings of phones and of simulators, and the rule of two sizes.
#include <gmock/gmock.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "plumbline/dataset/image_io.hpp"
#include "plumbline/dataset/recording_poses.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// An array of NumPy with this header and these bytes.
std::string npy(const std::string& dictionary, const std::string& numbers) {
  std::string header = dictionary;
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  std::string file = "\x93NUMPY";
  file += {'\x01', '\0', static_cast<char>(header.size() & 0xFFU), static_cast<char>(header.size() >> 8U)};
  return file + header + numbers;
}

std::string metres_npy(int width, int height, float metres) {
  std::string numbers;
  for (int i = 0; i < width * height; ++i) {
    char bytes[sizeof metres];
    std::memcpy(bytes, &metres, sizeof metres);
    numbers.append(bytes, sizeof metres);
  }
  return npy("{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::to_string(height) + ", " +
                 std::to_string(width) + "), }",
             numbers);
}

using Npy = RecordingTest;

TEST_F(Npy, IsAnImageOfItsNumbers) {
  write_text("a.npy", metres_npy(4, 3, 1.5F));
  const auto image = read_image(folder_ / "a.npy");
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->type(), CV_32FC1);
  EXPECT_EQ(image->size(), cv::Size(4, 3));
  EXPECT_EQ(image->at<float>(2, 3), 1.5F);
  write_text("b.npy",
             npy("{'descr': '<u2', 'fortran_order': False, 'shape': (1, 2, 1)}", "\x01\x02\x03\x04"));
  EXPECT_FALSE(read_image(folder_ / "b.npy")) << "a row is no image";
  write_text("c.npy", npy("{'descr': '<u2', 'fortran_order': False, 'shape': (2, 2, 1)}",
                          std::string("\x01\x02\x03\x04\x05\x06\x07\x08")));
  EXPECT_EQ(read_image(folder_ / "c.npy")->at<std::uint16_t>(1, 1), 0x0807);
}

TEST_F(Npy, WhatIsNoImageIsRefused) {
  const std::string good = metres_npy(4, 3, 1.5F);
  const auto refusal = [&](const std::string& bytes) {
    write_text("a.npy", bytes);
    const auto image = read_image(folder_ / "a.npy");
    EXPECT_FALSE(image);
    return image ? "" : image.error().message;
  };
  EXPECT_THAT(refusal(good.substr(0, good.size() - 1)), AllOf(HasSubstr("a.npy"), HasSubstr("ends before")));
  EXPECT_THAT(refusal(good.substr(0, 40)), HasSubstr("header"));
  EXPECT_THAT(refusal(npy("{'descr': '>f4', 'fortran_order': False, 'shape': (3, 4)}", std::string(48, 'x'))),
              HasSubstr("'<f4'"));
  EXPECT_THAT(refusal(npy("{'descr': '<f4', 'fortran_order': True, 'shape': (3, 4)}", std::string(48, 'x'))),
              HasSubstr("row by row"));
  EXPECT_THAT(
      refusal(npy("{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999, 99999999999)}", "x")),
      HasSubstr("not the size of an image"));
  EXPECT_THAT(refusal(npy("{}", "x")), HasSubstr("not an image"));
}

using TartanAir = RecordingTest;

TEST_F(TartanAir, NumbersPosesAndTheCameraOfAllOfIt) {
  for (int i = 0; i < 3; ++i) {
    const std::string n = "00000" + std::to_string(i);
    write_image("image_left/" + n + "_left.png", color_image(i, {640, 480}));
    write_text("depth_left/" + n + "_left_depth.npy", metres_npy(640, 480, 2.0F + static_cast<float>(i)));
  }
  // a step ahead, to the right and down, north-east-down, and then a turn to the right
  write_text("pose_left.txt", "1 2 3 0 0 0 1\nnan 0 0 0 0 0 1\n0 0 0 0 0 0.70710678 0.70710678\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "tartanair");
  ASSERT_EQ((*source)->size(), 3U);
  EXPECT_EQ((*source)->camera().color.fx, 320.0);
  EXPECT_EQ((*source)->camera().color.cx, 320.0);
  EXPECT_NEAR((*source)->read(1)->depth.at<float>(7, 9), 3.0F, 1e-4);
  EXPECT_THAT(log_.warnings, HasSubstr("1 of 3 rows are not poses"));
  const auto truth = (*source)->truth();
  ASSERT_TRUE(truth);
  ASSERT_EQ(truth->size(), 2U);
  EXPECT_LT(((*truth)[0].world_from_camera.translation - Eigen::Vector3d(1, -2, -3)).norm(), 1e-9);
  // the camera's forward is its z; east is -y of the upright world
  EXPECT_LT(
      ((*truth)[0].world_from_camera.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(),
      1e-6);
  EXPECT_LT(
      ((*truth)[0].world_from_camera.rotation * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitZ()).norm(),
      1e-6);
  EXPECT_LT(
      ((*truth)[1].world_from_camera.rotation * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitY()).norm(),
      1e-6);
  EXPECT_FALSE((*source)->truth_is_odometry());
}

/// Looking along -z of ARKit's world, upright, at (1, 2, 3) of it.
const char* const kArkitCamera =
    "\"t_00\": 1, \"t_01\": 0, \"t_02\": 0, \"t_03\": 1, \"t_10\": 0, \"t_11\": 1, \"t_12\": 0, \"t_13\": 2, "
    "\"t_20\": 0, \"t_21\": 0, \"t_22\": 1, \"t_23\": 3";

void expect_arkit_pose(const geometry::Rigid3& pose) {
  EXPECT_LT((pose.translation - Eigen::Vector3d(1, -3, 2)).norm(), 1e-9);
  EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitY()).norm(), 1e-9) << "ahead";
  EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitZ()).norm(), 1e-9) << "down";
}

class Polycam : public RecordingTest {
 protected:
  void write(int frames, const std::string& images = "images", const std::string& cameras = "cameras") const {
    for (int i = 0; i < frames; ++i) {
      const std::string name = std::to_string(5000000 + 400000 * i);
      write_image("keyframes/" + images + "/" + name + ".jpg",
                  cv::Mat(96, 128, CV_8UC3, cv::Scalar(80, 90, images == "images" ? 100 : 200)));
      cv::Mat depth = depth_image(2000, {32, 24});
      depth.colRange(16, 32) = 3000;
      write_image("keyframes/depth/" + name + ".png", depth);
      cv::Mat mask(24, 32, CV_8UC1, cv::Scalar(255));
      mask.rowRange(0, 12) = 0;
      write_image("keyframes/confidence/" + name + ".png", mask);
      write_text("keyframes/" + cameras + "/" + name + ".json",
                 "{" + std::string(kArkitCamera) + ", \"fx\": " + std::to_string(100 + 2 * i) +
                     ", \"fy\": 100, \"cx\": 63.5, \"cy\": 47.5, \"width\": 128, \"height\": 96}");
    }
  }
};

TEST_F(Polycam, EachFrameHasItsCameraAndItsPose) {
  write(3);
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "polycam");
  ASSERT_EQ((*source)->size(), 3U);
  EXPECT_DOUBLE_EQ((*source)->info(1).stamp, 5.4);
  EXPECT_EQ((*source)->camera().color.fx, 100.0);
  ASSERT_TRUE((*source)->truth());
  expect_arkit_pose((*(*source)->truth())[2].world_from_camera);
  EXPECT_TRUE((*source)->truth_is_odometry());
  const auto poses = recording_poses(folder_, log_);
  ASSERT_TRUE(poses) << poses.error().message;
  EXPECT_EQ(poses->poses.size(), 3U);
  EXPECT_THAT(poses->notes, testing::ElementsAre(HasSubstr("odometry")));
  const auto frame = (*source)->read(2);
  ASSERT_TRUE(frame) << frame.error().message;
  ASSERT_TRUE(frame->odometry);
  expect_arkit_pose(*frame->odometry);
  EXPECT_EQ(frame->depth.at<float>(20, 30), 0.0F) << "of no confidence";
  EXPECT_NEAR(frame->depth.at<float>(80, 30), 2.0F, 1e-4);
  EXPECT_NEAR(frame->depth.at<float>(80, 100), 3.0F, 1e-4);
  for (int u = 0; u < 128; ++u) {
    const float z = frame->depth.at<float>(80, u);
    EXPECT_TRUE(std::abs(z - 2.0F) < 1e-3F || std::abs(z - 3.0F) < 1e-3F || z == 0.0F) << u << ": mixed";
  }
}

TEST_F(Polycam, CorrectedImagesAndPosesAreTakenWhereTheyAre) {
  write(2);
  write(2, "corrected_images", "corrected_cameras");
  auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_NEAR((*source)->read(0)->color.at<cv::Vec3b>(50, 50)[2], 200, 3);
  std::filesystem::remove(folder_ / "keyframes/corrected_cameras/5000000.json");
  source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->size(), 1U);
  EXPECT_THAT(log_.warnings, HasSubstr("1 frames are left out"));
  write_text("keyframes/corrected_cameras/5400000.json", "{\"fx\": ");
  EXPECT_THAT(open_error(), HasSubstr("with a camera that can be read (2 cannot)"));
}

TEST_F(Polycam, PosesCanBeIgnoredAndCamerasNamed) {
  write(2);
  write_text("camera.yaml",
             "width: 128\nheight: 96\nfx: 90\nfy: 90\ncx: 63.5\ncy: 47.5\ndepth_scale: 1000\n");
  OpenOptions options;
  options.poses = PoseUse::kIgnore;
  const auto source = open(options);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->camera().color.fx, 90.0);
  EXPECT_EQ((*source)->info(1).camera, -1);
  EXPECT_FALSE((*source)->read(0)->odometry);
  EXPECT_TRUE((*source)->truth()) << "to compare with";
}

class Record3d : public RecordingTest {
 protected:
  nlohmann::json metadata_ = {
      {"w", 64},
      {"h", 48},
      {"fps", 10},
      {"K", {52, 0, 0, 0, 53, 0, 31.5, 23.5, 1}},
      {"poses", {{0, 0, 0, 1, 1, 2, 3}, {0, 0, 0, 1, 1, 2, 3}, {0, 0, 0, 0, 1, 2, 3}}}};
  void write() const {
    for (int i = 0; i < 3; ++i) {
      write_image("EXR_RGBD/rgb/" + std::to_string(i) + ".jpg", color_image(i));
      write_text("EXR_RGBD/depth/" + std::to_string(i) + ".npy", metres_npy(16, 12, 2.0F));
    }
    write_text("EXR_RGBD/metadata.json", metadata_.dump());
  }
};

TEST_F(Record3d, MetadataIsTheCameraAndThePoses) {
  write();
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "record3d");
  ASSERT_EQ((*source)->size(), 3U);
  EXPECT_EQ((*source)->camera().color.fy, 53.0);
  EXPECT_EQ((*source)->camera().color.cx, 31.5);
  EXPECT_DOUBLE_EQ((*source)->info(2).stamp, 0.2);
  ASSERT_TRUE((*source)->truth());
  ASSERT_EQ((*source)->truth()->size(), 2U);
  expect_arkit_pose((*(*source)->truth())[1].world_from_camera);
  EXPECT_THAT(log_.warnings, HasSubstr("1 frames have no pose"));
  EXPECT_NEAR((*source)->read(0)->depth.at<float>(24, 32), 2.0F, 1e-4);
  EXPECT_FALSE((*source)->read(2)->odometry);
}

TEST_F(Record3d, LaterVersionsSayMore) {
  metadata_["frameTimestamps"] = {7.0, 7.5, 8.5};
  metadata_["perFrameIntrinsicCoeffs"] = {{52, 53, 31.5, 23.5}, {54, 55, 31, 23}, {56, 57, 31.5, 23.5}};
  metadata_["w"] = 128;  // what is stored is half as large
  metadata_["h"] = 96;
  metadata_["K"] = {104, 0, 0, 0, 106, 0, 63.5, 47.5, 1};
  write();
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_DOUBLE_EQ((*source)->info(2).stamp, 8.5);
  EXPECT_EQ((*source)->info(1).camera, 1);
  EXPECT_EQ((*source)->camera().color.fx, 52.0);
  EXPECT_EQ((*source)->camera().color.cx, 31.5);
  EXPECT_TRUE((*source)->read(1));
}

TEST_F(Record3d, DeepJsonIsRefusedAtItsPlace) {
  write();
  write_text("EXR_RGBD/metadata.json", std::string(150000, '['));
  EXPECT_THAT(open_error(),
              AllOf(HasSubstr("metadata.json:1:65"), HasSubstr("nested deeper than 64 levels")));
  write_text("EXR_RGBD/metadata.json", "{\"K\": [52, 0,\n 0, }");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("metadata.json:2:5"), HasSubstr("is not valid JSON")));
}

TEST_F(Record3d, WithoutACameraItIsRefused) {
  metadata_.erase("K");
  write();
  EXPECT_THAT(open_error(), AllOf(HasSubstr("metadata.json"), HasSubstr("K (9 numbers)")));
}

TEST_F(Record3d, ItsOwnFileIsRefusedWithTheWayOut) {
  write_text("room.r3d", "PK\x03\x04");
  const auto source = open_recording(folder_ / "room.r3d", {}, log_);
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message,
              AllOf(HasSubstr("room.r3d"), HasSubstr("LZFSE"), HasSubstr("EXR + JPG")));
  write_text("room.zip", "PK\x03\x04");
  EXPECT_THAT(open_recording(folder_ / "room.zip", {}, log_).error().message, HasSubstr("unpack it"));
  EXPECT_TRUE(is_recording_file(folder_ / "room.r3d"));
  EXPECT_FALSE(is_recording_file(folder_ / "room.zip"));
}

class TwoSizes : public RecordingTest {
 protected:
  void write(cv::Size color, cv::Size depth, const std::string& camera) const {
    for (int i = 0; i < 3; ++i) {
      write_image("rgb/" + std::to_string(i) + ".png", color_image(i, color));
      write_image("depth/" + std::to_string(i) + ".png", depth_image(2000, depth));
    }
    write_text("rgb.txt", "1.0 rgb/0.png\n1.1 rgb/1.png\n1.2 rgb/2.png\n");
    write_text("depth.txt", "1.0 depth/0.png\n1.1 depth/1.png\n1.2 depth/2.png\n");
    write_text("camera.yaml", camera);
  }
};

TEST_F(TwoSizes, OneCalibrationIsScaledByPixelCentres) {
  write({128, 96}, {64, 48},
        "width: 128\nheight: 96\nfx: 104\nfy: 104\ncx: 63.5\ncy: 47.5\ndepth_scale: 1000\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  const sensor::Camera& camera = (*source)->camera();
  ASSERT_TRUE(camera.depth);
  EXPECT_EQ(camera.depth->width, 64);
  EXPECT_EQ(camera.depth->cx, 31.5);
  EXPECT_EQ(camera.depth->fx, 52.0);
  const auto frame = (*source)->read(1);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(cv::countNonZero(frame->depth), 128 * 96);
}

TEST_F(TwoSizes, TheCalibrationMayBeThatOfDepth) {
  write({128, 96}, {64, 48},
        "width: 64\nheight: 48\nfx: 52\nfy: 52\ncx: 31.5\ncy: 23.5\ndepth_scale: 1000\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->camera().color.width, 128);
  EXPECT_EQ((*source)->camera().color.cx, 63.5);
  EXPECT_TRUE((*source)->read(0));
}

TEST_F(TwoSizes, LargeColourIsReducedByAWholeFactor) {
  write({1280, 96}, {64, 48},
        "width: 1280\nheight: 96\nfx: 208\nfy: 208\ncx: 639.5\ncy: 47.5\ndepth_scale: 1000\n"
        "color_from_depth: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
        "depth: {width: 64, height: 48, fx: 104, fy: 104, cx: 31.5, cy: 23.5}\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->camera().color.width, 640);
  EXPECT_EQ((*source)->camera().color.cx, 319.5);
  const auto frame = (*source)->read(1);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->color.size(), cv::Size(640, 48));
}

using DecimalCommas = RecordingTest;

TEST_F(DecimalCommas, AreNamedWithTheirLine) {
  write_tum(2);
  write_text("rgb.txt", "# stamps of a locale\n100,000000 rgb/0.png\n100,100000 rgb/1.png\n");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("rgb.txt:2"), HasSubstr("decimal comma")));
  write_text("associations.txt", "100,0 rgb/0.png 100,0 depth/0.png\n");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("associations.txt:1"), HasSubstr("decimal comma")));
  write_text("associations.txt", "100.0,rgb/0.png,100.0,depth/0.png\n");
  EXPECT_TRUE(open()) << "commas between words are none";
}

TEST_F(TwoSizes, OtherShapesAreNotScaled) {
  write({128, 96}, {64, 36},
        "width: 128\nheight: 96\nfx: 104\nfy: 104\ncx: 63.5\ncy: 47.5\ndepth_scale: 1000\n");
  EXPECT_THAT(open_error(), HasSubstr("the depth image is 64x36"));
}

}  // namespace
}  // namespace plumbline::dataset
