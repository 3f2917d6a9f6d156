// SPDX-License-Identifier: BSD-3-Clause
// Maps of robots that still drive become one when they meet, and two again when they did not.
#include <gtest/gtest.h>

#include <algorithm>

#include "plumbline/mapping/merging/merge_server.hpp"
#include "poster_view.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using tests::kTestCamera;

const Eigen::Matrix3d kAsIs = Eigen::Matrix3d::Identity();

using MapPtr = std::shared_ptr<const maps::Map>;

const Rigid3 kWorldOfOthers(geometry::exp_so3({0.2, -0.4, 0.3}), {2.0, -1.0, 0.5});

/// A robot's map after each keyframe, as it films walls with posters.
class Drive {
 public:
  explicit Drive(std::int32_t robot) : robot_(robot) {}
  Drive& along(unsigned poster, int views, double from_m, const Rigid3& world_from_wall) {
    const cv::Mat wall = tests::poster(1400, poster);
    for (int i = 0; i < views; ++i) {
      const Rigid3 pose(geometry::exp_so3({0.0, 0.02 * i, 0.01 * i}),
                        {from_m + 0.09 * i, 0.02 * i, 0.01 * i});
      tests::add_view(map_, wall, pose, pose * world_from_wall.inverse(),
                      1.0 + static_cast<double>(maps_.size()));
      maps_.push_back(std::make_shared<maps::Map>(renumbered(map_, {{0, robot_}})));
    }
    return *this;
  }
  [[nodiscard]] const std::vector<MapPtr>& maps() const { return maps_; }

 private:
  std::int32_t robot_;
  maps::Map map_;
  std::vector<MapPtr> maps_;
};

/// Robots in turn, a keyframe each ten frames.
std::vector<MeetingEvent> drive(MergeServer& server, const std::vector<Drive>& robots) {
  std::vector<MeetingEvent> events;
  std::int64_t frame = 0;
  const auto take = [&](const std::vector<MeetingEvent>& more) {
    events.insert(events.end(), more.begin(), more.end());
  };
  std::size_t most = 0;
  for (std::size_t r = 0; r < robots.size(); ++r) {
    server.join({{static_cast<std::int32_t>(r), kTestCamera}});
    most = std::max(most, robots[r].maps().size());
  }
  for (std::size_t k = 0; k < most; ++k) {
    for (const Drive& robot : robots) {
      if (k < robot.maps().size()) {
        const MapPtr& map = robot.maps()[k];
        server.add(map, map->keyframe_ids().back(), frame);
      }
      for (int i = 0; i < 10; ++i) take(server.commit(frame++));
    }
  }
  take(server.finish());
  return events;
}

std::vector<MeetingEvent> of(const std::vector<MeetingEvent>& events, MeetingStep step) {
  std::vector<MeetingEvent> result;
  std::copy_if(events.begin(), events.end(), std::back_inserter(result),
               [&](const MeetingEvent& event) { return event.step == step; });
  return result;
}

TEST(MergeServer, TwoRobotsMeetStepByStep) {
  const std::vector<Drive> robots{Drive(0).along(5, 8, -0.35, {}),
                                  Drive(1).along(5, 8, -0.3, kWorldOfOthers)};
  const core::Executor executor(2);
  MergeServer server({}, 4, executor);
  const std::vector<MeetingEvent> events = drive(server, robots);
  std::vector<MeetingStep> steps;
  for (const MeetingEvent& event : events) steps.push_back(event.step);
  EXPECT_EQ(steps, (std::vector<MeetingStep>{MeetingStep::kSimilar, MeetingStep::kVerified,
                                             MeetingStep::kLocalMapAsked, MeetingStep::kMet}));
  const MeetingEvent met = events.back();
  EXPECT_LT(tests::distance(met.evidence.alignment.a_from_b, kWorldOfOthers.inverse()), 0.04);
  EXPECT_EQ(met.preview->parts, (std::vector<std::size_t>{0, 1}));
  for (const KeyframeId id : met.preview->map.keyframe_ids()) {
    const Rigid3 own = robots[static_cast<std::size_t>(id.robot)].maps().back()->camera_from_world(id);
    EXPECT_LT(
        tests::distance(met.preview->map.camera_from_world(id), id.robot == 0 ? own : own * kWorldOfOthers),
        0.04);
  }
  const auto place = server.place(1);
  ASSERT_TRUE(place);
  EXPECT_EQ(place->anchor, 0U);
  EXPECT_LT(tests::distance(place->anchor_from_robot, kWorldOfOthers.inverse()), 0.04);
  EXPECT_GT(place->covariance(0, 0), 0.0);
  EXPECT_LT(std::sqrt(place->covariance(0, 0)), 0.1);
  EXPECT_EQ(server.place(0)->covariance.norm(), 0.0);
}

