// SPDX-License-Identifier: BSD-3-Clause
// Maps of known truth, put askew and adjusted as a whole.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>

#include "plumbline/mapping/adjustment/global_adjustment.hpp"
#include "random_world.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using core::PointId;
using geometry::Matrix6d;
using geometry::Rigid3;
using tests::Random;

const sensor::Pinhole kFirstCamera{640, 480, 525.0, 525.0, 319.5, 239.5};
const sensor::Pinhole kOther{320, 240, 300.0, 310.0, 150.5, 121.5};

const Rigid3 kSlide(Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0});

/// A camera that turns once round in the middle of a room of points, and what it measures; `drift` is what
/// the map thinks each step is off by. Neighbours share points, the first and the last keyframe do not.
struct RingMap {
  maps::Map map;
  std::vector<Rigid3> truth;
  std::vector<Eigen::Vector3d> points;

  /// `slid_from`: at this keyframe the tracker slid along; the few points that are seen before and after it
  /// were measured where they seemed to be, and the map believes it.
  explicit RingMap(double drift_rad, int keyframes = 40, std::int32_t second_robot_from = 1000,
                   int slid_from = 1000)
      : slid_from_(slid_from) {
    Random random(3);
    for (int i = 0; i < 1500; ++i) {
      const double phi = random.uniform(-M_PI, M_PI);
      points.emplace_back(3.0 * std::sin(phi), random.uniform(-1.0, 1.0), 3.0 * std::cos(phi));
    }
    Rigid3 believed;
    for (int k = 0; k < keyframes; ++k) {
      const double phi = 2.0 * M_PI * k / keyframes;
      truth.push_back(Rigid3(geometry::exp_so3({0.0, phi, 0.0}), {0.3 * std::sin(phi), 0.0, 0.0}).inverse());
      if (k > 0) {
        const Rigid3 step =
            truth[static_cast<std::size_t>(k)] * truth[static_cast<std::size_t>(k - 1)].inverse();
        believed = Rigid3(geometry::exp_so3({0.0, drift_rad, 0.0}), {drift_rad, 0.0, 0.0}) * step * believed;
      }
      const bool second = k >= second_robot_from;
      add_keyframe(second ? KeyframeId{1, k - second_robot_from} : KeyframeId{0, k},
                   second ? kOther : kFirstCamera, k < slid_from ? believed : believed * kSlide);
    }
    add_landmarks();
  }
  void add_keyframe(KeyframeId id, const sensor::Pinhole& camera, const Rigid3& believed) {
    auto features = std::make_shared<features::FrameFeatures>();
    seen.emplace_back();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool slides = slid(points[i]);
      if (slides && i % 10 != 0) continue;
      const Eigen::Vector3d c = truth.back() * (slides ? kSlide * points[i] : points[i]);
      if (c.z() < 0.5 || !camera.contains(camera.project(c))) continue;
      features::PointFeature f;
      f.pixel = camera.project(c).cast<float>();
      f.depth = static_cast<float>(c.z());
      features->points.push_back(f);
      seen.back().push_back(i);
    }
    features->descriptors.resize(features->points.size());
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = id;
    keyframe->features = features;
    ids.push_back(map.add_keyframe(keyframe, believed));
  }
  /// The ring is cut open: what the last third sees of the first keyframes' points are other landmarks to it.
  void add_landmarks() {
    std::map<std::pair<std::size_t, bool>, PointId> landmark;
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const bool late = k > 2 * ids.size() / 3;
      for (std::size_t f = 0; f < seen[k].size(); ++f) {
        const bool early_point = late && first_seen(seen[k][f]) < ids.size() / 3;
        const auto [found, inserted] = landmark.try_emplace({seen[k][f], early_point});
        if (inserted) {
          maps::MapPoint point;
          point.position = map.camera_from_world(ids[k]).inverse() * (truth[k] * points[seen[k][f]]);
          found->second = map.add_point(0, point);
        }
        map.observe(found->second, ids[k], static_cast<int>(f));
      }
    }
  }
  /// Was seen before the camera slid, and is seen not long after it.
  [[nodiscard]] bool slid(const Eigen::Vector3d& point) const {
    const int now = static_cast<int>(truth.size()) - 1;
    if (now < slid_from_ || now > slid_from_ + 8) return false;
    for (int k = slid_from_ - 8; k < slid_from_; ++k) {
      const Eigen::Vector3d c = truth[static_cast<std::size_t>(k)] * point;
      if (c.z() > 0.5 && kFirstCamera.contains(kFirstCamera.project(c))) return true;
    }
    return false;
  }
  [[nodiscard]] std::size_t first_seen(std::size_t point) const {
    for (std::size_t k = 0; k < seen.size(); ++k) {
      if (std::find(seen[k].begin(), seen[k].end(), point) != seen[k].end()) return k;
    }
    return seen.size();
  }
  [[nodiscard]] PoseEdge edge(std::size_t a, std::size_t b, double lie_m = 0.0) const {
    PoseEdge e;
    e.a = ids[a];
    e.b = ids[b];
    e.b_from_a = Rigid3(Eigen::Matrix3d::Identity(), {lie_m, 0.0, lie_m}) * truth[b] * truth[a].inverse();
    e.information = 1e5 * Matrix6d::Identity();
    return e;
  }
  [[nodiscard]] double rmse() const {
    double sum = 0.0;
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const double d = tests::angle(map.camera_from_world(ids[k]), truth[k]) +
                       tests::distance(map.camera_from_world(ids[k]), truth[k]);
      sum += d * d;
    }
    return std::sqrt(sum / static_cast<double>(ids.size()));
  }
  std::vector<KeyframeId> ids;
  std::vector<std::vector<std::size_t>> seen;

 private:
  int slid_from_;
};

