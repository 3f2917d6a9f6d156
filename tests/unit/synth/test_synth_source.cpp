// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "plumbline/sensor/depth_noise.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {
namespace {

const std::string kScenes = std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes";

/// A box of a room 4 m wide, looked along +y at a wall 2 m away.
const char* const kCell = R"(
objects:
  - floor: {from: [-2, -3], to: [2, 2.1], material: lino}
  - ceiling: {from: [-2, -3], to: [2, 2.1], height: 2.5, material: paint_white}
  - wall: {name: front, from: [-2, 2.05], to: [2, 2.05], thickness: 0.1, material: poster_wall}
  - wall: {name: left, from: [-2, -3], to: [-2, 2]}
  - wall: {name: right, from: [2, 2], to: [2, -3]}
  - wall: {name: back, from: [2, -3], to: [-2, -3]}
  - lamp: {at: [0, 0, 2.5], power: 2}
robots:
  - path: [{at: [0, 0, 1.2], look: [0, 9, 1.2]}, {at: [0.3, 0, 1.2], look: [0.3, 9, 1.2]}]
)";

std::shared_ptr<const World> world_of(const std::string& yaml, const SynthOptions& options, int threads = 1) {
  const auto scene = parse_scene(yaml, "test.yaml");
  if (!scene) throw std::runtime_error(scene.error().message);
  const core::Executor executor(threads);
  auto world = build_world(*scene, options, executor);
  if (!world) throw std::runtime_error(world.error().message);
  return *world;
}

std::unique_ptr<SynthSource> source_of(const std::string& yaml, const SynthOptions& options,
                                       int threads = 1) {
  auto source = SynthSource::create(world_of(yaml, options, threads), 0);
  if (!source) throw std::runtime_error(source.error().message);
  return std::move(*source);
}

SynthOptions small(Sensor sensor, int frames) {
  SynthOptions options;
  options.sensor = sensor;
  options.frames = frames;
  options.width = 320;
  options.height = 240;
  return options;
}

std::string why_not(const std::string& yaml, const SynthOptions& options) {
  const auto scene = parse_scene(yaml, "test.yaml");
  if (!scene) throw std::runtime_error(scene.error().message);
  const core::Executor executor(1);
  const auto world = build_world(*scene, options, executor);
  return world ? "" : world.error().message;
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

TEST(SynthSource, DepthComesLaterThanItsStampWhereThatIsAsked) {
  SynthOptions late = small(Sensor::kKinect, 3);
  late.depth_delay_s = 0.02;
  const auto source = source_of(kCell, late);
  const auto prompt = source_of(kCell, small(Sensor::kKinect, 3));
  EXPECT_EQ(source->camera().depth_delay_s, 0.02);
  for (std::size_t i = 0; i < source->size(); ++i) {
    EXPECT_EQ(source->info(i).stamp, prompt->info(i).stamp);
    EXPECT_NEAR(source->info(i).depth_stamp, prompt->info(i).depth_stamp + 0.02, 1.5e-6);
    EXPECT_EQ(source->read(i)->depth_stamp, source->info(i).depth_stamp);
    const Eigen::Vector3d there = source->world_from_camera(source->info(i).depth_stamp).translation;
    EXPECT_EQ(source->exact(i).world_from_depth.translation, there);
  }
}

TEST(SynthSource, IdealDepthIsTheTrueSurface) {
  const auto source = source_of(kCell, small(Sensor::kIdeal, 5));
  for (std::size_t i = 0; i < source->size(); ++i) {
    const auto frame = source->read(i);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->stamp, frame->depth_stamp);
    const geometry::Rigid3 pose = source->world_from_camera(frame->depth_stamp);
    int wall = 0;
    for (int y = 0; y < 240; y += 7) {
      for (int x = 0; x < 320; x += 7) {
        const float z = frame->depth.at<float>(y, x);
        ASSERT_GT(z, 0.0F);
        const Eigen::Vector3d p = pose * source->camera().color.unproject(x, y, static_cast<double>(z));
        // Every point lies on the front wall, the floor, the ceiling or a side wall.
        const double off =
            std::min({std::abs(p.y() - 2.0), std::abs(p.z()), std::abs(p.z() - 2.5),
                      std::abs(std::abs(p.x()) - 1.94), std::abs(p.z() - 2.45), std::abs(p.z() - 2.44)});
        EXPECT_LT(off, 2e-4) << p.transpose();
        wall += std::abs(p.y() - 2.0) < 2e-4 ? 1 : 0;
      }
    }
    EXPECT_GT(wall, 800);
  }
}

