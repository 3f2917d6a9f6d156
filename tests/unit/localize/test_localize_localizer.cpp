// SPDX-License-Identifier: BSD-3-Clause
// A camera is located in a map of a filmed room with known truth, and nowhere else.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/localize/localizer.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::localize {
namespace {

struct Shot {
  sensor::RgbdFrame frame;
  std::shared_ptr<const features::FrameFeatures> features;
  geometry::Rigid3 world_from_camera;  ///< truth
};

struct Film {
  std::vector<Shot> shots;
  sensor::Camera camera;
};

Film film(const std::string& world) {
  const core::Executor executor(2);
  const auto log = core::null_log();
  const std::string scenes = std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes";
  const auto source = synth::open_synth("synth:" + world, scenes, executor, *log);
  if (!source) throw std::runtime_error(source.error().message);
  Film result;
  result.camera = (*source)->camera();
  const auto truth = (*source)->truth().value();
  const features::FeatureExtractor extractor({}, result.camera.color);
  result.shots.resize((*source)->size());
  executor.parallel_for(result.shots.size(), [&](std::size_t i) {
    Shot& shot = result.shots[i];
    shot.frame = (*source)->read(i).value();
    shot.features = std::make_shared<features::FrameFeatures>(extractor.extract(shot.frame));
    shot.world_from_camera = truth.at(i).world_from_camera;
  });
  return result;
}

/// The room, filmed once; its first 30 of 48 frames are mapped.
class Room {
 public:
  static const Room& get() {
    static const Room kRoom;
    return kRoom;
  }
  Film film;
  LocalizationMap map;

 private:
  Room() : film(localize::film("room?frames=48&fps=15&seed=2")) {
    constexpr std::size_t kMapped = 30;
    const core::Executor executor(1);
    const auto log = core::null_log();
    mapping::Slam slam({}, film.camera.color, 0, executor, *log);
    for (std::size_t i = 0; i < kMapped; ++i) slam.process(film.shots[i].frame, film.shots[i].features);
    slam.finish();
    map.map = slam.map();
    map.robots = {{0, "first", film.camera}};
    map.output_from_map = film.shots[0].world_from_camera;
  }
};

/// These shots one after another, 15 a second.
std::vector<LocatedFrame> locate(const std::vector<Shot>& shots, const sensor::Camera& camera) {
  Localizer localizer(Room::get().map, camera, {});
  std::vector<LocatedFrame> all;
  const auto add = [&](std::vector<LocatedFrame> some) { all.insert(all.end(), some.begin(), some.end()); };
  for (std::size_t i = 0; i < shots.size(); ++i) {
    sensor::RgbdFrame frame = shots[i].frame;
    frame.stamp = frame.depth_stamp = static_cast<double>(i) / 15.0;
    add(localizer.process(i, frame, shots[i].features));
  }
  add(localizer.finish());
  return all;
}

std::size_t located(const std::vector<LocatedFrame>& frames) {
  return static_cast<std::size_t>(
      std::count_if(frames.begin(), frames.end(), [](const LocatedFrame& f) { return f.located; }));
}

/// Each frame once and in order; those that are located lie where the truth says, the others say why not.
void expect_right(const std::vector<LocatedFrame>& frames, const std::vector<Shot>& shots) {
  ASSERT_EQ(frames.size(), shots.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].number, i);
    EXPECT_EQ(frames[i].located, frames[i].reason.empty()) << i;
    if (!frames[i].located) continue;
    const geometry::Rigid3 off = shots[i].world_from_camera.inverse() * frames[i].map_from_camera;
    EXPECT_LT(off.translation.norm(), 0.03) << i;
    EXPECT_LT(geometry::rotation_angle(off.rotation), 0.02) << i;
    EXPECT_LT(off.translation.norm(), 5.0 * frames[i].sigma_position_m) << i;
    EXPECT_FALSE(frames[i].how.empty());
  }
}

TEST(Localizer, FramesThatWereNotMappedAreFoundAndTracked) {
  const Film& film = Room::get().film;
  const std::vector<Shot> shots(film.shots.begin() + 20, film.shots.end());
  const auto frames = locate(shots, film.camera);
  expect_right(frames, shots);
  EXPECT_GE(located(frames), 26U);
  EXPECT_EQ(std::count_if(frames.begin(), frames.end(), [](const auto& f) { return f.how == "place"; }), 1);
}

TEST(Localizer, AKidnappedCameraIsFoundAgain) {
  const Film& film = Room::get().film;
  std::vector<Shot> shots(film.shots.begin(), film.shots.begin() + 9);
  shots.insert(shots.end(), film.shots.begin() + 27, film.shots.begin() + 39);
  const auto frames = locate(shots, film.camera);
  expect_right(frames, shots);
  EXPECT_GE(located(frames), 18U);
}

TEST(Localizer, ADarkFrameHasNoPoseAndAReason) {
  const Film& film = Room::get().film;
  std::vector<Shot> shots(film.shots.begin() + 10, film.shots.begin() + 30);
  Shot& dark = shots[10];
  dark.frame.color.setTo(0);
  dark.frame.gray = cv::Mat::zeros(dark.frame.gray.size(), dark.frame.gray.type());
  dark.frame.depth = cv::Mat::zeros(dark.frame.depth.size(), dark.frame.depth.type());
  dark.features = std::make_shared<features::FrameFeatures>(
      features::FeatureExtractor({}, film.camera.color).extract(dark.frame));
  const auto frames = locate(shots, film.camera);
  expect_right(frames, shots);
  EXPECT_FALSE(frames.at(10).located);
  EXPECT_TRUE(frames.at(11).located);
  EXPECT_EQ(located(frames), 19U);
}

TEST(Localizer, AnotherRoomIsNowhere) {
  const Film other = film("office?frames=20&fps=15&seed=5");
  const auto frames = locate(other.shots, other.camera);
  EXPECT_EQ(frames.size(), 20U);
  EXPECT_EQ(located(frames), 0U);
}

TEST(Localizer, ACameraOfAnotherFocalLengthIsLocated) {
  const Film other = film("room?frames=30&fps=15&seed=2&width=480&height=360");
  const auto frames = locate(other.shots, other.camera);
  expect_right(frames, other.shots);
  EXPECT_GE(located(frames), 24U);
}

TEST(Localizer, AnUnconfirmedPlaceIsNotTold) {
  const Film& film = Room::get().film;
  const std::vector<Shot> shots(film.shots.begin() + 20, film.shots.begin() + 23);
  const auto frames = locate(shots, film.camera);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(located(frames), 0U);
  EXPECT_NE(frames.back().reason.find("confirmed"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::localize