const Cameras kOneCamera{{0, kFirstCamera}};
const Cameras kTwoCameras{{0, kFirstCamera}, {1, kOther}};

TEST(AdjustMap, ExactMeasurementsTakeTheDriftOutAndTheAnchorStays) {
  RingMap world(0.002);
  const double before = world.rmse();
  ASSERT_GT(before, 0.03);
  const Rigid3 anchor = world.map.camera_from_world(world.ids[0]);
  const GlobalAdjustmentSummary summary = adjust_map(world.map, kOneCamera, {}, {});
  EXPECT_TRUE(summary.changed) << summary.message;
  EXPECT_LT(world.rmse(), 0.2 * before);
  EXPECT_EQ(tests::distance(world.map.camera_from_world(world.ids[0]), anchor), 0.0);
  EXPECT_GT(summary.max_shift_m, 0.0);
}

TEST(KeyframeAccuracy, FallsWithTheWayAndRisesWithALoop) {
  RingMap world(0.0);
  const std::vector<KeyframeAccuracy> open = keyframe_accuracy(world.map, kOneCamera, {}, {}).keyframes;
  ASSERT_EQ(open.size(), 40U);
  EXPECT_EQ(open[0].sigma_position_m(), 0.0);
  EXPECT_EQ(open[0].sigma_rotation_rad(), 0.0);
  for (std::size_t k : {5U, 10U, 20U, 39U}) {
    EXPECT_EQ(open[k].keyframe, world.ids[k]);
    EXPECT_GT(open[k].points, 20) << k;
    EXPECT_EQ(open[k].lines, 0);
    EXPECT_EQ(open[k].edges, 0);
  }
  EXPECT_GT(open[5].sigma_rotation_rad(), open[1].sigma_rotation_rad());
  EXPECT_GT(open[20].sigma_rotation_rad(), open[5].sigma_rotation_rad());
  EXPECT_GT(open[39].sigma_rotation_rad(), open[20].sigma_rotation_rad());
  const auto closed = keyframe_accuracy(world.map, kOneCamera, {world.edge(0, 39)}, {}).keyframes;
  ASSERT_EQ(closed.size(), 40U);
  EXPECT_LT(closed[39].sigma_position_m(), 0.7 * open[39].sigma_position_m());
  EXPECT_EQ(closed[39].edges, 1);
}

