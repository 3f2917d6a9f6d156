// SPDX-License-Identifier: BSD-3-Clause
// Landmarks that deserve to stay: triangulated, fused and judged in worlds of known truth.
#include <gtest/gtest.h>

#include "landmark_world.hpp"
#include "plumbline/mapping/local_mapping/landmark_culling.hpp"
#include "plumbline/mapping/local_mapping/landmark_fusion.hpp"
#include "plumbline/mapping/local_mapping/landmark_normal.hpp"
#include "plumbline/mapping/local_mapping/landmark_triangulation.hpp"
#include "two_views_of_a_wall.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using tests::LandmarkWorld;
using tests::looking_from;

/// Depth of the planes normal . p = distance, the nearest first: what the camera sees.
cv::Mat depth_of(const sensor::Pinhole& camera,
                 const std::vector<std::pair<Eigen::Vector3d, double>>& planes) {
  cv::Mat depth(camera.height, camera.width, CV_32FC1, cv::Scalar(0));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = camera.unproject(u, v, 1.0);
      double nearest = 1e9;
      for (const auto& [normal, distance] : planes) {
        const double z = distance / normal.dot(ray);
        if (z > 0.0) nearest = std::min(nearest, z);
      }
      if (nearest < 10.0) depth.at<float>(v, u) = static_cast<float>(nearest);
    }
  }
  return depth;
}

TEST(DepthNormal, IsThatOfThePlaneAroundACorner) {
  const sensor::Pinhole camera = LandmarkWorld(1, 0, 0).camera;
  const Eigen::Vector3d slanted = Eigen::Vector3d(0.5, -0.2, -1.0).normalized();
  const cv::Mat depth = depth_of(camera, {{slanted, -2.0}});
  const Eigen::Vector2d pixel(0.4 * camera.width, 0.6 * camera.height);
  const double z = -2.0 / slanted.dot(camera.unproject(pixel.x(), pixel.y(), 1.0));
  EXPECT_LT((depth_normal(depth, pixel, z, camera) - slanted).norm(), 0.01);
  EXPECT_TRUE(depth_normal(depth, pixel, z - 0.5, camera).isZero()) << "it floats in front of the plane";
  EXPECT_TRUE(depth_normal(depth, {-100.0, 0.0}, z, camera).isZero()) << "out of the picture";
  EXPECT_TRUE(depth_normal(cv::Mat(depth.size(), CV_32FC1, cv::Scalar(0)), pixel, z, camera).isZero());
}

TEST(DepthNormal, BesideAFoldIsThatOfTheLargerSide) {
  const sensor::Pinhole camera = LandmarkWorld(1, 0, 0).camera;
  const Eigen::Vector3d left = Eigen::Vector3d(1.0, 0.0, -1.0).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d(-1.0, 0.0, -1.0).normalized();
  const double distance = -2.0 / std::sqrt(2.0);  // they meet 2 m ahead, like the edge of a box
  cv::Mat depth = depth_of(camera, {{left, distance}, {right, distance}});
  depth = cv::max(depth_of(camera, {{left, distance}}), depth_of(camera, {{right, distance}}));
  const Eigen::Vector2d pixel(camera.cx - 6.0, camera.cy);
  const double z =
      static_cast<double>(depth.at<float>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x())));
  const Eigen::Vector3d normal = depth_normal(depth, pixel, z, camera);
  EXPECT_GT(std::max(normal.dot(left), normal.dot(right)), 0.97) << normal.transpose();
}

TEST(Triangulation, FindsPointsWithoutDepth) {
  LandmarkWorld world(2, 80, 0);
  world.depth = false;
  world.pixel_noise = 0.4;
  const KeyframeId a = world.add_keyframe(looking_from(0.0));
  const KeyframeId b = world.add_keyframe(looking_from(0.4));
  const auto made = triangulate_points(world.map, b, {a}, 8.0, world.camera, {});
  EXPECT_GT(made.size(), 60U);
  for (core::PointId id : made) {
    const maps::MapPoint& p = world.map.point(id);
    ASSERT_EQ(p.observations.size(), 2U);
    EXPECT_EQ(p.observations[0].feature, p.observations[1].feature) << "a wrong match";
    const Eigen::Vector3d& truth = world.points[static_cast<std::size_t>(p.observations[0].feature)];
    EXPECT_LT((p.position - truth).norm(), 0.06 * truth.norm());
  }
  EXPECT_TRUE(triangulate_points(world.map, b, {a}, 8.0, world.camera, {}).size() < 10U)
      << "they are known now";
}

