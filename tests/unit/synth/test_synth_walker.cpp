// SPDX-License-Identifier: BSD-3-Clause
// Walkers are filmed at the right place and time, and are no part of the truth.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <sstream>
#include <stdexcept>

#include "plumbline/synth/layout.hpp"
#include "plumbline/synth/recording.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {
namespace {

/// A room looked along +y; someone walks across at y = 1.5, 1 m to and fro.
const char* const kWalkedCell = R"(
objects:
  - floor: {from: [-2, -3], to: [2, 2.1], material: lino}
  - wall: {name: front, from: [-2, 2.05], to: [2, 2.05], thickness: 0.1, material: poster_wall}
  - box: {name: crate, at: [0.6, 1.0, 0], size: [0.3, 0.2, 1.0]}
  - lamp: {at: [0, 0, 2.5], power: 2}
robots:
  - path: [{at: [0, -1, 1.2], look: [0, 9, 1.2]}, {at: [0.3, -1, 1.2], look: [0.3, 9, 1.2]}]
walkers:
  - {from: [-0.5, 1.5], to: [0.5, 1.5], speed: 0.5}
)";

SynthOptions small(int walkers, int frames) {
  SynthOptions options;
  options.sensor = Sensor::kIdeal;
  options.frames = frames;
  options.width = 320;
  options.height = 240;
  options.fps = 4.0;
  options.walkers = walkers;
  return options;
}

core::Result<std::shared_ptr<const World>> walked_world(const std::string& yaml,
                                                        const SynthOptions& options) {
  const auto scene = parse_scene(yaml, "test.yaml");
  if (!scene) return tl::unexpected<core::Error>(scene.error());
  const core::Executor executor(2);
  return build_world(*scene, options, executor);
}

std::unique_ptr<SynthSource> source_of(const SynthOptions& options) {
  auto world = walked_world(kWalkedCell, options);
  if (!world) throw std::runtime_error(world.error().message);
  auto source = SynthSource::create(*world, 0);
  if (!source) throw std::runtime_error(source.error().message);
  return std::move(*source);
}

TEST(Walker, GoesToAndFro) {
  Walker walker;
  walker.from = {1, 2, 0};
  walker.to = {3, 2, 0};
  walker.speed = 0.5;
  EXPECT_NEAR(walker.at(0.0).x(), 1.0, 1e-12);
  EXPECT_NEAR(walker.at(2.0).x(), 2.0, 1e-12);
  EXPECT_NEAR(walker.at(5.0).x(), 2.5, 1e-12);  // on the way back
  EXPECT_NEAR(walker.at(8.0).x(), 1.0, 1e-12);
  EXPECT_NEAR(walker.at(-1.0).x(), 1.0, 1e-12);
}

TEST(Walker, IsFilmedWhereItIs) {
  const auto with = source_of(small(1, 8));
  const auto without = source_of(small(0, 8));
  for (std::size_t i = 0; i < with->size(); ++i) {
    const auto a = with->read(i);
    const auto b = without->read(i);
    ASSERT_TRUE(a && b);
    const double t = static_cast<double>(i) / 4.0;
    const double middle = t < 2.0 ? -0.5 + 0.5 * t : 0.5 - 0.5 * (t - 2.0);
    const geometry::Rigid3 pose = with->world_from_camera(a->depth_stamp);
    int nearer = 0;
    for (int y = 0; y < 240; y += 2) {
      for (int x = 0; x < 320; x += 2) {
        const float z = a->depth.at<float>(y, x);
        if (z == b->depth.at<float>(y, x)) continue;
        ++nearer;
        const Eigen::Vector3d p = pose * with->camera().color.unproject(x, y, static_cast<double>(z));
        // On the body or the head, which are 0.3 m deep along the way and 0.5 m across it.
        EXPECT_LE(std::abs(p.x() - middle), 0.151) << i;
        EXPECT_LE(std::abs(p.y() - 1.5), 0.251);
        EXPECT_LE(p.z(), 1.701);
        EXPECT_NE(a->color.at<cv::Vec3b>(y, x), b->color.at<cv::Vec3b>(y, x));
      }
    }
    EXPECT_GT(nearer, 300) << i;
  }
  // The crate stands before the walk: it hides who passes behind it.
  const ExactFrame last = with->exact(4);  // x = 0.5
  EXPECT_EQ(last.depth.size(), cv::Size(320, 240));
  bool crate = false;
  for (int x = 200; x < 260; ++x) crate = crate || last.depth.at<float>(200, x) < 2.0F;
  EXPECT_TRUE(crate);
}