TEST(KeyframeAccuracy, FactorsWidenIt) {
  const RingMap world(0.0, 12);
  GlobalAdjustmentOptions at_their_word;
  at_their_word.sigma_factors = {1.0, 1.0, 1.0};
  GlobalAdjustmentOptions wide;
  wide.sigma_factors = {3.0, 3.0, 3.0};
  const auto narrow = keyframe_accuracy(world.map, kOneCamera, {}, at_their_word).keyframes;
  const auto widened = keyframe_accuracy(world.map, kOneCamera, {}, wide).keyframes;
  ASSERT_EQ(narrow.size(), 12U);
  ASSERT_EQ(widened.size(), 12U);
  for (std::size_t k = 1; k < 12; ++k)
    EXPECT_NEAR(widened[k].sigma_position_m(), 3.0 * narrow[k].sigma_position_m(),
                1e-3 * narrow[k].sigma_position_m());
}

/// What the second robot saw is nowhere in the first one's part, and nothing joins the two.
TEST(KeyframeAccuracy, OfKeyframesThatNothingRelatesToTheFirstIsNotKnown) {
  RingMap together(0.0, 24);
  RingMap apart(0.0, 24, 12);
  for (const PointId id : apart.map.point_ids()) {
    const std::vector<maps::Observation> seen = apart.map.point(id).observations;
    const auto second = [](const maps::Observation& o) { return o.keyframe.robot == 1; };
    if (std::none_of(seen.begin(), seen.end(), second)) continue;
    for (const maps::Observation& o : seen) {
      if (!second(o)) apart.map.unobserve(id, o.keyframe);
    }
  }
  const MapAccuracy found = keyframe_accuracy(apart.map, kTwoCameras, {}, {});
  ASSERT_EQ(found.keyframes.size(), 24U) << found.missing;
  EXPECT_NE(found.missing.find("12 of 24 keyframes"), std::string::npos) << found.missing;
  const auto whole = keyframe_accuracy(together.map, kOneCamera, {}, {});
  EXPECT_EQ(whole.missing, "");
  for (std::size_t k = 1; k < 12; ++k) {
    EXPECT_GT(found.keyframes[k].sigma_position_m(), 0.9 * whole.keyframes[k].sigma_position_m()) << k;
    EXPECT_LT(found.keyframes[k].sigma_position_m(), 3.0 * whole.keyframes[k].sigma_position_m()) << k;
    EXPECT_TRUE(std::isnan(found.keyframes[12 + k].sigma_position_m())) << k;
    EXPECT_TRUE(std::isnan(found.keyframes[12 + k].sigma_rotation_rad())) << k;
  }
}

TEST(AdjustMap, ALoopBringsTheEndsTogether) {
  RingMap open(0.0015);
  RingMap closed(0.0015);
  GlobalAdjustmentOptions graph_only;
  graph_only.bundle = false;
  const double before = closed.rmse();
  const GlobalAdjustmentSummary summary =
      adjust_map(closed.map, kOneCamera, {closed.edge(0, 39), closed.edge(1, 38)}, graph_only);
  ASSERT_TRUE(summary.changed) << summary.message;
  EXPECT_EQ(summary.rejected, 0);
  EXPECT_LT(closed.rmse(), 0.5 * before);
  // Landmarks moved with the keyframes that see them.
  for (const PointId id : closed.map.point_ids()) {
    const maps::MapPoint& p = closed.map.point(id);
    if (p.observations.size() != 1) continue;
    const KeyframeId k = p.observations[0].keyframe;
    const Eigen::Vector3d now = closed.map.camera_from_world(k) * p.position;
    const Eigen::Vector3d then = open.map.camera_from_world(k) * open.map.point(id).position;
    EXPECT_LT((now - then).norm(), 1e-6);
  }
}

