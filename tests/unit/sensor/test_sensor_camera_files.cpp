// SPDX-License-Identifier: BSD-3-Clause
// Camera files of other programs, as those programs write them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "plumbline/sensor/camera_file.hpp"

namespace plumbline::sensor {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
namespace fs = std::filesystem;

class ForeignCamera : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("plumbline_foreign_camera_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& text, const std::string& name = "cam.yaml") {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  CameraReading read(const std::string& text, const std::string& name = "cam.yaml") {
    auto reading = read_camera_file(write(text, name));
    EXPECT_TRUE(reading) << (reading ? "" : reading.error().message);
    return reading ? *reading : CameraReading{};
  }
  std::string refusal(const std::string& text, const std::string& name = "cam.yaml") {
    const auto reading = read_camera_file(write(text, name));
    EXPECT_FALSE(reading) << text;
    if (reading) return "";
    EXPECT_EQ(reading.error().kind, core::ErrorKind::kUsage);
    return reading.error().message;
  }

  fs::path folder_;
};

/// fx fy cx cy of every example below.
void expect_example(const CameraReading& reading) {
  const Pinhole& p = reading.camera.color;
  EXPECT_DOUBLE_EQ(p.fx, 481.2);
  EXPECT_DOUBLE_EQ(p.fy, 480.0);
  EXPECT_DOUBLE_EQ(p.cx, 319.5);
  EXPECT_DOUBLE_EQ(p.cy, 239.5);
}

void expect_example_of_size(const CameraReading& reading) {
  expect_example(reading);
  EXPECT_TRUE(reading.has_size);
  EXPECT_EQ(reading.camera.color.width, 640);
  EXPECT_EQ(reading.camera.color.height, 480);
}

TEST_F(ForeignCamera, OrbSlam2WithIntegersAndItsDirective) {
  const auto reading = read(
      "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.fx: 481.2\nCamera.fy: 480\nCamera.cx: 319.5\nCamera.cy: "
      "239.5\n"
      "Camera.p1: 0\nDepthMapFactor: 5000\n");
  expect_example(reading);
  EXPECT_FALSE(reading.has_size);
  EXPECT_TRUE(reading.has_depth_scale);
  EXPECT_EQ(reading.camera.depth_scale, 5000.0);
  EXPECT_FALSE(reading.camera.distorted());
  EXPECT_THAT(reading.program, HasSubstr("ORB-SLAM2"));
}

TEST_F(ForeignCamera, OrbSlam3WithNumberedCameraSizeAndMatrix) {
  const auto reading = read(
      "%YAML:1.0\r\n---\r\n#------\r\nFile.version: \"1.0\"\r\nCamera.type: \"PinHole\"\r\nCamera1.fx: "
      "481.2\r\n"
      "Camera1.fy: 480.0\r\nCamera1.cx: 319.5\r\nCamera1.cy: 239.5\r\nCamera1.k1: 0.2624\r\nCamera1.k2: "
      "-0.9531\r\n"
      "Camera1.p1: -0.0054\r\nCamera1.p2: 0.0026\r\nCamera1.k3: 1.1633\r\nCamera.width: "
      "640\r\nCamera.height: 480\r\n"
      "Camera.fps: 15\r\nRGBD.DepthMapFactor: 1000.0\r\n"
      "IMU.T_b_c1: !!opencv-matrix\r\n   rows: 1\r\n   cols: 1\r\n   dt: f\r\n   data: [1.0]\r\n");
  expect_example_of_size(reading);
  EXPECT_THAT(reading.camera.distortion, ElementsAre(0.2624, -0.9531, -0.0054, 0.0026, 1.1633, 0, 0, 0));
  EXPECT_EQ(reading.camera.depth_scale, 1000.0);
  EXPECT_EQ(reading.camera.fps, 15.0);
}

