// SPDX-License-Identifier: BSD-3-Clause
// Local bundles taken from a map of known truth, adjusted and put back.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>

#include "plumbline/mapping/adjustment/local_bundle.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "random_world.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

const sensor::Pinhole kCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

/// Keyframes side by side that all see the same exact points; keyframe 2 and the points are put askew.
struct SmallMap {
  maps::Map map;
  std::vector<Rigid3> truth;
  std::vector<Eigen::Vector3d> points;
  core::PointId single;  ///< seen by keyframe 2 only

  explicit SmallMap(double turn_rate_of_last = 0.0, double turn_rate_of_first = 0.0) {
    const std::array<double, 3> turn_rates{turn_rate_of_first, 0.0, turn_rate_of_last};
    tests::Random random(3);
    for (int i = 0; i < 60; ++i) {
      points.emplace_back(random.uniform(-0.8, 0.8), random.uniform(-0.6, 0.6), random.uniform(1.5, 3.0));
    }
    for (int k = 0; k < 3; ++k) {
      truth.emplace_back(Eigen::Matrix3d::Identity(), Eigen::Vector3d(-0.1 * k, 0.02 * k, 0.0));
      add_keyframe(k, turn_rates[static_cast<std::size_t>(k)]);
    }
    for (const Eigen::Vector3d& p : points) {
      maps::MapPoint point;
      point.position = p + random.vector(0.01);
      const core::PointId id = map.add_point(0, point);
      for (int k = 0; k < 3; ++k) map.observe(id, {0, k}, id.index);
    }
    maps::MapPoint alone;
    alone.position = truth[2].inverse() * Eigen::Vector3d(0.1, 0.1, 2.0);
    single = map.add_point(0, alone);
    map.observe(single, {0, 2}, static_cast<int>(points.size()));
    Rigid3 askew = random.step(0.02, 0.01) * truth[2];
    map.point(single).position = askew.inverse() * Eigen::Vector3d(0.1, 0.1, 2.0);
    map.set_pose({0, 2}, askew);
  }

  void add_keyframe(int k, double turn_rate) {
    auto features = std::make_shared<features::FrameFeatures>();
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d c = truth.back() * p;
      features::PointFeature f;
      f.pixel = kCamera.project(c).cast<float>();
      f.depth = static_cast<float>(c.z());
      features->points.push_back(f);
    }
    features->points.push_back({kCamera.project({0.1, 0.1, 2.0}).cast<float>(), 2.0F, 0.0F, 0.0F, 0});
    features->descriptors.resize(features->points.size());
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = {0, k};
    keyframe->turn_rate = turn_rate;
    keyframe->features = features;
    map.add_keyframe(keyframe, truth.back());
    map.attach(keyframe->id);
  }
};

TEST(LocalBundle, PutsAKeyframeAndItsLandmarksBackInPlace) {
  SmallMap world;
  ASSERT_GT(tests::distance(world.map.camera_from_world({0, 2}), world.truth[2]), 0.01);
  LocalBundle bundle = take_local_bundle(world.map, {0, 2}, kCamera, {});
  ASSERT_TRUE(optimize::adjust_bundle(bundle.problem, {}).usable);
  put_back(bundle, world.map);
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(tests::distance(world.map.camera_from_world({0, k}), world.truth[static_cast<std::size_t>(k)]),
              1e-3)
        << k;
  }
  for (core::PointId id : world.map.point_ids()) {
    if (id == world.single) continue;
    EXPECT_LT((world.map.point(id).position - world.points[static_cast<std::size_t>(id.index)]).norm(), 2e-3);
  }
}

TEST(LocalBundle, DepthIsBelievedLessThanItsNoiseSays) {
  SmallMap world;
  LocalBundleOptions options;
  options.noise.depth_factor = 3.0;
  const LocalBundle bundle = take_local_bundle(world.map, {0, 2}, kCamera, options);
  ASSERT_FALSE(bundle.problem.point_observations.empty());
  for (const auto& seen : bundle.problem.point_observations) {
    ASSERT_GT(seen.depth, 0.0);
    EXPECT_DOUBLE_EQ(seen.depth_sigma, 3.0 * sensor::depth_sigma(seen.depth));
  }
}

