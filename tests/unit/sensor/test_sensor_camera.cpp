// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/camera_file.hpp"

namespace plumbline::sensor {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

class CameraFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("plumbline_camera_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& text, const std::string& name = "camera.yaml") {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  std::string error_of(const std::string& text) {
    const auto camera = read_camera(write(text));
    EXPECT_FALSE(camera) << text;
    if (camera) return "";
    EXPECT_EQ(camera.error().kind, core::ErrorKind::kUsage);
    return camera.error().message;
  }

  fs::path folder_;
};

const char* const kGood =
    "model: pinhole\nwidth: 64\nheight: 48\nfx: 52.5\nfy: 52.25\ncx: 31.5\ncy: 23.5\n"
    "distortion: [0.1, -0.2, 0.001, 0.002, 0.05]\ndepth_scale: 1000\nfps: 15\n";

const char* const kDepthCamera =
    "color_from_depth: [[1, 0, 0, 0.025], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
    "depth: {width: 32, height: 24, fx: 26, fy: 26, cx: 15.5, cy: 11.5}\n";

TEST_F(CameraFile, ReadsEverything) {
  const auto camera = read_camera(write(std::string(kGood) + kDepthCamera));
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->color.width, 64);
  EXPECT_EQ(camera->color.height, 48);
  EXPECT_EQ(camera->color.fx, 52.5);
  EXPECT_EQ(camera->color.fy, 52.25);
  EXPECT_EQ(camera->color.cx, 31.5);
  EXPECT_EQ(camera->color.cy, 23.5);
  EXPECT_EQ(camera->distortion, (Distortion{0.1, -0.2, 0.001, 0.002, 0.05}));
  EXPECT_TRUE(camera->distorted());
  EXPECT_EQ(camera->depth_scale, 1000.0);
  EXPECT_EQ(camera->fps, 15.0);
  ASSERT_TRUE(camera->color_from_depth && camera->depth);
  EXPECT_EQ(camera->color_from_depth->translation, Eigen::Vector3d(0.025, 0, 0));
  EXPECT_EQ(camera->depth->width, 32);
  EXPECT_EQ(camera->depth->cy, 11.5);
}

TEST_F(CameraFile, TextReadsBackTheSame) {
  auto camera = read_camera(write(std::string(kGood) + kDepthCamera));
  ASSERT_TRUE(camera);
  camera->name = "a: \"strange\" name";
  camera->color.fx = 517.306408 / 3.0;
  EXPECT_FALSE(camera->readout_s) << "not known is not 0";
  camera->readout_s = 0.021;
  EXPECT_EQ(camera->depth_slope, (std::array<double, 2>{}));
  camera->depth_slope = {0.0125, -1.0 / 300.0};
  camera->depth_delay_s = -0.1 / 7.0;
  camera->color_from_depth->rotation = geometry::exp_so3({0.01, -0.02, 0.03});
  const auto again = read_camera(write(to_yaml(*camera), "again.yaml"));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->name, camera->name);
  EXPECT_EQ(again->color.fx, camera->color.fx);
  EXPECT_EQ(again->readout_s, camera->readout_s);
  EXPECT_EQ(again->depth_slope, camera->depth_slope);
  EXPECT_EQ(again->depth_delay_s, camera->depth_delay_s);
  EXPECT_EQ(again->distortion, camera->distortion);
  EXPECT_EQ(again->depth->fx, camera->depth->fx);
  EXPECT_LT((again->color_from_depth->rotation - camera->color_from_depth->rotation).norm(), 1e-14);
  EXPECT_EQ(to_yaml(*again), to_yaml(*read_camera(write(to_yaml(*again), "third.yaml"))));
}

TEST_F(CameraFile, MissingKeysAreNamedTogether) {
  const std::string message = error_of("width: 64\nheight: 48\nfy: 50\ncx: 31\n");
  EXPECT_THAT(message,
              AllOf(HasSubstr("camera.yaml:1"), HasSubstr("fx: is missing"), HasSubstr("cy: is missing")));
  EXPECT_THAT(message, Not(HasSubstr("fy: is missing")));
}

