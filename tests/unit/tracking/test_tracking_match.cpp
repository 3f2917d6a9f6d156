// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/tracking/association.hpp"
#include "tracking_world.hpp"

namespace plumbline::tracking {
namespace {

using features::Descriptor256;
using geometry::Rigid3;
using tests::kTestCamera;
using tests::Random;

Descriptor256 random_descriptor(Random& random) {
  return {random.bits(), random.bits(), random.bits(), random.bits()};
}
Descriptor256 with_flipped_bits(Descriptor256 d, int bits) {
  for (int i = 0; i < bits; ++i) d[static_cast<std::size_t>(i % 4)] ^= 1ULL << (i / 4);
  return d;
}

/// A map of points in front of the camera at the origin, and a frame that sees each of them.
class PointWorld : public testing::Test {
 protected:
  core::PointId add(const Eigen::Vector3d& position, const Descriptor256& descriptor, int octave = 2) {
    maps::MapPoint point;
    point.position = position;
    point.descriptor = descriptor;
    point.view_direction = position.normalized();
    point.reference_distance = position.norm();
    point.reference_octave = octave;
    ids_.push_back(map_.add_point(0, point));
    return ids_.back();
  }
  int see(const Eigen::Vector2d& pixel, const Descriptor256& descriptor, int octave = 2) {
    features::PointFeature f;
    f.pixel = pixel.cast<float>();
    f.octave = octave;
    frame_.points.push_back(f);
    frame_.descriptors.push_back(descriptor);
    return static_cast<int>(frame_.points.size()) - 1;
  }
  std::vector<PointMatch> match(const Rigid3& pose = {}, double radius = 8.0,
                                std::vector<core::PointId>* visible = nullptr) {
    frame_.grid = features::PointGrid(frame_.points, kTestCamera.width, kTestCamera.height);
    return match_points(map_, ids_, {frame_, kTestCamera, pose}, radius, options_, visible);
  }