TEST(MergeServer, OneLogGivesTheSameEventsForAnyNumberOfThreads) {
  const std::vector<Drive> robots{Drive(0).along(5, 7, -0.35, {}),
                                  Drive(1).along(5, 7, -0.3, kWorldOfOthers)};
  std::vector<std::vector<std::pair<std::int64_t, MeetingStep>>> told;
  std::vector<std::uint64_t> previews;
  for (const int threads : {1, 2}) {
    const core::Executor executor(threads);
    MergeServer server({}, 15, executor);
    told.emplace_back();
    for (const MeetingEvent& event : drive(server, robots)) {
      told.back().emplace_back(event.frame, event.step);
      if (event.preview) previews.push_back(content_hash(event.preview->map));
    }
  }
  EXPECT_EQ(told[0], told[1]);
  ASSERT_EQ(previews.size(), 2U);
  EXPECT_EQ(previews[0], previews[1]);
}

TEST(MergeServer, RobotsInDifferentPlacesStayApart) {
  const core::Executor executor(1);
  MergeServer server({}, 4, executor);
  const auto events =
      drive(server, {Drive(0).along(5, 6, -0.3, {}), Drive(1).along(99, 6, -0.3, kWorldOfOthers)});
  EXPECT_TRUE(of(events, MeetingStep::kMet).empty());
  EXPECT_FALSE(server.place(0));
  EXPECT_THROW(server.add(Drive(5).along(5, 1, 0.0, {}).maps().front(), {5, 0}, 1000), std::invalid_argument);
}

TEST(MergeServer, AThirdRobotJoinsByWayOfTheSecond) {
  const Rigid3 other_wall(kAsIs, {4.0, 0.0, 0.0});
  const Rigid3 third(kAsIs, {0.0, 7.0, 0.0});
  const core::Executor executor(2);
  MergeServer server({}, 4, executor);
  const auto events = drive(
      server, {Drive(0).along(5, 7, -0.35, {}), Drive(1).along(5, 7, -0.3, {}).along(8, 7, -0.3, other_wall),
               Drive(2).along(8, 14, -0.35, third)});
  const auto met = of(events, MeetingStep::kMet);
  ASSERT_EQ(met.size(), 2U);
  EXPECT_EQ(met[1].preview->parts, (std::vector<std::size_t>{0, 1, 2}));
  ASSERT_TRUE(server.place(2));
  EXPECT_EQ(server.place(2)->anchor, 0U);
  EXPECT_LT(tests::distance(server.place(2)->anchor_from_robot, other_wall * third.inverse()), 0.06);
  EXPECT_GT(server.place(2)->covariance.trace(), server.place(1)->covariance.trace());
}

/// Both saw copies of one poster, in different places; then both see the same wall, which says otherwise.
TEST(MergeServer, AMeetingIsTakenBackWhenEvidenceTurnsAgainstIt) {
  const Rigid3 wall_of_a(kAsIs, {5.0, 0.0, 0.0});
  const Rigid3 wall_of_b(kAsIs, {-4.0, 2.0, 0.0});
  const core::Executor executor(2);
  MergeServer server({}, 4, executor);
  const auto events = drive(server, {Drive(0).along(5, 7, -0.35, {}).along(8, 12, -0.45, wall_of_a),
                                     Drive(1).along(5, 7, -0.3, {}).along(8, 12, -0.4, wall_of_b)});
  const auto met = of(events, MeetingStep::kMet);
  const auto back = of(events, MeetingStep::kTakenBack);
  ASSERT_GE(met.size(), 1U);
  ASSERT_GE(back.size(), 1U);
  EXPECT_LT(met[0].frame, back[0].frame);
  EXPECT_FALSE(back[0].evidence.refused.empty());
}

}  // namespace
}  // namespace plumbline::mapping