TEST(Triangulation, LeavesAloneWhatHasDepthAndWhatCannotBeKnown) {
  LandmarkWorld measured(2, 40, 12);
  const KeyframeId a = measured.add_keyframe(looking_from(0.0));
  const KeyframeId b = measured.add_keyframe(looking_from(0.4));
  const KeyframeId c = measured.add_keyframe(looking_from(0.2, 0.3));
  EXPECT_TRUE(triangulate_points(measured.map, b, {a}, 8.0, measured.camera, {}).empty());
  EXPECT_TRUE(triangulate_lines(measured.map, c, {a, b}, 8.0, measured.camera, {}).empty());
  EXPECT_GT(triangulate_points(measured.map, b, {a}, 1.0, measured.camera, {}).size(), 30U)
      << "beyond the range that is trusted";

  LandmarkWorld still(3, 40, 12);
  still.depth = false;
  const KeyframeId d = still.add_keyframe(looking_from(0.0));
  const KeyframeId e = still.add_keyframe(looking_from(0.005));
  const KeyframeId same = still.add_keyframe(looking_from(0.0));
  EXPECT_TRUE(triangulate_points(still.map, e, {d}, 8.0, still.camera, {}).empty()) << "hardly moved";
  EXPECT_TRUE(triangulate_points(still.map, same, {d}, 8.0, still.camera, {}).empty()) << "not moved at all";
  EXPECT_TRUE(triangulate_lines(still.map, same, {d, e}, 8.0, still.camera, {}).empty());
  EXPECT_TRUE(triangulate_points(still.map, e, {}, 8.0, still.camera, {}).empty());
}

TEST(Triangulation, DoublesThatLookAlikeAreNotTrusted) {
  LandmarkWorld world(4, 30, 0);
  world.depth = false;
  for (auto& d : world.point_descriptors) d = world.point_descriptors.front();
  world.points[1] = world.points[0] + Eigen::Vector3d(0.2, 0.0, 0.0);  // on one epipolar line
  const KeyframeId a = world.add_keyframe(looking_from(0.0));
  const KeyframeId b = world.add_keyframe(looking_from(0.4));
  triangulate_points(world.map, b, {a}, 8.0, world.camera, {});
  EXPECT_FALSE(world.map.point_of(b, 0).valid());
  EXPECT_FALSE(world.map.point_of(b, 1).valid());
}

TEST(Triangulation, CornersAlignedByTheirPatchesNeedAThirdOfTheWay) {
  tests::TwoViewsOfAWall views;
  const KeyframeId older = views.add_keyframe({}, views.older);
  const KeyframeId newer = views.add_keyframe(views.newer_from_world, views.newer);
  TriangulationOptions options;
  options.max_relative_sigma = 0.04;
  const auto triangulate = [&](const NewestImage* picture) {
    return triangulate_points(views.map, newer, {older}, 8.0, tests::kTestCamera, options, picture);
  };
  EXPECT_TRUE(triangulate(nullptr).empty()) << "a pixel over 12 cm says little about what is 2 m away";
  EXPECT_GT(views.mean_off(), 0.25);
  const std::vector<Eigen::Vector2f> found = [&] {
    std::vector<Eigen::Vector2f> result;
    for (const features::PointFeature& p : views.newer->points) result.push_back(p.pixel);
    return result;
  }();
  const std::vector<cv::Mat> levels = views.newer->levels;
  const NewestImage picture{levels, *views.newer};
  const auto made = triangulate(&picture);
  EXPECT_GT(made.size(), 2 * views.wall.size() / 3) << "all but those ahead";
  for (core::PointId id : made) {
    const maps::MapPoint& p = views.map.point(id);
    ASSERT_EQ(p.observations.size(), 2U);
    EXPECT_EQ(p.observations[0].feature, p.observations[1].feature) << "a wrong match";
    EXPECT_TRUE(p.observations[0].aligned && p.observations[1].aligned);
    const auto i = static_cast<std::size_t>(p.observations[0].feature);
    EXPECT_LT(views.off(i), 0.15);
    EXPECT_LT((views.newer->points[i].pixel - found[i] - views.newer->patches[i].offset).norm(), 1e-4F);
    EXPECT_LT((p.position - views.wall[i]).norm(), 0.06 * views.wall[i].norm());
  }
  std::vector<int> near;
  const Eigen::Vector2f& moved = views.newer->points[0].pixel;
  views.newer->grid.within(views.newer->points, moved.x(), moved.y(), 0.01F, near);
  EXPECT_EQ(near, std::vector<int>{0}) << "the grid has followed";
}