TEST(ObservationNoise, MotionMultipliesEveryStandardDeviation) {
  features::PointFeature corner;
  corner.depth = 2.0F;
  corner.octave = 3;
  features::LineFeature line;
  line.line3 = features::Line3{};
  line.line3->start = {0.0, 0.0, 2.0};
  line.line3->end = {0.5, 0.0, 2.5};
  const ObservationNoise noise;
  const auto steady = noise.of(corner, false);
  const auto turning = noise.of(corner, false, 3.0);
  EXPECT_DOUBLE_EQ(steady.pixel_sigma, 1.2 * 1.2 * 1.2);
  EXPECT_DOUBLE_EQ(turning.pixel_sigma, 3.0 * steady.pixel_sigma);
  EXPECT_DOUBLE_EQ(noise.of(corner, true, 3.0).pixel_sigma, noise.aligned * turning.pixel_sigma);
  EXPECT_DOUBLE_EQ(turning.depth_sigma, 3.0 * steady.depth_sigma);
  const auto steady_line = noise.of(line);
  const auto turning_line = noise.of(line, 3.0);
  EXPECT_TRUE(steady_line.has_depth);
  EXPECT_DOUBLE_EQ(steady_line.pixel_sigma, noise.line_sigma_px);
  EXPECT_DOUBLE_EQ(turning_line.pixel_sigma, 3.0 * steady_line.pixel_sigma);
  EXPECT_DOUBLE_EQ(turning_line.end_sigma, 3.0 * steady_line.end_sigma);
  line.line3.reset();
  EXPECT_FALSE(noise.of(line).has_depth);
}

TEST(LocalBundle, WhatOnlyOneKeyframeSeesMovesWithIt) {
  SmallMap world;
  LocalBundle bundle = take_local_bundle(world.map, {0, 2}, kCamera, {});
  ASSERT_TRUE(optimize::adjust_bundle(bundle.problem, {}).usable);
  put_back(bundle, world.map);
  const Eigen::Vector3d in_camera =
      world.map.camera_from_world({0, 2}) * world.map.point(world.single).position;
  EXPECT_LT((in_camera - Eigen::Vector3d(0.1, 0.1, 2.0)).norm(), 1e-9);
}

TEST(LocalBundle, AKeyframeTakenWhileTurningFastSaysLess) {
  const SmallMap still, turning(0.8);
  const auto sigmas = [](const SmallMap& world) {
    std::vector<double> found;
    const LocalBundle bundle = take_local_bundle(world.map, {0, 1}, kCamera, {});
    for (std::size_t i = 0; i < bundle.point_seen.size(); ++i) {
      if (bundle.point_seen[i].keyframe == KeyframeId{0, 2})
        found.push_back(bundle.problem.point_observations[i].pixel_sigma);
    }
    return found;
  };
  const std::vector<double> steady = sigmas(still), distorted = sigmas(turning);
  ASSERT_FALSE(steady.empty());
  ASSERT_EQ(steady.size(), distorted.size());
  for (std::size_t i = 0; i < steady.size(); ++i)
    EXPECT_DOUBLE_EQ(distorted[i], std::hypot(1.0, 4.0) * steady[i]);
}

TEST(LocalBundle, AnEdgeOfAKeyframeTakenWhileTurningFastSaysLess) {
  for (const double turn_rate : {0.0, 0.8}) {
    SmallMap world(turn_rate);
    world.map.add_edge({{0, 1}, {0, 2}, {}, geometry::Matrix6d::Identity()});
    const LocalBundle bundle = take_local_bundle(world.map, {0, 1}, kCamera, {});
    ASSERT_EQ(bundle.problem.edges.size(), 1U);
    EXPECT_DOUBLE_EQ(bundle.problem.edges[0].information(0, 0),
                     turn_rate > 0.0 ? 1.0 / std::hypot(1.0, 4.0) : 1.0);
  }
}

TEST(LocalBundle, AWrongObservationIsTakenOutOfTheMap) {
  SmallMap world;
  // Point 0 is said to be seen where another one is.
  world.map.unobserve(core::PointId{0, 0}, {0, 1});
  world.map.unobserve(core::PointId{0, 1}, {0, 1});
  ASSERT_TRUE(world.map.observe(core::PointId{0, 0}, {0, 1}, 1));
  LocalBundle bundle = take_local_bundle(world.map, {0, 2}, kCamera, {});
  ASSERT_TRUE(optimize::adjust_bundle(bundle.problem, {}).usable);
  put_back(bundle, world.map);
  EXPECT_FALSE(world.map.point_of({0, 1}, 1).valid());
  EXPECT_TRUE(world.map.point_of({0, 1}, 5).valid());
}

TEST(LocalBundle, ASingleKeyframeIsHeld) {
  SmallMap world;
  LocalBundleOptions options;
  options.keyframes = 1;
  const LocalBundle bundle = take_local_bundle(world.map, {0, 0}, kCamera, options);
  EXPECT_TRUE(bundle.problem.poses.front().fixed);
}