TEST_F(CameraFile, EmptyFileIsAnError) {
  EXPECT_THAT(error_of(""), AllOf(HasSubstr("camera.yaml"), HasSubstr("fx: is missing")));
  EXPECT_THAT(error_of("# only a comment\n"), HasSubstr("width: is missing"));
  EXPECT_THAT(error_of("- 1\n- 2\n"), HasSubstr("camera.yaml:1"));
}

TEST_F(CameraFile, TellsItsOwnErrors) {
  const auto read = parse_camera(std::string(kGood) + "sigma: {fx: 0.8, readout: 0.5 ms}\n", "camera.yaml");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->sigma.fx, 0.8);
  EXPECT_EQ(read->sigma.readout_s, 0.0005);
  EXPECT_EQ(read->sigma.centre, 0.0);
  const auto again = parse_camera(to_yaml(*read), "again.yaml");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->sigma.fx, 0.8);
  EXPECT_EQ(again->sigma.readout_s, 0.0005);
  EXPECT_THAT(error_of(std::string(kGood) + "sigma: {fz: 1}\n"), HasSubstr("sigma.fz"));
  EXPECT_THAT(error_of(std::string(kGood) + "sigma: 1\n"), HasSubstr("standard deviations"));
  EXPECT_THAT(error_of(std::string(kGood) + "sigma: {fx: -1}\n"), HasSubstr("fx"));
}

TEST_F(CameraFile, UnknownKeyGetsASuggestion) {
  EXPECT_THAT(error_of(std::string(kGood) + "depth_scal: 5\n"),
              AllOf(HasSubstr("camera.yaml:11"), HasSubstr("did you mean depth_scale")));
}

TEST_F(CameraFile, ImpossibleValues) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = kGood;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  EXPECT_THAT(error_of(with("width: 64", "width: 0")), HasSubstr("camera.yaml:2"));
  EXPECT_THAT(error_of(with("fx: 52.5", "fx: -52.5")), AllOf(HasSubstr("camera.yaml:4"), HasSubstr("fx")));
  EXPECT_THAT(error_of(with("fy: 52.25", "fy: wide")), AllOf(HasSubstr("camera.yaml:5"), HasSubstr("wide")));
  EXPECT_THAT(error_of(with("cx: 31.5", "cx: 64")), AllOf(HasSubstr("camera.yaml:6"), HasSubstr("outside")));
  EXPECT_THAT(error_of(with("cy: 23.5", "cy: .nan")), HasSubstr("cy"));
  EXPECT_THAT(error_of(with("depth_scale: 1000", "depth_scale: 0")), HasSubstr("depth_scale"));
  EXPECT_THAT(error_of(with("model: pinhole", "model: omni")), HasSubstr("pinhole"));
  EXPECT_THAT(error_of(with("model: pinhole", "model: fisheye")), HasSubstr("1 to 4 of k1, k2, k3, k4"));
  EXPECT_THAT(error_of(with("0.002, 0.05]", "0.002, 0.05, 1]")), HasSubstr("k1, k2, p1, p2, k3"));
}

TEST_F(CameraFile, LensesOfBothCamerasReadBackTheSame) {
  const std::string text =
      "model: fisheye\nwidth: 64\nheight: 48\nfx: 30\nfy: 30\ncx: 31.5\ncy: 23.5\n"
      "distortion: [0.1, -0.02, 0.003, -0.0004]\n"
      "color_from_depth: [[1, 0, 0, 0.025], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
      "depth: {width: 32, height: 24, fx: 26, fy: 26, cx: 15.5, cy: 11.5, "
      "distortion: [1, 2, 3, 4, 5, 6, 7, 8]}\n";
  const auto camera = read_camera(write(text));
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->lens(), (Lens{LensModel::kEquidistant, {0.1, -0.02, 0.003, -0.0004}}));
  EXPECT_EQ(camera->depth_lens, (Lens{LensModel::kRadialTangential, {1, 2, 3, 4, 5, 6, 7, 8}}));
  const auto again = read_camera(write(to_yaml(*camera), "again.yaml"));
  ASSERT_TRUE(again) << again.error().message << to_yaml(*camera);
  EXPECT_EQ(again->lens(), camera->lens());
  EXPECT_EQ(again->depth_lens, camera->depth_lens);
  EXPECT_THAT(error_of(text.substr(0, text.rfind(", 8]")) + "]}\n"), HasSubstr("depth.distortion"));
}