TEST_F(ForeignCamera, OrbSlamThatCannotBeTaken) {
  EXPECT_THAT(
      refusal("%YAML:1.0\nCamera.type: \"Omnidirectional\"\nCamera1.fx: 480\nCamera1.fy: 480\nCamera1.cx: "
              "320\nCamera1.cy: 240\nCamera1.k1: 0.1\n"),
      AllOf(HasSubstr("cam.yaml"), HasSubstr("ORB-SLAM"), HasSubstr("omnidirectional"),
            HasSubstr("undistort the images first"), HasSubstr("fx: 480")));
  EXPECT_THAT(refusal("Camera.fx: 480\nCamera.fy: 480\nCamera.cx: 320\n"),
              AllOf(HasSubstr("Camera.cy"), HasSubstr("cx: 320"), HasSubstr("cy: CY")));
}

TEST_F(ForeignCamera, RosInBlockAndInFlow) {
  expect_example_of_size(
      read("image_width: 640\nimage_height: 480\ncamera_matrix: {rows: 3, cols: 3, data: [481.2, 0, 319.5, "
           "0, 480.0, "
           "239.5, 0, 0, 1]}\n"));
  const auto block = read(
      "image_width: 640\nimage_height: 480\ncamera_name: rgb\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: "
      "[481.2, "
      "0.0, 319.5,\n         0.0, 480.0, 239.5,\n         0.0, 0.0, 1.0]\ndistortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data:\n  - 0.1\n  - -0.2\n  - 0.001\n  - 0.002\n  - "
      "0.05\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n");
  expect_example_of_size(block);
  EXPECT_THAT(block.camera.distortion, ElementsAre(0.1, -0.2, 0.001, 0.002, 0.05, 0, 0, 0));
  EXPECT_FALSE(block.has_depth_scale);
}

TEST_F(ForeignCamera, RosMessagesAsTheyAreEchoed) {
  const char* const message =
      "header:\n  stamp:\n    sec: 1\n    nanosec: 2\n  frame_id: camera\nheight: 480\nwidth: 640\n"
      "distortion_model: plumb_bob\nd:\n- 0.0\n- 0.0\n- 0.0\n- 0.0\n- 0.0\nk:\n- 481.2\n- 0.0\n- 319.5\n- "
      "0.0\n"
      "- 480.0\n- 239.5\n- 0.0\n- 0.0\n- 1.0\nbinning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n  y_offset: "
      "0\n---\n";
  expect_example_of_size(read(std::string(message) + message));
  EXPECT_THAT(refusal("height: 480\nwidth: 640\nD: []\nK: [0, 0, 0, 0, 0, 0, 0, 0, 0]\n"),
              HasSubstr("not calibrated"));
  EXPECT_THAT(
      refusal("height: 480\nwidth: 640\nD: []\nbinning_x: 2\nK: [481.2, 0, 319.5, 0, 480, 239.5, 0, 0, 1]\n"),
      HasSubstr("binning"));
}

TEST_F(ForeignCamera, RationalAndFisheyeModels) {
  const std::string k = "height: 480\nwidth: 640\nK: [481.2, 0, 319.5, 0, 480, 239.5, 0, 0, 1]\n";
  EXPECT_THAT(
      read(k + "distortion_model: rational_polynomial\nD: [1, 2, 0, 0, 3, 4, 5, 6]\n").camera.distortion,
      ElementsAre(1, 2, 0, 0, 3, 4, 5, 6));
  EXPECT_THAT(
      refusal(k + "distortion_model: rational_polynomial\nD: [1, 2, 0, 0, 3, 4, 5, 6, 7, 8, 9, 10]\n"),
      AllOf(HasSubstr("rational_polynomial"), HasSubstr("12 coefficients")));
  const auto fisheye = read(k + "distortion_model: equidistant\nD: [0.1, 0.2, 0.3, 0.4]\n");
  EXPECT_EQ(fisheye.camera.model, LensModel::kEquidistant);
  EXPECT_THAT(fisheye.camera.distortion, ElementsAre(0.1, 0.2, 0.3, 0.4, 0, 0, 0, 0));
  EXPECT_TRUE(read(k + "distortion_model: equidistant\nD: [0, 0, 0, 0]\n").camera.distorted());
  EXPECT_THAT(refusal(k + "distortion_model: equidistant\nD: [0, 0, 0, 0, 1]\n"), HasSubstr("k1 k2 k3 k4"));
  EXPECT_THAT(refusal(k + "distortion_model: ftheta\nD: [1]\n"), HasSubstr("'ftheta'"));
  const auto orb = read(
      "%YAML:1.0\nCamera.type: \"KannalaBrandt8\"\nCamera1.fx: 481.2\nCamera1.fy: 480\nCamera1.cx: 319.5\n"
      "Camera1.cy: 239.5\nCamera1.k1: 0.1\nCamera1.k2: 0.2\nCamera1.k3: 0.3\nCamera1.k4: 0.4\n");
  EXPECT_EQ(orb.camera.model, LensModel::kEquidistant);
  EXPECT_THAT(orb.camera.distortion, ElementsAre(0.1, 0.2, 0.3, 0.4, 0, 0, 0, 0));
}