TEST(LocalBundle, WhatWasMadeMeanwhileIsCarried) {
  SmallMap world;
  LocalBundle bundle = take_local_bundle(world.map, {0, 2}, kCamera, {});
  const Rigid3 three_from_two = Rigid3(Eigen::Matrix3d::Identity(), Eigen::Vector3d(-0.1, 0.0, 0.0));
  const Rigid3 four_from_three = Rigid3(geometry::exp_so3({0.0, 0.1, 0.0}), Eigen::Vector3d(0.0, 0.0, 0.1));
  const Rigid3 askew = world.map.camera_from_world({0, 2});
  world.truth.push_back(three_from_two * askew);
  world.add_keyframe(3, 0.0);
  world.truth.push_back(four_from_three * three_from_two * askew);
  world.add_keyframe(4, 0.0);
  world.map.set_parent({0, 3}, {0, 2});
  world.map.set_parent({0, 4}, {0, 3});
  // A landmark that keyframe 3 made and 4 sees as well, and one of the bundle that 3 sees by now.
  maps::MapPoint made;
  made.position = world.truth[3].inverse() * Eigen::Vector3d(0.2, -0.1, 1.5);
  const core::PointId fresh = world.map.add_point(0, made);
  world.map.observe(fresh, {0, 3}, 7);
  world.map.observe(fresh, {0, 4}, 7);
  world.map.observe(core::PointId{0, 9}, {0, 3}, 9);
  ASSERT_TRUE(optimize::adjust_bundle(bundle.problem, {}).usable);
  const auto correction = put_back(bundle, world.map);
  ASSERT_TRUE(correction.has_value());
  const auto pose = [&](int k) { return world.map.camera_from_world({0, k}); };
  ASSERT_GT(tests::distance(pose(2), askew), 0.01) << "it has moved";
  EXPECT_LT(tests::distance(pose(3), three_from_two * pose(2)), 1e-9);
  EXPECT_LT(tests::distance(pose(4), four_from_three * pose(3)), 1e-9);
  EXPECT_LT((pose(3) * world.map.point(fresh).position - Eigen::Vector3d(0.2, -0.1, 1.5)).norm(), 1e-9);
  EXPECT_LT((world.map.point(core::PointId{0, 9}).position - world.points[9]).norm(), 2e-3)
      << "as adjusted, not carried";
  EXPECT_LT(tests::distance(pose(3), world.truth[3] * correction->at({0, 3}).inverse()), 1e-9);
}

TEST(LocalBundle, WhatIsGoneMeanwhileIsLeftOut) {
  SmallMap world;
  world.map.set_parent({0, 1}, {0, 0});
  world.map.set_parent({0, 2}, {0, 0});
  LocalBundle bundle = take_local_bundle(world.map, {0, 2}, kCamera, {});
  world.map.remove(core::PointId{0, 4});
  world.map.merge(core::PointId{0, 5}, core::PointId{0, 6});
  ASSERT_TRUE(optimize::adjust_bundle(bundle.problem, {}).usable);
  ASSERT_TRUE(put_back(bundle, world.map).has_value());
  EXPECT_EQ(world.map.find(core::PointId{0, 4}), nullptr);
  EXPECT_EQ(world.map.find(core::PointId{0, 6}), nullptr);
  EXPECT_LT(tests::distance(world.map.camera_from_world({0, 2}), world.truth[2]), 1e-3);
  EXPECT_LT((world.map.point(core::PointId{0, 8}).position - world.points[8]).norm(), 2e-3);
}

TEST(LocalBundle, AMapThatSomethingElseHasMovedIsLeftAlone) {
  SmallMap world;
  LocalBundle bundle = take_local_bundle(world.map, {0, 2}, kCamera, {});
  ASSERT_TRUE(optimize::adjust_bundle(bundle.problem, {}).usable);
  const Rigid3 elsewhere = Rigid3(Eigen::Matrix3d::Identity(), {1.0, 0.0, 0.0});
  world.map.set_pose({0, 1}, elsewhere * world.map.camera_from_world({0, 1}));
  const Rigid3 before = world.map.camera_from_world({0, 2});
  EXPECT_FALSE(put_back(bundle, world.map).has_value());
  EXPECT_EQ(tests::distance(world.map.camera_from_world({0, 2}), before), 0.0);
}

TEST(LocalBundle, AnObservationThatIsAnotherByNowIsNotDropped) {
  SmallMap world;
  world.map.unobserve(core::PointId{0, 0}, {0, 1});
  world.map.unobserve(core::PointId{0, 1}, {0, 1});
  ASSERT_TRUE(world.map.observe(core::PointId{0, 0}, {0, 1}, 1));
  LocalBundle bundle = take_local_bundle(world.map, {0, 2}, kCamera, {});
  ASSERT_TRUE(optimize::adjust_bundle(bundle.problem, {}).usable);
  world.map.unobserve(core::PointId{0, 0}, {0, 1});
  ASSERT_TRUE(world.map.observe(core::PointId{0, 0}, {0, 1}, 0));  // put right while the bundle was under way
  ASSERT_TRUE(put_back(bundle, world.map).has_value());
  EXPECT_EQ(world.map.point_of({0, 1}, 0), (core::PointId{0, 0}));
}

}  // namespace
}  // namespace plumbline::mapping
