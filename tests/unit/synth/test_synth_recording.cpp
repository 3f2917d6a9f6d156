// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <sstream>

#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/synth/layout.hpp"
#include "plumbline/synth/recording.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {
namespace {

namespace fs = std::filesystem;
const std::string kSceneFolder = std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes";

class SynthRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("plumbline_synth_" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    options_.frames = 6;
    options_.robots = 2;
    options_.width = 160;
    options_.height = 120;
    options_.reference_spacing = 0.03;
  }
  void TearDown() override { fs::remove_all(folder_); }

  core::Result<WriteSummary> write(int threads, const fs::path& to, const core::StopToken& stop = {}) {
    const auto scene = load_scene("structure", kSceneFolder);
    if (!scene) throw std::runtime_error(scene.error().message);
    const core::Executor executor(threads);
    const auto log = core::null_log();
    return write_recordings({*scene, options_, to}, executor, stop, *log,
                            [this](std::size_t done, std::size_t) { told_ = done; });
  }
  static std::string bytes(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }

  fs::path folder_;
  SynthOptions options_;
  std::size_t told_ = 0;
};

TEST_F(SynthRecording, WhatIsWrittenIsWhatIsRendered) {
  const auto summary = write(2, folder_);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->frames, 12U);
  EXPECT_EQ(told_, 12U);
  EXPECT_FALSE(summary->stopped);
  const core::Executor executor(1);
  const auto log = core::null_log();
  for (int robot = 0; robot < 2; ++robot) {
    const auto written = dataset::open_recording(folder_ / ("robot" + std::to_string(robot)), {}, *log);
    ASSERT_TRUE(written) << written.error().message;
    const auto rendered =
        open_synth("synth:structure?frames=6&robots=2&width=160&height=120&robot=" + std::to_string(robot),
                   kSceneFolder, executor, *log);
    ASSERT_TRUE(rendered) << rendered.error().message;
    ASSERT_EQ((*written)->size(), 6U);
    EXPECT_EQ((*written)->camera().color.fx, (*rendered)->camera().color.fx);
    for (std::size_t i = 0; i < 6; ++i) {
      const auto a = (*written)->read(i), b = (*rendered)->read(i);
      ASSERT_TRUE(a && b);
      EXPECT_EQ(a->stamp, b->stamp);
      EXPECT_EQ(a->depth_stamp, b->depth_stamp);
      EXPECT_EQ(cv::norm(a->color, b->color, cv::NORM_INF), 0.0);
      EXPECT_LT(cv::norm(a->depth, b->depth, cv::NORM_INF), 1e-5);
    }
    const auto truth =
        dataset::read_trajectory(folder_ / ("robot" + std::to_string(robot)) / "groundtruth.txt");
    ASSERT_TRUE(truth) << truth.error().message;
    EXPECT_EQ(truth->size(), 12U);
    const auto pose = geometry::pose_at(*truth, (*rendered)->info(2).stamp);
    ASSERT_TRUE(pose);
    EXPECT_LT((pose->translation - (*(*rendered)->truth())[2].world_from_camera.translation).norm(), 1e-6);
  }
}

TEST_F(SynthRecording, SameBytesOnAnyNumberOfThreads) {
  ASSERT_TRUE(write(1, folder_ / "one"));
  ASSERT_TRUE(write(2, folder_ / "two"));
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "one")) {
    if (!entry.is_regular_file()) continue;
    ++files;
    EXPECT_EQ(bytes(entry.path()), bytes(folder_ / "two" / fs::relative(entry.path(), folder_ / "one")))
        << entry.path();
  }
  EXPECT_EQ(files, 2U * (12U + 6U) + 2U);
}