TEST(SynthSource, ColourFollowsTheTruePoses) {
  // A point of the wall seen in two frames has the same colour where its true projections say it is.
  auto options = small(Sensor::kIdeal, 12);
  options.motion = Motion::kWheeled;
  const auto source = source_of(kCell, options);
  const auto a = source->read(0), b = source->read(11);
  ASSERT_TRUE(a && b);
  const auto pa = source->world_from_camera(a->stamp),
             b_from_world = source->world_from_camera(b->stamp).inverse();
  ASSERT_GT((pa.translation - b_from_world.inverse().translation).norm(), 0.03);
  cv::Mat map_x(240, 320, CV_32F), map_y(240, 320, CV_32F);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      const Eigen::Vector3d p =
          pa * source->camera().color.unproject(x, y, static_cast<double>(a->depth.at<float>(y, x)));
      const Eigen::Vector2d q = source->camera().color.project(b_from_world * p);
      map_x.at<float>(y, x) = static_cast<float>(q.x());
      map_y.at<float>(y, x) = static_cast<float>(q.y());
    }
  }
  cv::Mat warped, right, wrong;
  cv::remap(b->gray, warped, map_x, map_y, cv::INTER_LINEAR);
  const cv::Rect middle(60, 60, 200, 120);
  cv::absdiff(warped(middle), a->gray(middle), right);
  cv::absdiff(b->gray(middle), a->gray(middle), wrong);
  EXPECT_LT(cv::mean(right)[0], 0.35 * cv::mean(wrong)[0]);
}

TEST(SynthSource, SameBytesForAnyThreadsAndOrder) {
  for (const Sensor sensor : {Sensor::kKinect, Sensor::kRealsense}) {
    const auto one = source_of(kCell, small(sensor, 8), 1), two = source_of(kCell, small(sensor, 8), 2);
    std::vector<sensor::RgbdFrame> parallel(8);
    const core::Executor executor(2);
    executor.parallel_for(8, [&](std::size_t i) { parallel[7 - i] = *two->read(7 - i); });
    for (std::size_t i = 0; i < 8; ++i) {
      const auto frame = one->read(i);
      ASSERT_TRUE(frame);
      EXPECT_TRUE(same(frame->color, parallel[i].color)) << i;
      EXPECT_TRUE(same(frame->depth, parallel[i].depth)) << i;
      EXPECT_EQ(frame->stamp, parallel[i].stamp);
      EXPECT_EQ(frame->depth_stamp, parallel[i].depth_stamp);
    }
  }
}

TEST(SynthSource, AnotherSeedIsAnotherRecording) {
  auto options = small(Sensor::kKinect, 3);
  const auto a = source_of(kCell, options);
  options.seed = 2;
  const auto b = source_of(kCell, options);
  EXPECT_FALSE(same(a->read(1)->color, b->read(1)->color));
  EXPECT_FALSE(same(a->read(1)->depth, b->read(1)->depth));
}

TEST(SynthSource, KinectNoiseFollowsTheFormula) {
  const auto source = source_of(kCell, small(Sensor::kKinect, 6));
  double squares = 0.0, model = 0.0;
  int count = 0, missing = 0, all = 0;
  for (std::size_t i = 0; i < source->size(); ++i) {
    const auto frame = source->read(i);
    const ExactFrame exact = source->exact(i);
    for (int y = 80; y < 160; ++y) {
      for (int x = 100; x < 220; ++x) {
        const auto z = static_cast<double>(frame->depth.at<float>(y, x));
        const auto truth = static_cast<double>(exact.depth.at<float>(y, x));
        ++all;
        if (z == 0.0) {
          ++missing;
          continue;
        }
        squares += (z - truth) * (z - truth);
        model += sensor::depth_sigma(truth) * sensor::depth_sigma(truth);
        ++count;
      }
    }
  }
  ASSERT_GT(count, 10000);
  EXPECT_LT(missing, all / 20);
  EXPECT_NEAR(std::sqrt(squares / model), 1.0, 0.25);
}