  maps::Map map_;
  std::vector<core::PointId> ids_;
  features::FrameFeatures frame_;
  AssociationOptions options_;
  Random random_{1};
};

TEST_F(PointWorld, EveryPointFindsItsFeature) {
  const Rigid3 pose(geometry::exp_so3({0.05, -0.1, 0.02}), {0.1, 0.05, -0.1});
  std::vector<int> features;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d p =
        kTestCamera.unproject(60.0 + 55.0 * (i % 10), 60.0 + 70.0 * (i / 10), random_.uniform(1.5, 3.0));
    const Descriptor256 d = random_descriptor(random_);
    add(pose.inverse() * p, d);
    map_.point(ids_.back()).view_direction =
        (map_.point(ids_.back()).position - pose.inverse().translation).normalized();
    map_.point(ids_.back()).reference_distance = p.norm();
    features.push_back(see(kTestCamera.project(p) + Eigen::Vector2d(2.0, -1.0), with_flipped_bits(d, 12)));
  }
  std::vector<core::PointId> visible;
  const auto matches = match(pose, 8.0, &visible);
  ASSERT_EQ(matches.size(), 60U);
  EXPECT_EQ(visible.size(), 60U);
  for (const PointMatch& m : matches) {
    EXPECT_EQ(m.feature, features[static_cast<std::size_t>(m.point.index)]);
    EXPECT_EQ(m.distance, 12);
  }
}

TEST_F(PointWorld, RadiusAndDescriptorAndRatioGate) {
  const Descriptor256 d = random_descriptor(random_);
  const Eigen::Vector3d p(0.1, 0.1, 2.0);
  const Eigen::Vector2d pixel = kTestCamera.project(p);
  add(p, d, 0);
  EXPECT_TRUE(match().empty()) << "a frame without features";
  see(pixel + Eigen::Vector2d(9.0, 0.0), d, 0);
  EXPECT_TRUE(match().empty()) << "outside the radius";
  EXPECT_EQ(match({}, 10.0).size(), 1U);
  frame_ = {};
  see(pixel, with_flipped_bits(d, options_.max_hamming + 1), 0);
  EXPECT_TRUE(match().empty()) << "too different";
  frame_ = {};
  see(pixel, with_flipped_bits(d, 30), 0);
  EXPECT_EQ(match().size(), 1U);
  see(pixel + Eigen::Vector2d(5.0, 0.0), with_flipped_bits(d, 31), 0);
  EXPECT_TRUE(match().empty()) << "two rivals, which of them?";
  frame_.points[1].pixel = (pixel + Eigen::Vector2d(1.0, 0.0)).cast<float>();
  const auto same_place = match();
  ASSERT_EQ(same_place.size(), 1U) << "at one place they are the same corner";
  EXPECT_EQ(same_place[0].feature, 0);
}

TEST_F(PointWorld, ScaleGate) {
  const Descriptor256 d = random_descriptor(random_);
  const Eigen::Vector3d p(0.0, 0.0, 2.0);
  add(p, d, 3);
  for (int octave = 0; octave < 8; ++octave) {
    frame_ = {};
    see(kTestCamera.project(p), d, octave);
    EXPECT_EQ(match().size(), std::abs(octave - 3) <= 1 ? 1U : 0U) << octave;
  }
  // Twice as far away it looks smaller by 1.2^3.8: octave 3 becomes octave -1 (0 will do).
  const Rigid3 back(Eigen::Matrix3d::Identity(), {0.0, 0.0, 2.0});
  frame_ = {};
  see(kTestCamera.project(p), d, 3);
  EXPECT_TRUE(match(back).empty());
  frame_ = {};
  see(kTestCamera.project(p), d, 0);
  EXPECT_EQ(match(back).size(), 1U);
}

TEST_F(PointWorld, PointsSeenFromAnotherSideAreNotExpected) {
  const Descriptor256 d = random_descriptor(random_);
  const Eigen::Vector3d p(0.0, 0.0, 2.0);
  const core::PointId id = add(p, d);
  see(kTestCamera.project(p), d);
  std::vector<core::PointId> visible;
  for (const auto& [degrees, expected] : {std::pair{0.0, 1U}, {50.0, 1U}, {75.0, 0U}, {180.0, 0U}}) {
    map_.point(id).view_direction =
        geometry::exp_so3({0.0, degrees / 57.29578, 0.0}) * Eigen::Vector3d::UnitZ();
    visible.clear();
    EXPECT_EQ(match({}, 8.0, &visible).size(), expected) << degrees;
    EXPECT_EQ(visible.size(), expected) << degrees;
  }
}

TEST_F(PointWorld, OnlyWhatIsInViewIsVisible) {
  const Descriptor256 d = random_descriptor(random_);
  add({0.0, 0.0, -2.0}, d);  // behind
  add({0.0, 0.0, 0.01}, d);  // in the camera
  add({5.0, 0.0, 2.0}, d);   // beside
  const core::PointId seen = add({0.0, 0.0, 2.0}, d);
  ids_.push_back({0, 99});  // removed meanwhile
  std::vector<core::PointId> visible;
  match({}, 8.0, &visible);
  EXPECT_EQ(visible, std::vector<core::PointId>{seen});
}

TEST_F(PointWorld, AFeatureGoesToTheMostAlike) {
  const Descriptor256 d = random_descriptor(random_);
  const Eigen::Vector3d p(0.0, 0.0, 2.0);
  add(p, with_flipped_bits(d, 20));
  const core::PointId best = add(p, with_flipped_bits(d, 5));
  add(p, with_flipped_bits(d, 40));
  see(kTestCamera.project(p), d);
  const auto matches = match();
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].point, best);
  EXPECT_EQ(matches[0].distance, 5);
}

class LineWorld : public testing::Test {
 protected:
  core::LineId add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Descriptor256& d) {
    maps::MapLine line;
    line.start = a;
    line.end = b;
    line.descriptor = d;
    ids_.push_back(map_.add_line(0, line));
    return ids_.back();
  }
  int see(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Descriptor256& d) {
    features::LineFeature f;
    f.segment.start = a.cast<float>();
    f.segment.end = b.cast<float>();
    f.descriptor = d;
    frame_.lines.push_back(f);
    return static_cast<int>(frame_.lines.size()) - 1;
  }
  std::vector<LineMatch> match(double radius = 8.0, std::vector<core::LineId>* visible = nullptr) {
    return match_lines(map_, ids_, {frame_, kTestCamera, {}}, radius, options_, visible);
  }

  maps::Map map_;
  std::vector<core::LineId> ids_;
  features::FrameFeatures frame_;
  AssociationOptions options_;
  Random random_{2};
  // A horizontal line through the middle of the picture, 262.5 px long.
  Eigen::Vector3d a_{-0.5, 0.0, 2.0};
  Eigen::Vector3d b_{0.5, 0.0, 2.0};
  Eigen::Vector2d pa_ = kTestCamera.project(a_);
  Eigen::Vector2d pb_ = kTestCamera.project(b_);
  Descriptor256 d_ = random_descriptor(random_);
};