TEST(Triangulation, CornersAreNotAlignedWithPatchesAtBorders) {
  tests::TwoViewsOfAWall views;
  const KeyframeId older = views.add_keyframe({}, views.older);
  const KeyframeId newer = views.add_keyframe(views.newer_from_world, views.newer);
  for (features::CornerPatch& p : views.older->patches) p.gray.fill(0);
  const std::vector<cv::Mat> levels = views.newer->levels;
  const NewestImage picture{levels, *views.newer};
  TriangulationOptions options;
  options.max_relative_sigma = 0.04;
  const auto triangulate = [&](const NewestImage& p) {
    return triangulate_points(views.map, newer, {older}, 8.0, tests::kTestCamera, options, &p);
  };
  EXPECT_TRUE(triangulate(picture).empty());
  EXPECT_TRUE(triangulate({{}, *views.newer}).empty()) << "nor without a picture";
}

TEST(Triangulation, LinesNeedThreeViewsThatAgree) {
  LandmarkWorld world(5, 0, 25);
  world.depth = false;
  world.pixel_noise = 0.3;
  const KeyframeId a = world.add_keyframe(looking_from(0.0));
  const KeyframeId b = world.add_keyframe(looking_from(0.3, 0.25));
  EXPECT_TRUE(triangulate_lines(world.map, b, {a}, 8.0, world.camera, {}).empty())
      << "two planes always meet";
  const KeyframeId c = world.add_keyframe(looking_from(-0.2, 0.3));
  const auto made = triangulate_lines(world.map, c, {a, b}, 8.0, world.camera, {});
  EXPECT_GT(made.size(), 10U);
  for (core::LineId id : made) {
    const maps::MapLine& l = world.map.line(id);
    ASSERT_GE(l.observations.size(), 3U);
    const auto& [start, end] = world.lines[static_cast<std::size_t>(l.observations[0].feature)];
    const geometry::PluckerLine truth = geometry::line_through(start, end);
    EXPECT_LT((l.start - geometry::nearest_point(truth, l.start)).norm(), 0.1);
    EXPECT_LT((l.end - geometry::nearest_point(truth, l.end)).norm(), 0.1);
    for (const maps::Observation& o : l.observations) EXPECT_EQ(o.feature, l.observations[0].feature);
  }
}

TEST(Fusion, AddsObservationsThatWereMissingBothWays) {
  LandmarkWorld world(6, 60, 15);
  const KeyframeId a = world.add_keyframe(looking_from(0.0));
  const KeyframeId b = world.add_keyframe(looking_from(0.1));
  for (std::size_t i = 0; i < 60; ++i) world.add_point(i, {i < 30 ? a : b});
  for (std::size_t i = 0; i < 15; ++i) world.add_line(i, {i < 7 ? a : b});
  const FusionSummary points = fuse_points(world.map, b, {a}, {{0, world.camera}}, {});
  EXPECT_GT(points.observed, 50);
  EXPECT_EQ(points.merged, 0);
  EXPECT_EQ(world.map.shared(a, b), points.observed);
  const FusionSummary lines = fuse_lines(world.map, b, {a}, {{0, world.camera}}, {});
  EXPECT_GT(lines.observed, 10);
  for (core::PointId id : world.map.point_ids()) {
    for (const maps::Observation& o : world.map.point(id).observations) EXPECT_EQ(o.feature, id.index);
  }
}

