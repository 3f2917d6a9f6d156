// SPDX-License-Identifier: BSD-3-Clause
// Another visit of a map: what it finds gone, and what it finds new.
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <memory>
#include <set>
#include <vector>

#include "../../../src/pipeline/visits/visit_changes.hpp"
#include "../../../src/pipeline/visits/visit_thinning.hpp"

namespace plumbline::pipeline {
namespace {

constexpr float kWall_m = 2.0F;
constexpr float kBox_m = 1.4F;

sensor::Pinhole visit_camera() {
  sensor::Pinhole camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 140.0;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

/// A camera at (x, 0, 0) before a wall, with a box of 0.4 m before it or without.
cloud::CloudPtr view_of_wall(double x, bool box) {
  const sensor::Pinhole camera = visit_camera();
  auto cloud = std::make_shared<cloud::Cloud>();
  for (int v = 0; v < camera.height; v += 2) {
    for (int u = 0; u < camera.width; u += 2) {
      const Eigen::Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
      const Eigen::Vector3d at = static_cast<double>(kBox_m) * ray + Eigen::Vector3d(x, 0.0, 0.0);
      const bool hits = box && std::abs(at.x()) < 0.2 && std::abs(at.y()) < 0.2;
      cloud::Point point;
      point.getVector3fMap() = ((hits ? kBox_m : kWall_m) * ray.cast<float>()).eval();
      point.getNormalVector3fMap() = Eigen::Vector3f(0.0F, 0.0F, -1.0F);
      cloud->push_back(point);
    }
  }
  return cloud;
}

/// Three views each of the map and of the visit, from other places.
struct TwoDays {
  std::vector<VisitedView> views;
  std::vector<cloud::CloudPtr> clouds;
  VisitChanges changes;

  TwoDays(bool box_before, bool box_now, int threads = 1) {
    for (const bool of_visit : {false, true}) {
      for (const double x : {-0.1, 0.0, 0.1}) {
        const double at = of_visit ? x + 0.04 : x;
        views.push_back({{Eigen::Matrix3d::Identity(), {at, 0.0, 0.0}}, visit_camera(), of_visit});
        clouds.push_back(view_of_wall(at, of_visit ? box_now : box_before));
      }
    }
    const core::Executor executor(threads);
    changes = find_changes(
                  views,
                  [&](std::size_t v) -> core::Result<cloud::CloudPtr> {
                    return std::make_shared<cloud::Cloud>(*clouds[v]);
                  },
                  executor)
                  .value();
  }
};

TEST(Visit, FindsNothingWhereNothingHasChanged) {
  const TwoDays days(true, true);
  EXPECT_EQ(days.changes.gone_points, 0U);
  EXPECT_EQ(days.changes.new_cells, 0U);
  for (std::size_t v = 3; v < 6; ++v) EXPECT_LT(days.changes.share_new[v], 0.01);
}

TEST(Visit, TakesAwayWhatItLooksThroughAndNothingElse) {
  const TwoDays days(true, false, 2);
  EXPECT_TRUE(days.changes.is_gone({0.0, 0.0, kBox_m}));
  EXPECT_FALSE(days.changes.is_gone({0.5, 0.3, kWall_m}));
  std::size_t box = 0, left = 0, lost = 0;
  for (std::size_t v = 0; v < 3; ++v) {
    ASSERT_EQ(days.changes.removed[v].size(), days.clouds[v]->size());
    for (std::size_t i = 0; i < days.clouds[v]->size(); ++i) {
      const bool of_box = (*days.clouds[v])[i].z < 1.5F;
      box += of_box ? 1 : 0;
      left += of_box && days.changes.removed[v][i] == 0 ? 1 : 0;
      lost += !of_box && days.changes.removed[v][i] != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(box, 1000U);
  EXPECT_LT(left, box / 50);  // its border
  EXPECT_EQ(lost, 0U);
}

TEST(Visit, FindsWhatIsNewAndForgetsWhatItHides) {
  const TwoDays days(false, true);
  EXPECT_GT(days.changes.new_cells, 100U);  // 0.16 m2 in cells of 3 cm
  for (std::size_t v = 3; v < 6; ++v) {
    EXPECT_GT(days.changes.share_new[v], 0.02);
    EXPECT_LT(days.changes.share_new[v], 0.3);
  }

  // The map's views do not claim any more that they saw through where the box is now.
  ASSERT_FALSE(days.changes.removed[1].empty());
  for (std::size_t i = 0; i < days.clouds[1]->size(); ++i) {
    const cloud::Point& p = (*days.clouds[1])[i];
    const bool behind = std::abs(p.x) < 0.2F && std::abs(p.y) < 0.2F;
    const bool away = std::abs(p.x) > 0.5F || std::abs(p.y) > 0.5F;
    if (!behind && !away) continue;
    EXPECT_EQ(days.changes.removed[1][i], behind ? 1 : 0) << p.x << " " << p.y;
  }
}

/// A map with keyframes of robot 0, the map's, and of robot 1, a visitor.
maps::Map map_with(const std::vector<double>& of_map, const std::vector<double>& of_visit) {
  maps::Map map;
  for (const std::int32_t robot : {0, 1}) {
    for (const double x : robot == 0 ? of_map : of_visit) {
      auto keyframe = std::make_shared<maps::Keyframe>();
      keyframe->id = map.next_keyframe_id(robot);
      keyframe->stamp = x + 100.0 * robot;
      keyframe->features = std::make_shared<features::FrameFeatures>();
      const core::KeyframeId id =
          map.add_keyframe(keyframe, geometry::Rigid3(Eigen::Matrix3d::Identity(), {-x, 0.0, 0.0}));
      if (map.keyframe_count() > 1)
        map.set_parent(id, id.index > 0 ? core::KeyframeId{robot, id.index - 1} : map.keyframe_ids().front());
    }
  }
  return map;
}

TEST(Visit, KeepsKeyframesOfPlacesWhereTheMapHasNone) {
  const maps::Map map = map_with({0.0, 0.5}, {0.1, 0.2, 0.6, 2.0, 2.1, 3.2});
  VisitChanges changes;
  std::map<core::KeyframeId, std::size_t> views;
  for (std::int32_t i = 0; i < 6; ++i) views[{1, i}] = static_cast<std::size_t>(i);
  changes.shows.resize(6);
  changes.share_new.assign(6, 0.0);
  changes.share_new[2] = 0.5;  // shows much that is new
  const std::set<core::KeyframeId> redundant = redundant_keyframes(map, {1}, views, changes, {});
  EXPECT_EQ(redundant, (std::set<core::KeyframeId>{{1, 1}, {1, 4}}));

  // Frames keep their poses when they are told relative to another keyframe.
  maps::FramePose frame;
  frame.stamp = 102.1;
  frame.tracked = true;
  frame.reference = {1, 4};
  frame.camera_from_reference = geometry::Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.3, 0.0});
  std::vector<maps::FramePose> frames{frame};
  const Eigen::Vector3d before = maps::trajectory(frames, map).front().world_from_camera.translation;
  refer_to_others(map, redundant, frames);
  EXPECT_EQ(frames.front().reference, (core::KeyframeId{1, 3}));
  const Eigen::Vector3d after = maps::trajectory(frames, map).front().world_from_camera.translation;
  EXPECT_LT((before - after).norm(), 1e-12);
}

}  // namespace
}  // namespace plumbline::pipeline
