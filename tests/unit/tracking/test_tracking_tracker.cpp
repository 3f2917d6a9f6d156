// SPDX-License-Identifier: BSD-3-Clause
// The tracker against small maps made of one look each: what each family does alone, and how a lost camera is
// found again.
#include <gtest/gtest.h>

#include "plumbline/tracking/surface_sampler.hpp"
#include "plumbline/tracking/tracker.hpp"
#include "tracking_world.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;
using tests::kTestCamera;

/// A poster on the wall z = 2 of a frame of its own, and whether anything measures its depth.
struct Look {
  sensor::RgbdFrame frame;
  features::FrameFeatures features;
};
Look look_at(const cv::Mat& poster, const Rigid3& camera_from_wall, bool depth = true) {
  Look result;
  result.frame.gray = tests::render_wall(poster, 300.0, 2.0, camera_from_wall);
  result.frame.depth = tests::render_depth({{{0.0, 0.0, 2.0}, {0.0, 0.0, -1.0}, 0.0}}, camera_from_wall);
  if (!depth) result.frame.depth.setTo(0.0F);
  result.features = features::FeatureExtractor({}, kTestCamera).extract(result.frame);
  return result;
}

/// Large dark rectangles: lines, and a picture that is known again at a glance.
cv::Mat blocks(std::uint32_t seed) {
  cv::Mat image(1200, 1200, CV_8UC1, cv::Scalar(190));
  tests::Random random(seed);
  for (int i = 0; i < 60; ++i) {
    const cv::Point a(random.integer(0, 1100), random.integer(0, 1100));
    const cv::Point size(random.integer(60, 220), random.integer(60, 220));
    cv::rectangle(image, a, a + size, cv::Scalar(random.integer(20, 230)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, {5, 5}, 1.0);
  return image;
}

core::KeyframeId add_keyframe(maps::Map& map, const Look& seen, const Rigid3& pose) {
  auto keyframe = std::make_shared<maps::Keyframe>();
  const auto features = std::make_shared<features::FrameFeatures>(seen.features);
  keyframe->id = map.next_keyframe_id(0);
  keyframe->features = features;
  keyframe->surface = sample_surface(seen.frame.depth, kTestCamera, {});
  const core::KeyframeId id = map.add_keyframe(keyframe, pose);
  const Rigid3 world_from_camera = pose.inverse();
  for (std::size_t i = 0; i < features->points.size(); ++i) {
    const features::PointFeature& f = features->points[i];
    if (!(f.depth > 0.0F)) continue;
    maps::MapPoint point;
    const Eigen::Vector3d p = kTestCamera.unproject(
        static_cast<double>(f.pixel.x()), static_cast<double>(f.pixel.y()), static_cast<double>(f.depth));
    point.position = world_from_camera * p;
    point.descriptor = features->descriptors[i];
    point.angle = f.angle;
    point.angle_keyframe = id;
    point.view_direction = (point.position - world_from_camera.translation).normalized();
    point.reference_distance = p.norm();
    point.reference_octave = f.octave;
    map.observe(map.add_point(0, point), id, static_cast<int>(i));
  }
  for (std::size_t i = 0; i < features->lines.size(); ++i) {
    const features::LineFeature& f = features->lines[i];
    if (!f.line3) continue;
    maps::MapLine line;
    line.start = world_from_camera * f.line3->start;
    line.end = world_from_camera * f.line3->end;
    line.descriptor = f.descriptor;
    map.observe(map.add_line(0, line), id, static_cast<int>(i));
  }
  return id;
}

TrackerOptions only(bool points, bool lines, bool depth) {
  TrackerOptions options;
  options.points = points;
  options.lines = lines;
  options.depth = depth;
  return options;
}

/// Believes every place, or none.
class Judge : public Relocaliser {
 public:
  explicit Judge(bool believes) : believes_(believes) {}
  [[nodiscard]] std::vector<core::KeyframeId> look_alikes(
      const maps::Map& /*map*/, const features::FrameFeatures& /*image*/) const override {
    return {};
  }
  [[nodiscard]] bool is_place(const maps::Map& /*map*/, const LostCamera& /*lost*/,
                              const FoundFrame& found) const override {
    asked.emplace_back(found.keyframe, found.camera_from_world);
    return believes_;
  }
  mutable std::vector<std::pair<core::KeyframeId, Rigid3>> asked;

 private:
  bool believes_;
};

/// Two places in one map; the camera was last seen at the first.
class TwoPlaces : public testing::Test {
 protected:
  TwoPlaces() {
    here_ = add_keyframe(map_, look_at(first_, {}), {});
    there_ = add_keyframe(map_, look_at(second_, {}), away_);
  }
  TrackResult track(const TrackerOptions& options, const Look& seen) {
    Surroundings around{build_local_map(map_, here_, options.local_map), {}};
    return Tracker(options, kTestCamera)
        .track(map_, around, seen.frame, std::make_shared<features::FrameFeatures>(seen.features));
  }

  cv::Mat first_ = blocks(4);
  cv::Mat second_ = blocks(9);
  Rigid3 away_{geometry::exp_so3({0.0, 1.5, 0.0}), {4.0, 0.0, 3.0}};  ///< wall of the second from world
  maps::Map map_;
  core::KeyframeId here_;
  core::KeyframeId there_;
};

TEST_F(TwoPlaces, LinesOfWhichTheFrameHasNoDepthAreTracked) {
  const Rigid3 truth(geometry::exp_so3({0.01, -0.02, 0.01}), {0.02, 0.01, -0.03});
  const Look blind = look_at(first_, truth, false);
  for (const features::LineFeature& line : blind.features.lines) ASSERT_FALSE(line.line3);
  const TrackResult result = track(only(false, true, false), blind);
  EXPECT_EQ(result.state, TrackState::kTracked);
  EXPECT_GE(result.estimate.lines.inliers, 15);
  EXPECT_TRUE(result.points.empty());
  EXPECT_LT(tests::distance(result.camera_from_world, truth), 0.004);
  EXPECT_LT(tests::angle(result.camera_from_world, truth), 0.002);
}

TEST_F(TwoPlaces, EachFamilyIsLeftOutWhenItIsOff) {
  const Rigid3 truth(geometry::exp_so3({0.0, 0.01, 0.0}), {0.01, 0.0, 0.0});
  const Look seen = look_at(first_, truth);
  const TrackResult points = track(only(true, false, false), seen);
  EXPECT_GT(points.estimate.points.inliers, 0);
  EXPECT_EQ(points.estimate.lines.terms + points.estimate.planes.terms, 0);
  const TrackResult depth = track(only(true, false, true), seen);
  EXPECT_GT(depth.estimate.planes.inliers, 0);
  EXPECT_EQ(depth.estimate.lines.terms, 0);
  EXPECT_NE(track(only(false, false, true), seen).state, TrackState::kTracked)
      << "a flat wall alone holds three directions of six";
}

TEST_F(TwoPlaces, FoundAgainByLandmarksOrByTheWholePicture) {
  const Rigid3 moved(geometry::exp_so3({0.01, 0.02, 0.01}), {0.02, 0.01, 0.02});
  const Look seen = look_at(second_, moved);
  for (const bool points : {true, false}) {
    const TrackResult result = track(only(points, true, true), seen);
    EXPECT_EQ(result.state, TrackState::kTracked) << points;
    EXPECT_TRUE(result.relocalised) << points;
    EXPECT_EQ(result.points.empty(), !points);
    EXPECT_LT(tests::distance(result.camera_from_world, moved * away_), 0.005) << points;
  }
}

TEST_F(TwoPlaces, APlaceThatTheJudgeRefusesIsNotTaken) {
  const Rigid3 moved(geometry::exp_so3({0.01, 0.02, 0.01}), {0.02, 0.01, 0.02});
  const Look seen = look_at(second_, moved);
  for (const bool believed : {true, false}) {
    const Judge judge(believed);
    Surroundings around{build_local_map(map_, here_, {}), {}};
    const TrackResult result = Tracker(only(true, true, true), kTestCamera)
                                   .track(map_, around, seen.frame,
                                          std::make_shared<features::FrameFeatures>(seen.features), &judge);
    ASSERT_FALSE(judge.asked.empty());
    for (const auto& [keyframe, pose] : judge.asked) {
      EXPECT_EQ(keyframe, there_);
      EXPECT_LT(tests::distance(pose, moved * away_), 0.005);
    }
    EXPECT_EQ(result.state, believed ? TrackState::kTracked : TrackState::kLost);
    EXPECT_EQ(around.local_map.reference, believed ? there_ : here_);
  }
}

TEST_F(TwoPlaces, PointsAreNotAskedWhenTheyAreOff) {
  // Without lines and points only depth could confirm the place, and a flat wall does not.
  const Look seen = look_at(second_, {});
  EXPECT_NE(track(only(false, false, true), seen).state, TrackState::kTracked);
  EXPECT_EQ(track(only(true, false, true), seen).state, TrackState::kTracked);
}

TEST_F(TwoPlaces, AForeignOrEmptyPictureIsNotFound) {
  // The wall is where it should be, and a few lines fit by chance: they are not to hold what it leaves free.
  for (const std::uint32_t seed : {77U, 78U, 79U, 80U, 81U}) {
    EXPECT_NE(track({}, look_at(blocks(seed), {})).state, TrackState::kTracked) << seed;
  }
  EXPECT_NE(track({}, look_at(cv::Mat(1200, 1200, CV_8UC1, cv::Scalar(255)), {}, false)).state,
            TrackState::kTracked);
}

TEST_F(TwoPlaces, WhatLooksAlikeComesFirst) {
  const Look seen = look_at(second_, {});
  const auto alike = look_alikes(map_, {here_, there_}, seen.features, 5);
  ASSERT_FALSE(alike.empty());
  EXPECT_EQ(alike[0].keyframe, there_);
  EXPECT_GT(alike[0].correlation, 0.95);
  EXPECT_TRUE(look_alikes(map_, {here_, there_}, seen.features, 0).empty());
  EXPECT_TRUE(look_alikes(map_, {}, seen.features, 5).empty());
  EXPECT_TRUE(look_alikes(map_, {here_, there_}, {}, 5).empty());
  const Look white = look_at(cv::Mat(1200, 1200, CV_8UC1, cv::Scalar(255)), {});
  EXPECT_TRUE(look_alikes(map_, {here_, there_}, white.features, 5).empty());
}

TEST_F(TwoPlaces, ALookAlikeIsAlignedFromAShortWayOff) {
  const Rigid3 moved(geometry::exp_so3({0.02, -0.03, 0.0}), {0.03, 0.0, 0.02});
  const Rigid3 pose = align_look_alike(map_, there_, look_at(second_, moved).features, kTestCamera);
  EXPECT_LT(tests::distance(pose, moved * away_), 0.03);
  EXPECT_LT(tests::angle(pose, moved * away_), 0.015);
}

/// A camera that stands before a bare wall but is thought to fall by 0.15 m/s: where it is thought to be
/// after 20 frames, metres. `others`: what else is in view.
double fallen(const std::vector<tests::WorldPlane>& others) {
  std::vector<tests::WorldPlane> planes{{{0.2, 0.0, 0.8}, {0.0, 0.0, -1.0}, 0.55}};
  planes.insert(planes.end(), others.begin(), others.end());
  Look seen;
  seen.frame.depth = tests::render_depth(planes, {});
  seen.frame.gray = cv::Mat(480, 640, CV_8UC1, cv::Scalar(150));
  maps::Map map;
  const core::KeyframeId id = add_keyframe(map, seen, {});
  Tracker tracker({}, kTestCamera);
  geometry::Vector6d velocity = geometry::Vector6d::Zero();
  velocity(1) = -0.15;
  tracker.restore(map.keyframe(id), {}, velocity);
  Surroundings around{build_local_map(map, id, {}), {}};
  double y = 0.0;
  for (int i = 1; i <= 20; ++i) {
    seen.frame.stamp = seen.frame.depth_stamp = i / 30.0;
    const TrackResult result =
        tracker.track(map, around, seen.frame, std::make_shared<features::FrameFeatures>(seen.features));
    EXPECT_EQ(result.state, TrackState::kTracked) << i;
    y = result.camera_from_world.inverse().translation.y();
  }
  return y;
}

TEST(BareWall, TheMotionModelIsBelievedUntilSomethingSpeaksAgainstIt) {
  EXPECT_NEAR(fallen({}), 0.1, 0.02);  // nothing can tell
  // Two sloping surfaces, far and small: their normals weigh nothing beside those of the wall, but they are
  // right.
  EXPECT_NEAR(
      fallen({{{-1.77, -0.75, 3.4}, {0.0, -0.8, -0.6}, 0.8}, {{-1.77, 0.75, 3.4}, {0.8, 0.0, -0.6}, 0.8}}),
      0.0, 0.01);
}

}  // namespace
}  // namespace plumbline::tracking