TEST(Fusion, MergesDoublesIntoTheBetterSeen) {
  LandmarkWorld world(7, 60, 15);
  const KeyframeId a = world.add_keyframe(looking_from(0.0));
  const KeyframeId b = world.add_keyframe(looking_from(0.1));
  const KeyframeId c = world.add_keyframe(looking_from(0.2));
  const Eigen::Vector3d error(0.002, 0.0, 0.004);
  for (std::size_t i = 0; i < 60; ++i) world.add_point(i, {a, b});
  for (std::size_t i = 0; i < 60; ++i) world.add_point(i, {c}, error);
  for (std::size_t i = 0; i < 15; ++i) world.add_line(i, {a, b});
  for (std::size_t i = 0; i < 15; ++i) world.add_line(i, {c}, error);
  const FusionSummary points = fuse_points(world.map, c, {a, b}, {{0, world.camera}}, {});
  EXPECT_GT(points.merged, 50);
  EXPECT_EQ(world.map.point_count(), static_cast<std::size_t>(120 - points.merged));
  const FusionSummary lines = fuse_lines(world.map, c, {a, b}, {{0, world.camera}}, {});
  EXPECT_GT(lines.merged, 10);
  for (core::PointId id : world.map.point_ids()) {
    if (world.map.point(id).observations.size() < 3) continue;
    EXPECT_LT(id.index, 60) << "the one that more keyframes see stays";
    EXPECT_LT((world.map.point(id).position - world.points[static_cast<std::size_t>(id.index)]).norm(),
              0.002);
  }
}

TEST(Fusion, NeighboursInSpaceOrInOnePictureStayTwo) {
  LandmarkWorld world(8, 2, 0);
  world.points = {{0.0, 0.0, 2.0}, {0.0, 0.0, 2.0}};
  world.point_descriptors[1] = world.point_descriptors[0];
  const KeyframeId a = world.add_keyframe(looking_from(0.0));
  const KeyframeId b = world.add_keyframe(looking_from(0.05));
  const core::PointId near = world.add_point(0, {a});
  const core::PointId far = world.add_point(1, {b}, {0.0, 0.0, 0.6});  // on the same ray of no camera but a's
  EXPECT_EQ(fuse_points(world.map, b, {a}, {{0, world.camera}}, {}).merged, 0) << "60 cm behind it";
  EXPECT_NE(world.map.find(near), nullptr);
  EXPECT_NE(world.map.find(far), nullptr);

  LandmarkWorld pair(9, 2, 0);  // two corners 1.5 cm (4 px) apart that look the same, both in one picture
  pair.points = {{0.0, 0.0, 2.0}, {0.015, 0.0, 2.0}};
  pair.point_descriptors[1] = pair.point_descriptors[0];
  const KeyframeId c = pair.add_keyframe(looking_from(0.0));
  const KeyframeId d = pair.add_keyframe(looking_from(0.05));
  pair.add_point(0, {c, d});
  pair.add_point(1, {c});
  EXPECT_EQ(fuse_points(pair.map, d, {c}, {{0, pair.camera}}, {}).merged, 0);
  EXPECT_EQ(pair.map.point_count(), 2U);
}

TEST(Fusion, ACornerTwoPixelsOffIsAnother) {
  for (const double error_m : {0.003, 0.008}) {  // 0.8 and 2.1 px
    LandmarkWorld world(11, 1, 0);
    world.points = {{0.0, 0.0, 2.0}};
    const KeyframeId a = world.add_keyframe(looking_from(0.0));
    const KeyframeId b = world.add_keyframe(looking_from(0.05));
    world.add_point(0, {a}, {error_m, 0.0, 0.0});
    EXPECT_EQ(fuse_points(world.map, b, {a}, {{0, world.camera}}, {}).observed, error_m < 0.005 ? 1 : 0);
  }
}