TEST_F(ForeignCamera, Open3dInColumnsAndByMistakeInRows) {
  const auto reading = read(
      "{\"width\": 640, \"height\": 480, \"intrinsic_matrix\": [481.2, 0, 0, 0, 480.0, 0, 319.5, 239.5, "
      "1]}\n",
      "cam.json");
  expect_example_of_size(reading);
  EXPECT_FALSE(reading.has_depth_scale);
  expect_example_of_size(
      read("{\n\t\"width\": 640,\n\t\"height\": 480,\n\t\"intrinsic_matrix\": [481.2, 0, 319.5, 0, 480.0, "
           "239.5, 0, 0, "
           "1]\n}\n",
           "tabs.json"));
  expect_example_of_size(
      read("{\"class_name\": \"PinholeCameraParameters\", \"extrinsic\": [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],\n"
           "\"intrinsic\": {\"height\": 480, \"intrinsic_matrix\": [481.2,0,0,0,480,0,319.5,239.5,1], "
           "\"width\": 640}}",
           "parameters.json"));
  const auto recorded = read(
      "{\"depth_scale\": 1000.0000474974513, \"fps\": 30.0, \"height\": 480, \"width\": 640,\n"
      "\"intrinsic_matrix\": [481.2, 0, 0, 0, 480.0, 0, 319.5, 239.5, 1]}",
      "intrinsic.json");
  EXPECT_NEAR(recorded.camera.depth_scale, 1000.0, 1e-3);
  EXPECT_TRUE(recorded.has_depth_scale);
  EXPECT_THAT(refusal("{\"width\": 640, \"height\": 480, \"intrinsic_matrix\": [481.2, 0, 0]}", "short.json"),
              AllOf(HasSubstr("Open3D"), HasSubstr("3 numbers"), HasSubstr("width: 640")));
}