TEST(Walker, IsNoPartOfTheReference) {
  const auto scene = parse_scene(kWalkedCell, "test.yaml");
  ASSERT_TRUE(scene);
  const core::Executor executor(2);
  const core::StopToken stop;
  const auto log = core::null_log();
  std::vector<std::string> references;
  for (const int walkers : {0, 1}) {
    const auto folder = std::filesystem::path(testing::TempDir()) / ("walker" + std::to_string(walkers));
    SynthOptions options = small(walkers, 3);
    options.reference_spacing = 0.05;
    ASSERT_TRUE(write_recordings({*scene, options, folder}, executor, stop, *log, {}));
    std::ostringstream text;
    text << std::ifstream(folder / "reference.ply", std::ios::binary).rdbuf();
    references.push_back(text.str());
  }
  EXPECT_EQ(references[0], references[1]);
}

/// Feet stay where they are unless they are lifted, and bones have their lengths.
TEST(Walker, PeopleStepWithoutSliding) {
  SynthOptions home;
  home.layout = 5;
  auto scene = make_layout("home", home);
  ASSERT_TRUE(scene);
  ASSERT_TRUE(scene->walkers.empty());
  ASSERT_TRUE(add_people(12, 1, *scene));
  ASSERT_EQ(scene->walkers.size(), 12U);
  int sitting = 0;
  double walked = 0.0;
  for (const Walker& person : scene->walkers) {
    ASSERT_GT(person.day.size(), 200U);
    EXPECT_LT((person.day.back().hip - person.day.front().hip).norm(), 1e-9);
    bool sits = false;
    for (std::size_t i = 1; i < person.day.size(); ++i) {
      const FigurePose &before = person.day[i - 1], &now = person.day[i];
      const double pace = (now.hip - before.hip).head<2>().norm() / 0.04;
      EXPECT_LT(pace, 1.3);
      walked += 0.04 * pace;
      sits = sits || now.hip.z() < 0.55;
      for (const int side : {0, 1}) {
        const bool down = before.foot[side].z() < 1e-9 && now.foot[side].z() < 1e-9;
        EXPECT_LT(down ? (now.foot[side] - before.foot[side]).norm() : 0.0, 0.012) << i;
        EXPECT_LT((now.foot[side] - now.hip).norm(), 0.96);
      }
      EXPECT_LT(std::min(now.foot[0].z(), now.foot[1].z()), 0.02) << i;
    }
    sitting += sits ? 1 : 0;
  }
  EXPECT_GT(sitting, 0);
  EXPECT_GT(walked, 100.0);
}

/// The largest share of a picture that people take, over the whole path.
double largest_crowd(const Scene& scene, const SynthOptions& options) {
  const auto world = build_world(scene, options, core::Executor(2));
  if (!world) throw std::runtime_error(world.error().message);
  const auto source = SynthSource::create(*world, 0);
  if (!source) throw std::runtime_error(source.error().message);
  double most = 0.0;
  for (std::size_t i = 0; i < (*source)->size(); ++i) {
    const cv::Mat1i faces = (*source)->exact(i).face;
    most = std::max(most, cv::countNonZero(faces >= static_cast<int>(scene.faces.size())) /
                              static_cast<double>(faces.total()));
  }
  return most;
}

TEST(Walker, ACrowdTakesMostOfThePicture) {
  SynthOptions options = small(12, -1);
  options.width = 64;
  options.height = 48;
  options.fps = 2.0;
  options.layout = 5;
  const auto scene = make_layout("home", options);
  ASSERT_TRUE(scene);
  EXPECT_GT(largest_crowd(*scene, options), 0.6);
}

TEST(Walker, MoreThanTheFloorHasRoomForAndWrongOnesAreRefused) {
  std::string narrow(kWalkedCell);
  narrow.replace(narrow.find("[2, 2.1], material"), 8, "[2, -2.6]");
  const auto many = walked_world(narrow, small(2, 3));
  ASSERT_FALSE(many);
  EXPECT_NE(many.error().message.find("has 1, not 2"), std::string::npos) << many.error().message;
  const std::string start(kWalkedCell);
  const auto still = parse_scene(start + "  - {from: [0, 0], to: [0, 0]}\n", "test.yaml");
  ASSERT_FALSE(still);
  EXPECT_NE(still.error().message.find("walkers[1]: needs from"), std::string::npos) << still.error().message;
  const auto odd = parse_scene(start + "  - {from: [0, 0], to: [1, 0], sped: 2}\n", "test.yaml");
  ASSERT_FALSE(odd);
  EXPECT_NE(odd.error().message.find("did you mean speed"), std::string::npos) << odd.error().message;
}

}  // namespace
}  // namespace plumbline::synth