TEST_F(SynthRecording, ReferenceLiesOnTheSurfacesAndTellsWhatWasSeen) {
  const auto summary = write(2, folder_);
  ASSERT_TRUE(summary) << summary.error().message;
  const std::string ply = bytes(folder_ / "reference.ply");
  const std::size_t body = ply.find("end_header\n") + 11;
  EXPECT_NE(ply.find("element vertex " + std::to_string(summary->reference_samples)), std::string::npos);
  ASSERT_EQ(ply.size() - body, summary->reference_samples * 28);
  EXPECT_GT(summary->reference_visible, summary->reference_samples / 200);
  EXPECT_LT(summary->reference_visible, summary->reference_samples);
  std::size_t visible = 0;
  for (std::size_t i = 0; i < summary->reference_samples; ++i) {
    float v[6];
    std::memcpy(v, ply.data() + body + 28 * i, sizeof v);
    EXPECT_NEAR(std::hypot(v[3], v[4], v[5]), 1.0F, 1e-5F);
    ASSERT_LE(std::abs(v[0]), 6.11F);
    ASSERT_LE(v[2], 4.31F);
    visible += static_cast<std::size_t>(ply[body + 28 * i + 27]);
    if (ply[body + 28 * i + 27] == 1) {
      EXPECT_GT(v[1], -1.5F);  // both robots look to +y
    }
  }
  EXPECT_EQ(visible, summary->reference_visible);
  const auto json = nlohmann::json::parse(bytes(folder_ / "scene.json"));
  EXPECT_EQ(json["robots"].size(), 2U);
  EXPECT_EQ(json["options"]["seed"], 1);
  EXPECT_TRUE(json["complete"]);
}

TEST_F(SynthRecording, StopsInOrderAndRefusesToOverwrite) {
  const core::StopToken stop;
  stop.request_stop();
  const auto summary = write(1, folder_, stop);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_TRUE(summary->stopped);
  EXPECT_EQ(summary->frames, 0U);
  const auto again = write(1, folder_);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().kind, core::ErrorKind::kOutput);
  const auto nowhere = write(1, "/proc/no/such/place");
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, core::ErrorKind::kOutput);
}

TEST_F(SynthRecording, RoundsThatRepeatAreTheFirstOneLater) {
  options_.layout = 1;
  options_.path = Route::kLaps;
  options_.robots = 1;
  options_.frames = -1;
  options_.repeat = 3;
  options_.fps = 1.0;
  options_.events = "lampoff@2+1,drop@4+1";
  const auto scene = make_layout("home", options_);
  ASSERT_TRUE(scene) << scene.error().message;
  const core::Executor executor(2);
  const auto source = SynthSource::create(*build_world(*scene, options_, executor), 0);
  ASSERT_TRUE(source) << source.error().message;
  const SynthSource& film = **source;
  const std::size_t round = film.round();
  ASSERT_EQ(film.size(), 3 * round);
  const double seconds = static_cast<double>(round + 1);  // with the dropped frame

  for (const std::size_t i : {std::size_t{0}, round / 2, round - 1}) {
    EXPECT_NEAR(film.info(i + 2 * round).stamp - film.info(i).stamp, 2.0 * seconds, 2e-6);
    const auto first = film.stored(i), later = film.stored(i + 2 * round);
    EXPECT_EQ(cv::norm(first->color.pixels, later->color.pixels, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(first->depth.pixels, later->depth.pixels, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(first->color.pixels, film.rendered(i + round).color.pixels, cv::NORM_INF), 0.0);
    const geometry::Rigid3 gone = film.world_from_camera(film.info(i).stamp).inverse() *
                                  film.world_from_camera(film.info(i + 2 * round).stamp);
    EXPECT_LT(gone.translation.norm(), 1e-5);
    EXPECT_LT(geometry::log_so3(gone.rotation).norm(), 1e-5);
  }

  // The seam is as smooth as the path.
  const PathMotion seam = film.motion(film.start() + seconds);
  EXPECT_LT(seam.acceleration.norm(), 5.0);
  EXPECT_EQ(film.events().size(), 6U);

  // Files of later rounds are those of the first.
  const auto log = core::null_log();
  options_.moving_masks = true;
  const auto summary = write_recordings({*scene, options_, folder_}, executor, {}, *log, {});
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->frames, 3 * round);
  std::size_t pictures = 0;
  for ([[maybe_unused]] const auto& file : fs::directory_iterator(folder_ / "robot0/rgb")) ++pictures;
  EXPECT_EQ(pictures, 3 * round);

  // A path that does not close has no rounds.
  Scene open = *scene;
  open.robots[0].closed = false;
  const auto refused = build_world(open, options_, executor);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("closed: true"), std::string::npos) << refused.error().message;
}

