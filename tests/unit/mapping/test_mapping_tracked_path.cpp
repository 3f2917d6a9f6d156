// SPDX-License-Identifier: BSD-3-Clause
// What the tracker measured from keyframe to keyframe: it holds what moves in a bundle, and what contradicts
// it is not put into the map.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <memory>
#include <set>

#include "plumbline/mapping/adjustment/global_adjustment.hpp"
#include "plumbline/mapping/adjustment/local_bundle.hpp"
#include "plumbline/mapping/adjustment/tracked_path.hpp"
#include "random_world.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

const sensor::Pinhole kWayCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

/// A camera that goes along x past points that are seen by four keyframes each; every keyframe knows how it
/// lies to the one before.
class Way {
 public:
  explicit Way(int keyframes, double step_m = 0.3, double sigma_m = 0.002) {
    for (int k = 0; k < keyframes; ++k) {
      truth.emplace_back(Eigen::Matrix3d::Identity(), Eigen::Vector3d(-step_m * k, 0.0, 0.0));
      add_keyframe(k, sigma_m);
    }
    tests::Random random(5);
    for (int first = 0; first + 1 < keyframes; ++first) {
      for (int i = 0; i < 12; ++i) add_point(first, keyframes, step_m, random);
    }
  }
  [[nodiscard]] KeyframePoses moved(int from, int to, const Rigid3& by) const {
    KeyframePoses poses;
    for (int k = from; k < to; ++k) poses.emplace_back(KeyframeId{0, k}, map.camera_from_world({0, k}) * by);
    return poses;
  }
  std::vector<Rigid3> truth;
  maps::Map map;

 private:
  void add_keyframe(int k, double sigma_m) {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = {0, k};
    keyframe->stamp = k;
    if (k > 0) {
      keyframe->reference = {0, k - 1};
      keyframe->camera_from_reference =
          truth[static_cast<std::size_t>(k)] * truth[static_cast<std::size_t>(k - 1)].inverse();
      keyframe->reference_sigma_m = sigma_m;
    }
    features_.push_back(std::make_shared<features::FrameFeatures>());
    features_.back()->points.resize(60);
    features_.back()->descriptors.resize(60);
    keyframe->features = features_.back();
    map.add_keyframe(keyframe, truth.back());
    map.attach({0, k});
    used_.push_back(0);
  }
  void add_point(int first, int keyframes, double step_m, tests::Random& random) {
    maps::MapPoint point;
    point.position = {first * step_m + random.uniform(-0.2, 0.6), random.uniform(-0.5, 0.5),
                      random.uniform(1.5, 3.0)};
    const core::PointId id = map.add_point(0, point);
    for (int k = first; k < std::min(first + 4, keyframes); ++k) {
      const auto slot = static_cast<std::size_t>(k);
      features::PointFeature& f = features_[slot]->points[static_cast<std::size_t>(used_[slot])];
      const Eigen::Vector3d c = truth[slot] * point.position;
      f.pixel = kWayCamera.project(c).cast<float>();
      f.depth = static_cast<float>(c.z());
      map.observe(id, {0, k}, used_[slot]++);
    }
  }
  std::vector<std::shared_ptr<features::FrameFeatures>> features_;
  std::vector<int> used_;
};

TEST(TrackedPath, TheMapAsItWasTrackedContradictsNothing) {
  const Way way(8);
  EXPECT_FALSE(contradiction(way.map, way.moved(0, 8, Rigid3{})));
  EXPECT_FALSE(
      contradiction(way.map, way.moved(0, 8, Rigid3(geometry::exp_so3({0.1, 0.2, 0.3}), {1.0, 2.0, 3.0}))))
      << "all together may go anywhere";
}

TEST(TrackedPath, AGroupThatIsMovedAwayIsToldWithItsSeam) {
  const Way way(8);
  const auto torn =
      contradiction(way.map, way.moved(5, 8, Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.1, 0.0})));
  ASSERT_TRUE(torn);
  EXPECT_EQ(torn->a, (KeyframeId{0, 4}));
  EXPECT_EQ(torn->b, (KeyframeId{0, 5}));
  EXPECT_NEAR(torn->off_m, 0.1, 1e-9);
  EXPECT_NE(torn->text().find("10.0 cm"), std::string::npos) << torn->text();
  EXPECT_FALSE(
      contradiction(way.map, way.moved(5, 8, Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.01, 0.0}))));
  EXPECT_TRUE(
      contradiction(way.map, way.moved(5, 8, Rigid3(geometry::exp_so3({0.0, 0.06, 0.0}), {0.0, 0.0, 0.0}))));
}