TEST(AdjustMap, WrongLoopsAreToldAndLeftOut) {
  RingMap clean(0.003);
  RingMap torn(0.003);
  std::vector<PoseEdge> edges;
  for (std::size_t i = 0; i < 7; ++i) edges.push_back(clean.edge(i, 39 - i));
  adjust_map(clean.map, kOneCamera, edges, {});
  for (std::size_t i = 0; i < 3; ++i)
    edges.push_back(torn.edge(i, 30 + i, 0.5 + 0.2 * static_cast<double>(i)));
  const GlobalAdjustmentSummary summary = adjust_map(torn.map, kOneCamera, edges, {});
  EXPECT_EQ(summary.rejected, 3);
  ASSERT_EQ(summary.extra.size(), 10U);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(summary.extra[i].rejected, i >= 7) << i;
  EXPECT_LT(torn.rmse(), 1.1 * clean.rmse() + 1e-4);
}

TEST(AdjustMap, LandmarksThatSlidAlongDoNotUndoWhatEdgesCorrect) {
  const auto adjusted = [](double first_gate) {
    RingMap world(0.0, 40, 1000, 20);
    GlobalAdjustmentOptions options;
    options.first_gate = first_gate;
    std::vector<PoseEdge> edges;
    for (std::size_t i = 0; i < 4; ++i) edges.push_back(world.edge(i, 39 - i));
    EXPECT_EQ(adjust_map(world.map, kOneCamera, edges, options).rejected, 0);
    return world.rmse();
  };
  ASSERT_GT(RingMap(0.0, 40, 1000, 20).rmse(), 0.06);
  const double undone = adjusted(0.0);
  EXPECT_GT(undone, 0.02);
  EXPECT_LT(adjusted(GlobalAdjustmentOptions().first_gate), 0.5 * undone);
}

TEST(AdjustMap, RobotsMayHaveDifferentCameras) {
  RingMap world(0.002, 40, 20);
  const double before = world.rmse();
  ASSERT_TRUE(adjust_map(world.map, kTwoCameras, {}, {}).changed);
  EXPECT_LT(world.rmse(), 0.2 * before);
  EXPECT_THROW(adjust_map(world.map, kOneCamera, {}, {}), std::out_of_range);
}

TEST(AdjustMap, FewLandmarksDoAsWell) {
  RingMap world(0.002);
  const double before = world.rmse();
  GlobalAdjustmentOptions options;
  options.observations = 15;
  const GlobalAdjustmentSummary summary = adjust_map(world.map, kOneCamera, {}, options);
  EXPECT_LT(summary.points, static_cast<int>(world.map.point_count()) / 2);
  EXPECT_LT(world.rmse(), 0.5 * before);
}

TEST(AdjustMap, AWrongObservationIsTakenOutOfTheMap) {
  RingMap world(0.0);
  const PointId a = world.map.point_of(world.ids[5], 0);
  const PointId b = world.map.point_of(world.ids[5], 1);
  ASSERT_TRUE(a.valid() && b.valid());
  world.map.unobserve(a, world.ids[5]);
  world.map.unobserve(b, world.ids[5]);
  ASSERT_TRUE(world.map.observe(a, world.ids[5], 1));
  adjust_map(world.map, kOneCamera, {}, {});
  EXPECT_FALSE(world.map.point_of(world.ids[5], 1).valid());
}

TEST(AdjustMap, SmallAndEmptyMapsStay) {
  maps::Map empty;
  EXPECT_FALSE(adjust_map(empty, kOneCamera, {}, {}).changed);
  RingMap single(0.0, 1);
  EXPECT_FALSE(adjust_map(single.map, kOneCamera, {}, {}).changed);
  EXPECT_FALSE(solve_map_graph(empty, {}, true).summary.usable);
}

TEST(AdjustMap, SameInputSameBytes) {
  RingMap a(0.003);
  RingMap b(0.003);
  adjust_map(a.map, kOneCamera, {a.edge(0, 39)}, {});
  const std::vector<double> elsewhere(4321, 1.0);  // another heap
  adjust_map(b.map, kOneCamera, {b.edge(0, 39)}, {});
  for (const KeyframeId id : a.ids) {
    EXPECT_EQ(std::memcmp(&a.map.camera_from_world(id), &b.map.camera_from_world(id), sizeof(Rigid3)), 0);
  }
}

}  // namespace
}  // namespace plumbline::mapping
