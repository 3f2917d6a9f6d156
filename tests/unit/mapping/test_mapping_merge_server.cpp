// SPDX-License-Identifier: BSD-3-Clause
// When two maps of robots that still drive are known to overlap.
#include <gtest/gtest.h>

#include <algorithm>

#include "plumbline/mapping/merge_server.hpp"
#include "poster_view.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using tests::kTestCamera;

const Rigid3 kWorldOfOthers(geometry::exp_so3({0.2, -0.4, 0.3}), {2.0, -1.0, 0.5});

maps::Map wall_with_poster(unsigned poster, int views, double from_m, const Rigid3& world_from_truth) {
  maps::Map map;
  const cv::Mat wall = tests::poster(1400, poster);
  for (int i = 0; i < views; ++i) {
    const Rigid3 pose(geometry::exp_so3({0.0, 0.02 * i, 0.01 * i}), {from_m + 0.09 * i, 0.02 * i, 0.01 * i});
    tests::add_view(map, wall, pose, pose * world_from_truth.inverse(), 1.0 + i);
  }
  return map;
}

TEST(MergeServer, TellsOnceThatTwoRobotsHaveMet) {
  const auto a = std::make_shared<maps::Map>(wall_with_poster(5, 8, -0.35, Rigid3{}));
  const auto b =
      std::make_shared<maps::Map>(renumbered(wall_with_poster(5, 8, -0.3, kWorldOfOthers), {{0, 1}}));
  const core::Executor executor(1);
  MergeServer end({}, {{{0, kTestCamera}}, {{1, kTestCamera}}}, executor);
  std::vector<MergeEvidence> merges;
  for (int i = 0; i < 8; ++i) {
    for (const auto& map : {a, b}) {
      const KeyframeId id{map->keyframe_ids().front().robot, i};
      const auto told = end.add(map, id);
      merges.insert(merges.end(), told.begin(), told.end());
    }
  }
  ASSERT_EQ(merges.size(), 1U);
  EXPECT_LT(tests::distance(merges[0].alignment.a_from_b, kWorldOfOthers.inverse()), 0.04);
  EXPECT_THROW(end.add(a, {5, 0}), std::invalid_argument);
}

TEST(MergeServer, RobotsInDifferentPlacesStayApart) {
  const auto a = std::make_shared<maps::Map>(wall_with_poster(5, 6, -0.3, Rigid3{}));
  const auto b =
      std::make_shared<maps::Map>(renumbered(wall_with_poster(99, 6, -0.3, kWorldOfOthers), {{0, 1}}));
  const core::Executor executor(1);
  MergeServer end({}, {{{0, kTestCamera}}, {{1, kTestCamera}}}, executor);
  for (int i = 0; i < 6; ++i) {
    for (const auto& map : {a, b}) {
      const KeyframeId id{map->keyframe_ids().front().robot, i};
      EXPECT_TRUE(end.add(map, id).empty());
    }
  }
}

}  // namespace
}  // namespace plumbline::mapping