TEST(TrackedPath, WhatTheTrackerHardlyKnewMayChange) {
  const Way corridor(8, 0.3, 0.1);
  EXPECT_FALSE(contradiction(corridor.map,
                             corridor.moved(5, 8, Rigid3(Eigen::Matrix3d::Identity(), {0.2, 0.0, 0.0}))));
  EXPECT_TRUE(contradiction(corridor.map,
                            corridor.moved(5, 8, Rigid3(Eigen::Matrix3d::Identity(), {0.5, 0.0, 0.0}))));
}

TEST(TrackedPath, AMapThatIsTornMayBeMended) {
  Way way(8);
  const Rigid3 away(Eigen::Matrix3d::Identity(), {0.0, 0.2, 0.0});
  for (int k = 5; k < 8; ++k) way.map.set_pose({0, k}, way.map.camera_from_world({0, k}) * away);
  const Rigid3 half_back(Eigen::Matrix3d::Identity(), {0.0, -0.1, 0.0});
  EXPECT_FALSE(contradiction(way.map, way.moved(5, 8, half_back)));
  EXPECT_TRUE(contradiction(way.map, way.moved(5, 8, Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.1, 0.0}))));
}

TEST(TrackedPath, ALoopOfTwentyCentimetresPasses) {
  const Way way(24);
  // The last keyframe sees the place of the first, 20 cm from where the way has led to.
  PoseEdge loop{{0, 0},
                {0, 23},
                way.truth[23] * Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.2, 0.0}),
                1e6 * geometry::Matrix6d::Identity(),
                true};
  const MapGraphResult solved = solve_map_graph(way.map, {loop}, true);
  ASSERT_TRUE(solved.summary.usable) << solved.summary.message;
  const Rigid3 end = solved.poses.back().second;
  EXPECT_GT(tests::distance(end, way.truth[23]), 0.15) << "the loop is closed";
  EXPECT_FALSE(contradiction(way.map, solved.poses));
}

TEST(TrackedPath, AForcedTearIsRefusedAndTheMapStays) {
  Way way(8);
  LocalBundle bundle = take_local_bundle(way.map, {0, 7}, kWayCamera, {});
  ASSERT_TRUE(optimize::adjust_bundle(bundle.problem, {}).usable);
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    auto& pose = bundle.problem.poses[i];
    if (bundle.keyframes[i].index >= 6) pose.camera_from_world.translation.y() += 0.1;
  }
  std::optional<Contradiction> refused;
  EXPECT_FALSE(put_back(bundle, way.map, &refused));
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->b, (KeyframeId{0, 6}));
  for (int k = 0; k < 8; ++k)
    EXPECT_EQ(tests::distance(way.map.camera_from_world({0, k}), way.truth[static_cast<std::size_t>(k)]),
              0.0);
}

/// Every pose that moves must be tied to one that does not, by what the tracker measured alone.
void expect_tied(const LocalBundle& bundle) {
  std::set<int> tied;
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    if (bundle.problem.poses[i].fixed) tied.insert(static_cast<int>(i));
  }
  ASSERT_FALSE(tied.empty());
  for (bool grows = true; grows;) {
    grows = false;
    for (const optimize::BundleEdge& edge : bundle.problem.edges) {
      if (tied.count(edge.a) != tied.count(edge.b))
        grows = tied.insert(edge.a).second || tied.insert(edge.b).second || grows;
    }
  }
  EXPECT_EQ(tied.size(), bundle.keyframes.size());
}

TEST(TrackedPath, EveryKeyframeOfAWindowIsTiedToOneThatIsHeld) {
  for (const int around : {3, 10, 19}) {
    const Way way(20);
    for (const int size : {1, 2, 5, 12}) {
      LocalBundleOptions options;
      options.keyframes = size;
      const LocalBundle bundle =
          take_local_bundle(way.map, {0, around}, kWayCamera, options, {{0, 1}, {0, 15}});
      expect_tied(bundle);
      for (const auto& edge : bundle.problem.edges) {
        EXPECT_GT(edge.information.eigenvalues().real().minCoeff(), 1000.0) << "in all six directions";
      }
    }
  }
}

}  // namespace
}  // namespace plumbline::mapping