TEST_F(CameraFile, DepthSlopeIsTwoSmallNumbers) {
  EXPECT_THAT(error_of(std::string(kGood) + "depth_slope: [0.01]\n"), HasSubstr("depth_slope"));
  EXPECT_THAT(error_of(std::string(kGood) + "depth_slope: [0.01, 0.5]\n"), HasSubstr("depth_slope"));
}

TEST_F(CameraFile, DepthDelayIsAFewFramesAtMost) {
  EXPECT_THAT(error_of(std::string(kGood) + "depth_delay: 0.2\n"), HasSubstr("depth_delay"));
  EXPECT_THAT(error_of(std::string(kGood) + "depth_delay: late\n"), HasSubstr("depth_delay"));
}

TEST_F(CameraFile, DepthCameraMustBeRigidAndComplete) {
  const std::string good = kGood;
  EXPECT_THAT(error_of(good + "color_from_depth: [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n" +
                       "depth: {width: 32, height: 24, fx: 26, fy: 26, cx: 15.5, cy: 11.5}\n"),
              HasSubstr("not rigid"));
  EXPECT_THAT(error_of(good + "color_from_depth: [-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n" +
                       "depth: {width: 32, height: 24, fx: 26, fy: 26, cx: 15.5, cy: 11.5}\n"),
              HasSubstr("not rigid"));
  EXPECT_THAT(error_of(good + "color_from_depth: [1, 2, 3]\n"), HasSubstr("4x4"));
  EXPECT_THAT(error_of(good + "color_from_depth: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n"),
              HasSubstr("depth: is missing"));
  EXPECT_THAT(error_of(good + "depth: {width: 32, height: 24, fx: 26, fy: 26, cx: 15.5, cy: 11.5}\n"),
              HasSubstr("color_from_depth: is missing"));
  EXPECT_THAT(error_of(good + "color_from_depth: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n" +
                       "depth: {width: 32, height: 24, fy: 26, cx: 15.5, cy: 11.5}\n"),
              HasSubstr("depth.fx: is missing"));
}

TEST_F(CameraFile, SixteenNumbersAreAMatrixToo) {
  const auto camera = read_camera(
      write(std::string(kGood) + "color_from_depth: [0,-1,0,1, 1,0,0,2, 0,0,1,3, 0,0,0,1]\n"
                                 "depth: {width: 32, height: 24, fx: 26, fy: 26, cx: 15.5, cy: 11.5}\n"));
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_LT((*camera->color_from_depth * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm(), 1e-12);
}

TEST_F(CameraFile, MissingFileIsAnError) {
  const auto camera = read_camera(folder_ / "nowhere.yaml");
  ASSERT_FALSE(camera);
  EXPECT_THAT(camera.error().message, HasSubstr("nowhere.yaml"));
}

TEST_F(CameraFile, FindsShippedNamesAndFiles) {
  write(kGood, "tum_fr1.yaml");
  write(kGood, "tum_fr2.yaml");
  const auto shipped = find_camera("tum_fr2", folder_);
  ASSERT_TRUE(shipped) << shipped.error().message;
  EXPECT_EQ(shipped->camera.name, "tum_fr2");
  EXPECT_TRUE(find_camera((folder_ / "tum_fr1.yaml").string(), "/nowhere"));
  const auto wrong = find_camera("tum_fr", folder_);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().kind, core::ErrorKind::kUsage);
  EXPECT_THAT(wrong.error().message, AllOf(HasSubstr("tum_fr1, tum_fr2"), HasSubstr("did you mean")));
}

TEST(ShippedCameras, AllLoad) {
  const fs::path folder = fs::path(PLUMBLINE_SOURCE_DIR) / "pipelines" / "cameras";
  int count = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    const auto camera = read_camera(entry.path());
    EXPECT_TRUE(camera) << camera.error().message;
    ++count;
  }
  EXPECT_GE(count, 5);
  const auto fr1 = find_camera("tum_fr1", folder);
  ASSERT_TRUE(fr1);
  EXPECT_TRUE(fr1->camera.distorted());
  EXPECT_EQ(fr1->camera.color.cy, 255.3);
  EXPECT_EQ(fr1->camera.distortion[4], 1.1633);
  EXPECT_EQ(find_camera("seven_scenes", folder)->camera.depth_scale, 1000.0);
}

}  // namespace
}  // namespace plumbline::sensor