TEST(Fusion, LinesAreProjectedWithTheCameraOfTheRobotThatSawThem) {
  LandmarkWorld world(13, 0, 12);
  const std::map<std::int32_t, sensor::Pinhole> cameras{{0, world.camera},
                                                        {1, {640, 480, 420.0, 415.0, 330.0, 230.0}}};
  const KeyframeId of_0 = world.add_keyframe(looking_from(0.0));
  world.robot = 1;
  world.camera = cameras.at(1);
  const KeyframeId of_1 = world.add_keyframe(looking_from(0.1));
  for (std::size_t i = 0; i < 12; ++i) world.add_line(i, {of_0});
  for (std::size_t i = 0; i < 12; ++i) world.add_line(i, {of_1});
  EXPECT_GT(fuse_lines(world.map, of_1, {of_0}, cameras, {}).merged, 8);
}

TEST(Fusion, EdgesThatMeetInOnePictureStayTwo) {
  for (const double behind_m : {0.0, 0.025}) {
    LandmarkWorld world(12, 0, 1);
    world.lines = {{{0.0, -0.4, 2.0}, {0.0, 0.4, 2.0}}};
    const KeyframeId aside = world.add_keyframe(looking_from(0.8));
    const KeyframeId before = world.add_keyframe(looking_from(0.0));
    world.add_line(0, {aside});
    world.add_line(0, {before}, {0.0, 0.0, behind_m});
    EXPECT_EQ(fuse_lines(world.map, before, {aside}, {{0, world.camera}}, {}).merged, behind_m > 0.0 ? 0 : 1);
    EXPECT_EQ(world.map.line_count(), behind_m > 0.0 ? 2U : 1U);
  }
}

TEST(LandmarkCuller, KeepsWhatIsSeenAndFound) {
  LandmarkWorld world(10, 10, 4);
  std::vector<KeyframeId> k;
  for (int i = 0; i < 8; ++i) k.push_back(world.add_keyframe(looking_from(0.05 * i)));
  LandmarkCullingOptions options;
  options.min_keyframes = 3;
  options.grace_keyframes = 5;
  LandmarkCuller culler(options);
  const core::PointId good = world.add_point(0, {k[0], k[1], k[2]});
  const core::PointId seldom = world.add_point(1, {k[0], k[1], k[2]});
  const core::PointId few = world.add_point(2, {k[0], k[1]});
  const core::PointId young = world.add_point(3, {k[4]});
  const core::LineId good_line = world.add_line(0, {k[0], k[1], k[2]});
  const core::LineId few_line = world.add_line(1, {k[0]});
  for (core::PointId id : {good, seldom, few}) culler.watch(id, k[0]);
  culler.watch(young, k[4]);
  for (core::LineId id : {good_line, few_line}) culler.watch(id, k[0]);
  for (core::PointId id : {good, seldom, few}) {
    world.map.point(id).visible = 20;
    world.map.point(id).found = id == seldom ? 5 : 6;
  }
  EXPECT_EQ(culler.judge(world.map, k[4]), 1) << "found in less than 30 %: at once";
  EXPECT_EQ(world.map.find(seldom), nullptr);
  EXPECT_NE(world.map.find(few), nullptr) << "within the grace time";
  EXPECT_EQ(culler.judge(world.map, k[5]), 2);
  EXPECT_EQ(world.map.find(few), nullptr);
  EXPECT_EQ(world.map.find(few_line), nullptr);
  EXPECT_NE(world.map.find(good), nullptr);
  EXPECT_NE(world.map.find(good_line), nullptr);
  EXPECT_NE(world.map.find(young), nullptr);
  world.map.remove(young);  // gone by other means
  EXPECT_EQ(culler.judge(world.map, {0, 140}), 0) << "who passed stays";
  world.map.point(good).found = 0;
  EXPECT_EQ(culler.judge(world.map, {0, 141}), 0) << "and is not judged again";
}

}  // namespace
}  // namespace plumbline::mapping
