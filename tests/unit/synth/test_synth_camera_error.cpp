// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <sstream>

#include "plumbline/synth/recording.hpp"
#include "plumbline/synth/source.hpp"
#include "scene/camera_error.hpp"

namespace plumbline::synth {
namespace {

namespace fs = std::filesystem;
const std::string kErrorScenes = std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes";

std::unique_ptr<SynthSource> told_source(const std::string& error, int robots = 1, int robot = 0) {
  SynthOptions options;
  options.frames = 3;
  options.robots = robots;
  options.width = 160;
  options.height = 120;
  options.sensor = Sensor::kIdeal;
  options.readout_s = 0.01;
  options.camera_error = error;
  const core::Executor executor(1);
  auto world = build_world(*load_scene("structure", kErrorScenes), options, executor);
  if (!world) throw std::runtime_error(world.error().message);
  auto source = SynthSource::create(*world, robot);
  if (!source) throw std::runtime_error(source.error().message);
  return std::move(*source);
}

std::string why_no_error(const std::string& error) {
  SynthOptions options;
  options.camera_error = error;
  const auto checked = check(options);
  return checked ? "" : checked.error().message;
}

TEST(SynthCameraError, OnlyTheFileIsWrongByWhatIsAsked) {
  const auto right = told_source("");
  const auto wrong = told_source("fx=2%,fy=1%,cx=3,k1=0.03,slope=0.02,slope_y=-0.01,readout=-4ms,delay=15ms");
  const sensor::Camera &truth = right->camera(), &told = wrong->camera();
  EXPECT_EQ(sensor::to_yaml(wrong->true_camera()), sensor::to_yaml(truth));
  EXPECT_NEAR(told.color.fx, 1.02 * truth.color.fx, 1e-9);
  EXPECT_NEAR(told.color.fy, 1.01 * 1.02 * truth.color.fy, 1e-9);
  EXPECT_NEAR(told.color.cx, truth.color.cx + 3.0, 1e-9);
  EXPECT_EQ(told.color.cy, truth.color.cy);
  EXPECT_EQ(told.distortion[0], 0.03);
  EXPECT_EQ(told.depth_slope, (std::array<double, 2>{0.02, -0.01}));
  EXPECT_NEAR(*told.readout_s, 0.006, 1e-12);
  EXPECT_NEAR(told.depth_delay_s, 0.015, 1e-12);

  for (std::size_t i = 0; i < 3; ++i) {
    const auto a = right->stored(i), b = wrong->stored(i);
    EXPECT_EQ(cv::norm(a->color.pixels, b->color.pixels, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(a->depth.pixels, b->depth.pixels, cv::NORM_INF), 0.0);
    EXPECT_NEAR(wrong->info(i).depth_stamp, right->info(i).depth_stamp + 0.015, 1e-9);
    EXPECT_EQ(wrong->true_info(i).depth_stamp, right->info(i).depth_stamp);
  }
}

TEST(SynthCameraError, AnotherCameraCanBeTriedOnTheSamePictures) {
  const auto right = told_source(""), wrong = told_source("slope=0.05,delay=5ms");
  EXPECT_EQ(right->taken_by(right->camera()), nullptr);
  const auto mended = wrong->taken_by(wrong->true_camera());
  ASSERT_NE(mended, nullptr);
  const auto a = right->read(1), b = wrong->read(1), c = mended->read(1);
  EXPECT_GT(cv::norm(a->depth, b->depth, cv::NORM_INF), 0.02);
  EXPECT_LT(cv::norm(a->depth, c->depth, cv::NORM_INF), 1e-5);
  EXPECT_NEAR(c->depth_stamp, a->depth_stamp, 1e-9);

  // A principal point that is 4 px off: pictures of the true camera, in images of the one that was told.
  const auto moved = told_source("cx=4")->taken_by(right->camera())->read(1);
  const cv::Rect left(4, 0, 152, 120), shifted(8, 0, 152, 120);
  EXPECT_EQ(cv::norm(a->color(left), moved->color(shifted), cv::NORM_INF), 0.0);
}

TEST(SynthCameraError, SeedsDrawGroupsThatAreRightHalfOfTheTime) {
  constexpr int kSeeds = 300;
  const auto truth = told_source("")->camera();
  int right[6] = {};
  double focal = 0.0, readout = 0.0;
  SynthOptions options;
  for (int seed = 0; seed < kSeeds; ++seed) {
    options.camera_error = std::to_string(seed);
    const auto told = *told_camera(options, 0, truth);
    const bool as_is[] = {told.color.fx == truth.color.fx,     told.color.cx == truth.color.cx,
                          told.distortion == truth.distortion, told.depth_slope == truth.depth_slope,
                          told.readout_s == truth.readout_s,   told.depth_delay_s == truth.depth_delay_s};
    for (int i = 0; i < 6; ++i) right[i] += as_is[i] ? 1 : 0;
    focal += std::pow(told.color.fx / truth.color.fx - 1.0, 2);
    readout += std::pow(*told.readout_s - *truth.readout_s, 2);
    EXPECT_GE(*told.readout_s, *truth.readout_s);
    EXPECT_NEAR(told.color.fy / told.color.fx, truth.color.fy / truth.color.fx, 1e-12);
  }
  for (const int count : right) EXPECT_NEAR(count, kSeeds / 2, 35);
  EXPECT_NEAR(std::sqrt(focal / (kSeeds - right[0])), 0.015, 0.0025);
  EXPECT_NEAR(std::sqrt(readout / (kSeeds - right[4])), 0.015, 0.0025);
}

TEST(SynthCameraError, RobotsHaveErrorsOfTheirOwn) {
  EXPECT_NE(sensor::to_yaml(told_source("4", 2, 0)->camera()),
            sensor::to_yaml(told_source("4", 2, 1)->camera()));
  EXPECT_EQ(sensor::to_yaml(told_source("4", 2, 1)->camera()),
            sensor::to_yaml(told_source("4", 2, 1)->camera()));
}

TEST(SynthCameraError, MistakesAreNamed) {
  EXPECT_EQ(why_no_error("fx=1.5%,readout=10ms"), "");
  EXPECT_NE(why_no_error("fx=1.5%,redout=10ms").find("did you mean readout"), std::string::npos);
  EXPECT_NE(why_no_error("fx=90%").find("camera_error.fx"), std::string::npos);
  EXPECT_NE(why_no_error("k1").find("camera_error.k1"), std::string::npos);
  EXPECT_THROW(told_source("readout=-20ms"), std::runtime_error);  // of 10 ms
  EXPECT_THROW(told_source("cx=500"), std::runtime_error);
}

TEST(SynthCameraError, FolderHasBothFilesAndReadsLikeTheAddress) {
  const fs::path folder = fs::path(::testing::TempDir()) / ("plumbline_told_" + std::to_string(::getpid()));
  fs::remove_all(folder);
  SynthOptions options;
  options.frames = 2;
  options.width = 160;
  options.height = 120;
  options.reference_spacing = 0.05;
  options.camera_error = "fx=1%,k1=0.05,slope=0.02,delay=-3ms";
  const core::Executor executor(1);
  const auto log = core::null_log();
  const auto written =
      write_recordings({*load_scene("structure", kErrorScenes), options, folder}, executor, {}, *log, {});
  ASSERT_TRUE(written) << written.error().message;

  const auto truth = sensor::read_camera(folder / "robot0" / "camera.true.yaml");
  ASSERT_TRUE(truth) << truth.error().message;
  const auto a = dataset::open_recording(folder / "robot0", {}, *log);
  ASSERT_TRUE(a) << a.error().message;
  const auto b =
      open_synth("synth:structure?frames=2&width=160&height=120&camera_error=" + options.camera_error,
                 kErrorScenes, executor, *log);
  ASSERT_TRUE(b) << b.error().message;
  EXPECT_EQ((*a)->camera().distortion[0], 0.05);
  EXPECT_EQ(truth->distortion[0], 0.0);
  EXPECT_EQ(sensor::to_yaml((*a)->camera()), sensor::to_yaml((*b)->camera()));
  for (std::size_t i = 0; i < 2; ++i) {
    const auto x = (*a)->read(i), y = (*b)->read(i);
    EXPECT_EQ(cv::norm(x->color, y->color, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(x->depth, y->depth, cv::NORM_INF), 0.0);
    EXPECT_NEAR(x->depth_stamp, y->depth_stamp, 1e-6);
  }

  std::ifstream stream(folder / "scene.json");
  const auto json = nlohmann::json::parse(stream);
  EXPECT_EQ(json["options"]["camera_error"], options.camera_error);
  EXPECT_EQ(json["robots"][0]["camera"]["file"]["distortion"][0], 0.05);
  EXPECT_EQ(json["robots"][0]["camera"]["true"]["distortion"][0], 0.0);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace plumbline::synth