TEST_F(ForeignCamera, ColmapPutsPixelCentresAtHalf) {
  const auto reading = read("# Camera list\n1 OPENCV 640 480 481.2 480.0 320 240 0 0 0 0\n", "cameras.txt");
  expect_example_of_size(reading);
  EXPECT_THAT(reading.notes, ElementsAre(HasSubstr("half a pixel")));
  const auto simple = read("1 SIMPLE_RADIAL 640 480 500 320 240 0.1\n", "cameras.txt");
  EXPECT_EQ(simple.camera.color.fy, 500.0);
  EXPECT_EQ(simple.camera.color.cy, 239.5);
  EXPECT_EQ(simple.camera.distortion[0], 0.1);
  const auto fisheye = read("1 OPENCV_FISHEYE 640 480 481.2 480 320 240 0.1 0.2 0.3 0.4\n", "cameras.txt");
  expect_example_of_size(fisheye);
  EXPECT_EQ(fisheye.camera.model, LensModel::kEquidistant);
  EXPECT_EQ(fisheye.camera.distortion[3], 0.4);
  EXPECT_THAT(
      read("1 FULL_OPENCV 640 480 481 480 320 240 1 2 3 4 5 6 7 8\n", "cameras.txt").camera.distortion,
      ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(refusal("1 FOV 640 480 481 480 320 240 0.9\n", "cameras.txt"),
              AllOf(HasSubstr("cameras.txt:1"), HasSubstr("'fov'")));
  EXPECT_THAT(refusal("1 PINHOLE 640 480 481 480 320\n", "cameras.txt"), HasSubstr("4 numbers"));
  EXPECT_THAT(
      refusal("1 PINHOLE 640 480 481 480 320 240\n2 PINHOLE 640 480 500 500 320 240\n", "cameras.txt"),
      AllOf(HasSubstr("cameras.txt:2"), HasSubstr("several cameras")));
  expect_example_of_size(
      read("1 PINHOLE 640 480 481.2 480 320 240\n2 PINHOLE 640 480 481.2 480 320 240\n", "cameras.txt"));
}

TEST_F(ForeignCamera, KalibrAndEuroc) {
  const auto reading = read(
      "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [-0.28, 0.07, 0.0002, "
      "0.00001]\n"
      "  distortion_model: radtan\n  intrinsics: [481.2, 480.0, 319.5, 239.5]\n  resolution: [640, 480]\n"
      "  rostopic: /cam0/image_raw\ncam1:\n  camera_model: pinhole\n  intrinsics: [1, 1, 1, 1]\n");
  expect_example_of_size(reading);
  EXPECT_THAT(reading.camera.distortion, ElementsAre(-0.28, 0.07, 0.0002, 0.00001, 0, 0, 0, 0));
  EXPECT_THAT(reading.notes, ElementsAre(HasSubstr("cam0")));
  expect_example_of_size(
      read("sensor_type: camera\nrate_hz: 20\nresolution: [640, 480]\ncamera_model: pinhole\n"
           "intrinsics: [481.2, 480, 319.5, 239.5]\ndistortion_model: radial-tangential\n"
           "distortion_coefficients: [0, 0, 0, 0]\n"));
  EXPECT_EQ(
      read("cam0: {camera_model: pinhole, intrinsics: [481.2, 480, 319.5, 239.5], resolution: [640, 480],\n"
           "  distortion_model: equidistant, distortion_coeffs: [0.1, 0, 0, 0]}\n")
          .camera.model,
      LensModel::kEquidistant);
  EXPECT_THAT(refusal("cam0: {camera_model: omni, intrinsics: [1, 481.2, 480, 319.5, 239.5]}\n"),
              HasSubstr("'omni'"));
}

TEST_F(ForeignCamera, PlainMatricesAndLines) {
  for (const char* text :
       {"481.2 0 319.5\n0 480 239.5\n0 0 1\n", "481.2 0 319.5 0\n0 480 239.5 0\n0 0 1 0\n",
        "481.2,0.0,319.5\n0.0,480,239.5\n0.0,0.0,1.0\n",
        "[[481.2, 0, 319.5],\n [0, 480., 239.5],\n [0, 0, 1]]\n",
        "481.2 0 319.5 0\n0 480 239.5 0\n0 0 1 0\n0 0 0 1\n", "481.2 0 319.5 0 480 239.5 0 0 1\n",
        "481.2 480 319.5 239.5\n", "# fx fy cx cy\r\n481.2, 480, 319.5, 239.5\r\n"}) {
    const auto reading = read(text, "calibration.txt");
    expect_example(reading);
    EXPECT_FALSE(reading.has_size) << text;
    EXPECT_FALSE(reading.has_depth_scale) << text;
    EXPECT_FALSE(reading.camera.distorted()) << text;
  }
  EXPECT_THAT(read("481.2 480 319.5 239.5 0.1 0.2 0.3 0.4\n", "a.txt").camera.distortion,
              ElementsAre(0.1, 0.2, 0.3, 0.4, 0, 0, 0, 0));
  EXPECT_THAT(read("481.2 480 319.5 239.5 0.1 0.2 0.3 0.4 0.5\n", "a.txt").camera.distortion,
              ElementsAre(0.1, 0.2, 0.3, 0.4, 0.5, 0, 0, 0));
  EXPECT_THAT(refusal("481.2 480 319.5\n", "a.txt"), AllOf(HasSubstr("3 numbers"), HasSubstr("fx fy cx cy")));
  EXPECT_THAT(refusal("481,2 480,0 319,5 239,5\n", "a.txt"),
              AllOf(HasSubstr("a.txt:1"), HasSubstr("decimal comma")));
  EXPECT_THAT(refusal("481.2 3 319.5\n0 480 239.5\n0 0 1\n", "a.txt"), HasSubstr("skew"));
  EXPECT_THAT(refusal("0.75 1.0 0.5 0.5\n", "a.txt"), HasSubstr("shares of the image's size"));
  EXPECT_THAT(refusal("-481 480 319 239\n", "a.txt"), HasSubstr("not focal lengths"));
}

TEST_F(ForeignCamera, RealSenseScaleIsMetresAUnit) {
  const auto alone = read(
      "{\"width\": 640, \"height\": 480, \"ppx\": 319.5, \"ppy\": 239.5, \"fx\": 481.2, \"fy\": 480.0,\n"
      "\"model\": \"distortion.inverse_brown_conrady\", \"coeffs\": [0, 0, 0, 0, 0], \"depth_scale\": "
      "0.0010000000474974513}",
      "realsense.json");
  expect_example_of_size(alone);
  EXPECT_EQ(alone.camera.depth_scale, 1000.0);
  const std::string streams =
      "{\"color\": {\"width\": 640, \"height\": 480, \"fx\": 481.2, \"fy\": 480, \"ppx\": 319.5, \"ppy\": "
      "239.5},\n"
      "\"depth\": {\"width\": 848, \"height\": 480, \"fx\": 420, \"fy\": 420, \"ppx\": 424, \"ppy\": 240},\n"
      "\"depth_scale\": 0.00025";
  const auto two = read(streams + "}", "two.json");
  expect_example_of_size(two);
  EXPECT_EQ(two.camera.depth_scale, 4000.0);
  EXPECT_FALSE(two.camera.color_from_depth);
  EXPECT_THAT(two.notes, ElementsAre(HasSubstr("aligned")));
  const auto placed = read(streams +
                               ",\n\"depth_to_color\": {\"rotation\": [0, 1, 0, -1, 0, 0, 0, 0, 1], "
                               "\"translation\": [0.015, 0, 0]}}",
                           "placed.json");
  ASSERT_TRUE(placed.camera.color_from_depth && placed.camera.depth);
  EXPECT_EQ(placed.camera.depth->width, 848);
  const Eigen::Vector3d moved = *placed.camera.color_from_depth * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT((moved - Eigen::Vector3d(0.015, 1, 0)).norm(), 1e-9);  // rotations are written column by column
}

TEST_F(ForeignCamera, ReplicaAndNiceSlam) {
  const auto reading = read(
      "{\"camera\": {\"w\": 640, \"h\": 480, \"fx\": 481.2, \"fy\": 480, \"cx\": 319.5, \"cy\": 239.5, "
      "\"scale\": "
      "6553.5}}",
      "cam_params.json");
  expect_example_of_size(reading);
  EXPECT_EQ(reading.camera.depth_scale, 6553.5);
  const auto settings = read(
      "dataset: 'replica'\ncam: # of NICE-SLAM\n  H: 480\n  W: 640\n  fx: 481.2\n  fy: 480\n  cx: 319.5\n  "
      "cy: 239.5\n"
      "  png_depth_scale: 6553.5\n  crop_edge: 0\n",
      "replica.yaml");
  expect_example_of_size(settings);
  EXPECT_EQ(settings.camera.depth_scale, 6553.5);
}

TEST_F(ForeignCamera, ScanNetHasTwoCameras) {
  const auto scene = read(
      "axisAlignment = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\ncolorHeight = 968\ncolorWidth = 1296\ndepthHeight = "
      "480\n"
      "depthWidth = 640\nfx_color = 1170.187988\nfx_depth = 570.924255\nfy_color = 1170.187988\nfy_depth = "
      "570.924316\nmx_color = 647.75\nmx_depth = 319.5\nmy_color = 483.75\nmy_depth = 239.5\nsceneType = "
      "Bedroom\n",
      "scene0000_00.txt");
  EXPECT_EQ(scene.camera.color.width, 1296);
  EXPECT_EQ(scene.camera.color.cx, 647.75);
  ASSERT_TRUE(scene.camera.depth && scene.camera.color_from_depth);
  EXPECT_EQ(scene.camera.depth->width, 640);
  EXPECT_EQ(scene.camera.depth->fy, 570.924316);
  EXPECT_EQ(scene.camera.depth_scale, 1000.0);
  const auto info = read(
      "m_versionNumber = 4\nm_colorWidth = 1296\nm_colorHeight = 968\nm_depthWidth = 640\nm_depthHeight = "
      "480\n"
      "m_depthShift = 1000\nm_calibrationColorIntrinsic = 1170 0 647 0 0 1171 483 0 0 0 1 0 0 0 0 1 \n"
      "m_calibrationDepthIntrinsic = 571 0 319.5 0 0 572 239.5 0 0 0 1 0 0 0 0 1 \n",
      "_info.txt");
  EXPECT_EQ(info.camera.color.fy, 1171.0);
  EXPECT_EQ(info.camera.depth->fx, 571.0);
}

TEST_F(ForeignCamera, OurOwnIsStillRead) {
  const auto reading =
      read("width: 640\nheight: 480\nfx: 481.2\nfy: 480\ncx: 319.5\ncy: 239.5\ndepth_scale: 5000\n");
  expect_example_of_size(reading);
  EXPECT_EQ(reading.program, "");
  EXPECT_THAT(refusal("width: 640\nheight: 480\nfx: 481.2\ncx: 319.5\ncy: 239.5\n"),
              HasSubstr("fy: is missing"));
}

TEST_F(ForeignCamera, WhatIsNotReadIsNamedWithTheLinesToWrite) {
  EXPECT_THAT(
      refusal("{\"fl_x\": 500, \"fl_y\": 500, \"cx\": 320, \"cy\": 240, \"w\": 640, \"h\": 480}", "t.json"),
      AllOf(HasSubstr("nerfstudio"), HasSubstr("fx: FX"), HasSubstr("depth_scale:")));
  EXPECT_THAT(refusal("<?xml version=\"1.0\"?>\n<opencv_storage>\n</opencv_storage>\n", "calib.xml"),
              HasSubstr("OpenCV as XML"));
  EXPECT_THAT(refusal("%YAML:1.0\nmodel_type: PINHOLE\nprojection_parameters:\n   fx: 4.6e+02\n"),
              HasSubstr("VINS"));
  EXPECT_THAT(refusal("dear diary\n", "notes.txt"),
              AllOf(HasSubstr("is not a known camera file"), HasSubstr("COLMAP")));
  EXPECT_THAT(refusal("", "empty.txt"), HasSubstr("is not a known camera file"));
  EXPECT_THAT(refusal(std::string(2'000'000, '1'), "long.txt"), HasSubstr("1 MB"));
  EXPECT_THAT(refusal("a: [1, 2\n", "broken.yaml"), HasSubstr("broken.yaml:"));
}

TEST_F(ForeignCamera, PrincipalPointsOutsideTheImageAreRefused) {
  EXPECT_THAT(refusal("1 PINHOLE 640 480 481 480 900 240\n", "cameras.txt"),
              AllOf(HasSubstr("outside"), HasSubstr("640x480"), HasSubstr("COLMAP")));
}

TEST_F(ForeignCamera, FoundAmongOtherFilesByItsContent) {
  EXPECT_TRUE(is_foreign_camera_file(write("Camera.fx: 1\n"), false));
  EXPECT_FALSE(is_foreign_camera_file(write("1 2 3 4\n", "a.txt"), false));
  EXPECT_TRUE(is_foreign_camera_file(write("1 2 3 4\n", "a.txt"), true));
  EXPECT_FALSE(is_foreign_camera_file(write("fx: 1\n"), true));
  EXPECT_FALSE(is_foreign_camera_file(folder_ / "nowhere", true));
}

}  // namespace
}  // namespace plumbline::sensor