TEST(SynthSource, StampsRunAtThirtyHertzWithJitterAndOffset) {
  const auto source = source_of(kCell, small(Sensor::kKinect, 100));
  double jitter = 0.0;
  for (std::size_t i = 1; i < 100; ++i) {
    const double step = source->info(i).stamp - source->info(i - 1).stamp;
    EXPECT_GT(step, 0.028);
    EXPECT_LT(step, 0.039);
    jitter = std::max(jitter, std::abs(step - 1.0 / 30.0));
    const double apart = std::abs(source->info(i).depth_stamp - source->info(i).stamp);
    EXPECT_GT(apart, 0.001);
    EXPECT_LT(apart, 0.008);
  }
  EXPECT_GT(jitter, 0.0003);
}

TEST(SynthSource, MotionIsSmooth) {
  // C2: the third difference of the position goes to zero with the cube of the step, also across knots.
  for (const Motion motion : {Motion::kHandheld, Motion::kWheeled}) {
    auto options = small(Sensor::kIdeal, 200);
    options.motion = motion;
    const auto source = source_of(kCell, options);
    const double t0 = source->info(0).stamp, h = 0.002;
    for (double t = t0 + 0.1; t < t0 + 4.0; t += 0.011) {
      const Eigen::Vector3d a = source->world_from_camera(t).translation,
                            b = source->world_from_camera(t + h).translation,
                            c = source->world_from_camera(t + 2 * h).translation,
                            d = source->world_from_camera(t + 3 * h).translation;
      EXPECT_LT((d - 3.0 * c + 3.0 * b - a).norm(), 200.0 * h * h * h);
      const auto ra = source->world_from_camera(t), rb = source->world_from_camera(t + h),
                 rc = source->world_from_camera(t + 2 * h);
      const Eigen::Vector3d w1 = geometry::log_so3(ra.rotation.transpose() * rb.rotation);
      const Eigen::Vector3d w2 = geometry::log_so3(rb.rotation.transpose() * rc.rotation);
      EXPECT_LT((w2 - w1).norm(), 20.0 * h * h);
      EXPECT_NEAR((ra.rotation * ra.rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 0.0, 1e-9);
      EXPECT_NEAR(ra.rotation.determinant(), 1.0, 1e-9);
    }
  }
}

TEST(SynthSource, HardMomentsHappen) {
  auto options = small(Sensor::kKinect, 150);
  options.events =
      "whiteout@0.5+0.2,lampoff@1+0.2,cover@1.5+0.2,nodepth@2+0.2,drop@2.5+0.5,blur@3.5+0.2*12,spin@4+0.8";
  const auto source = source_of(kCell, options);
  EXPECT_EQ(source->size(), 135U);
  const auto at = [&](double t) {
    std::size_t i = 0;
    while (source->info(i).stamp - source->info(0).stamp < t) ++i;
    return i;
  };
  const double plain = cv::mean(source->read(3)->gray)[0];
  EXPECT_GT(cv::mean(source->read(at(0.6))->gray)[0], 240.0);
  EXPECT_LT(cv::mean(source->read(at(1.1))->gray)[0], 0.3 * plain);
  EXPECT_LT(cv::mean(source->read(at(1.6))->gray)[0], 8.0);
  EXPECT_EQ(cv::countNonZero(source->read(at(1.6))->depth), 0);
  EXPECT_EQ(cv::countNonZero(source->read(at(2.1))->depth), 0);
  EXPECT_NEAR(cv::mean(source->read(at(2.1))->gray)[0], plain, 0.5 * plain);
  const auto sharpness = [&](double t) {
    cv::Mat laplacian;
    cv::Laplacian(source->read(at(t))->gray, laplacian, CV_32F);
    return cv::norm(laplacian);
  };
  EXPECT_LT(sharpness(3.6), 0.7 * sharpness(3.4));
  // The spin turns on the spot, once round.
  const double t0 = source->info(0).stamp;
  double turned = 0.0;
  for (double t = 4.0; t < 4.79; t += 0.01) {
    const auto a = source->world_from_camera(t0 + t), b = source->world_from_camera(t0 + t + 0.01);
    EXPECT_LT((a.translation - b.translation).norm(), 1e-4);
    turned += geometry::rotation_angle(a.rotation.transpose() * b.rotation);
  }
  EXPECT_NEAR(turned, 2.0 * M_PI, 0.3);
}

TEST(SynthSource, PathThroughAWallIsRefused) {
  std::string yaml = kCell;
  const std::string from = "{at: [0.3, 0, 1.2], look: [0.3, 9, 1.2]}";
  yaml.replace(yaml.find(from), from.size(), "{at: [0, 3, 1.2], look: [0, 9, 1.2]}");
  const std::string what = why_not(yaml, small(Sensor::kIdeal, -1));
  EXPECT_NE(what.find("goes through front"), std::string::npos) << what;
  EXPECT_NE(what.find("between waypoints 0 and 1"), std::string::npos) << what;
  EXPECT_NE(what.find("test.yaml:11"), std::string::npos) << what;
  yaml += "  - path: [[0, 0, 1], [1, 0, 1]]\n";
  const std::string solid = "robots:";
  yaml.replace(yaml.find(solid), solid.size(),
               "  - box: {name: block, at: [0, 0, 0.5], size: [1, 1, 1.5]}\nrobots:");
  EXPECT_NE(why_not(yaml, small(Sensor::kIdeal, 5)).find("inside block"), std::string::npos);
}

TEST(SynthSource, EveryShippedPathIsFree) {
  for (const std::string& name : core::yaml_names(kScenes)) {
    const auto scene = load_scene(name, kScenes);
    ASSERT_TRUE(scene) << scene.error().message;
    SynthOptions options;
    options.robots = static_cast<int>(scene->robots.size());
    for (const Motion motion : {Motion::kHandheld, Motion::kWheeled}) {
      options.motion = motion;
      for (options.seed = 1; options.seed <= 3; ++options.seed) {
        const auto free = check_paths(*scene, options);
        EXPECT_TRUE(free) << free.error().message;
      }
    }
  }
}

TEST(SynthSource, WithoutTextureNothingButShadingIsLeft) {
  auto options = small(Sensor::kIdeal, 2);
  const auto edges = [&](Texture texture) {
    options.texture = texture;
    cv::Mat laplacian;
    cv::Laplacian(source_of(kCell, options)->read(0)->gray, laplacian, CV_32F);
    return cv::norm(laplacian);
  };
  const double full = edges(Texture::kFull), weak = edges(Texture::kWeak), none = edges(Texture::kNone);
  EXPECT_LT(weak, 0.5 * full);
  EXPECT_LT(none, 0.3 * full);
}

TEST(SynthUrl, SaysWhichOfSeveralRobotsItIs) {
  struct Warnings : core::Log {
    std::string text;
    void write(core::LogLevel level, const std::string& message) override {
      if (level >= core::LogLevel::kWarning) text += message;
    }
  } log;
  const std::string url = "synth:structure?frames=4&robots=2&width=160&height=120";
  ASSERT_TRUE(open_synth(url + "&robot=0", kScenes, core::Executor(1), log));
  EXPECT_EQ(log.text, "");
  ASSERT_TRUE(open_synth(url, kScenes, core::Executor(1), log));
  EXPECT_NE(log.text.find("robot 0 of 2; add &robot=1 for another"), std::string::npos);
}

TEST(SynthUrl, OpensAndRefuses) {
  const core::Executor executor(2);
  const auto log = core::null_log();
  const auto source =
      open_synth("synth:structure?frames=4&texture=none&seed=3&robots=2&robot=1&width=160&height=120",
                 kScenes, executor, *log);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->size(), 4U);
  EXPECT_EQ((*source)->format(), "synth");
  EXPECT_EQ((*source)->name(), "structure-robot1");
  ASSERT_TRUE((*source)->truth());
  EXPECT_EQ((*source)->truth()->size(), 4U);
  EXPECT_FALSE((*source)->read(4));
  const auto why = [&](const std::string& url) {
    const auto opened = open_synth(url, kScenes, executor, *log);
    return opened ? "" : opened.error().message;
  };
  EXPECT_NE(why("synth:structur").find("did you mean structure"), std::string::npos);
  EXPECT_NE(why("synth:structure?texure=none").find("texture"), std::string::npos);
  EXPECT_NE(why("synth:structure?frames=0").find("zero frames"), std::string::npos);
  EXPECT_NE(why("synth:structure?frames"), "");
  EXPECT_NE(why("synth:structure?sensor=lidar").find("kinect"), std::string::npos);
  EXPECT_NE(why("synth:"), "");
  EXPECT_NE(why("tum:room"), "");
}

}  // namespace
}  // namespace plumbline::synth