TEST_F(LineWorld, EveryLineFindsItsSegment) {
  std::vector<int> features;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector3d a = kTestCamera.unproject(random_.uniform(50, 590), random_.uniform(50, 430), 2.0);
    const Eigen::Vector3d b = kTestCamera.unproject(random_.uniform(50, 590), random_.uniform(50, 430), 2.5);
    if ((kTestCamera.project(a) - kTestCamera.project(b)).norm() < 60.0) continue;
    const Descriptor256 d = random_descriptor(random_);
    add(a, b, d);
    features.push_back(see(kTestCamera.project(a), kTestCamera.project(b), with_flipped_bits(d, 25)));
  }
  ASSERT_GT(features.size(), 20U);
  const auto matches = match();
  ASSERT_EQ(matches.size(), features.size());
  for (const LineMatch& m : matches) {
    EXPECT_EQ(m.feature, features[static_cast<std::size_t>(m.line.index)]);
    EXPECT_EQ(m.distance, 25);
  }
}

TEST_F(LineWorld, DistanceAngleOverlapAndDescriptorGate) {
  add(a_, b_, d_);
  const auto alone = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Descriptor256& d) {
    frame_ = {};
    see(a, b, d);
    return match().size();
  };
  const Eigen::Vector2d down(0.0, 6.0);
  EXPECT_EQ(alone(pa_, pb_, d_), 1U);
  EXPECT_EQ(alone(pa_ + down, pb_ + down, d_), 1U);
  EXPECT_EQ(alone(pa_ + 2.0 * down, pb_ + 2.0 * down, d_), 0U) << "too far";
  EXPECT_EQ(alone(pb_, pa_, d_), 0U) << "dark on the other side";
  EXPECT_EQ(alone(pa_ + Eigen::Vector2d(0.0, 20.0), pb_ - Eigen::Vector2d(0.0, 20.0), d_), 1U)
      << "8.7 degrees";
  EXPECT_EQ(alone(pa_ + Eigen::Vector2d(0.0, 40.0), pb_ - Eigen::Vector2d(0.0, 40.0), d_), 0U)
      << "17 degrees";
  EXPECT_EQ(alone(pa_ + Eigen::Vector2d(100.0, 0.0), pb_ + Eigen::Vector2d(100.0, 0.0), d_), 1U)
      << "62 % in common";
  EXPECT_EQ(alone(pa_ + Eigen::Vector2d(200.0, 0.0), pb_ + Eigen::Vector2d(200.0, 0.0), d_), 0U)
      << "24 % in common";
  EXPECT_EQ(alone(pa_, pb_, with_flipped_bits(d_, 90)), 1U);
  EXPECT_EQ(alone(pa_, pb_, with_flipped_bits(d_, 91)), 0U);
  frame_ = {};
  EXPECT_TRUE(match().empty());
}

TEST_F(LineWorld, ASegmentGoesToTheMostAlike) {
  add(a_, b_, with_flipped_bits(d_, 30));
  const core::LineId best = add(a_, b_, with_flipped_bits(d_, 10));
  see(pa_, pb_, d_);
  see(pa_ + Eigen::Vector2d(0, 2), pb_ + Eigen::Vector2d(0, 2), with_flipped_bits(d_, 80));
  const auto matches = match();
  ASSERT_EQ(matches.size(), 1U) << "the loser does not take the other segment";
  EXPECT_EQ(matches[0].line, best);
  EXPECT_EQ(matches[0].feature, 0);
}

TEST_F(LineWorld, LinesThatReachBehindTheCameraAreCut) {
  const core::LineId through = add({0.5, 0.2, 3.0}, {0.5, 0.2, -3.0}, d_);  // passes the camera on its right
  add({0.5, 0.2, -1.0}, {0.5, 0.2, -3.0}, d_);                              // all behind
  add({9.0, 0.2, 2.0}, {9.0, 0.4, 2.0}, d_);                                // beside the picture
  add({0.0, 0.0, 2.0}, {0.005, 0.0, 2.0}, d_);                              // one pixel long
  see(kTestCamera.project({0.5, 0.2, 3.0}), kTestCamera.project({0.5, 0.2, 0.9}), d_);
  std::vector<core::LineId> visible;
  const auto matches = match(8.0, &visible);
  EXPECT_EQ(visible, std::vector<core::LineId>{through});
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].line, through);
}

}  // namespace
}  // namespace plumbline::tracking