TEST_F(SynthRecording, DoorsSwingWhileNoCameraIsNear) {
  std::size_t doors = 0;
  for (int number = 0; number < 4; ++number) {
    options_.layout = number;
    options_.robots = 1;
    options_.frames = 600;
    options_.fps = 10.0;
    options_.moving_doors = 3;
    Scene scene = *make_layout("office", options_);
    choose_moving_doors(options_, scene);
    EXPECT_LE(scene.moving_doors.size(), 3U);
    const core::Executor executor(1);
    const auto source = SynthSource::create(*build_world(scene, options_, executor), 0);
    ASSERT_TRUE(source) << source.error().message;

    for (const MovingDoor& door : scene.moving_doors) {
      const double start = door.starts.front();
      EXPECT_EQ(door.angle(0.0), door.rest_rad);
      EXPECT_NEAR(door.angle(start + door.swing + 0.5 * door.hold), door.other_rad, 1e-9);
      EXPECT_NEAR(door.angle(start + 2.0 * door.swing + door.hold), door.rest_rad, 1e-9);
      EXPECT_GT(std::abs(door.other_rad - door.rest_rad), 0.39);
      const Eigen::Vector3d hinge = scene.leaves[door.leaf].hinge;
      for (int i = 0; i < 10; ++i) {
        const double t = start + 0.1 * i * (2.0 * door.swing + door.hold);
        const Eigen::Vector3d eye = (*source)->world_from_camera((*source)->start() + t).translation - hinge;
        EXPECT_GT(eye.head<2>().norm(), 1.0);
      }
    }
    doors += scene.moving_doors.size();
    const auto swings = (*source)->swings();
    EXPECT_EQ(swings.empty(), scene.moving_doors.empty());
  }
  EXPECT_GT(doors, 1U);
}

TEST_F(SynthRecording, DrawersSlideOutOfDesks) {
  options_.layout = 2;
  options_.robots = 1;
  options_.frames = 400;
  options_.fps = 10.0;
  options_.moving_drawers = 3;
  Scene scene = *make_layout("office", options_);
  const std::size_t faces = scene.faces.size();
  choose_moving_doors(options_, scene);
  ASSERT_FALSE(scene.moving_doors.empty());
  EXPECT_EQ(scene.faces.size(), faces);

  const core::Executor executor(1);
  const auto source =
      SynthSource::create(*build_world(*make_layout("office", options_), options_, executor), 0);
  ASSERT_TRUE(source) << source.error().message;
  const auto slides = (*source)->swings();
  ASSERT_GE(slides.size(), 2U);
  EXPECT_EQ(slides[0].drawer.rfind("drawer of desk", 0), 0U) << slides[0].drawer;
  EXPECT_GT(slides[0].open, 0.14);
  EXPECT_EQ(slides[1].open, 0.0);
  for (const MovingDoor& drawer : scene.moving_doors) {
    EXPECT_EQ(drawer.angle(drawer.starts.front()), 0.0);
    EXPECT_NEAR(drawer.angle(drawer.starts.front() + drawer.swing + 0.5 * drawer.hold), 1.0, 1e-12);
    EXPECT_EQ(drawer.slide.z(), 0.0);
  }
}

}  // namespace
}  // namespace plumbline::synth
