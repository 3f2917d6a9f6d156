// SPDX-License-Identifier: BSD-3-Clause
// The store as a run writes it: step by step, only what came and what changed.
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/cloud/compact/compact_cloud.hpp"
#include "plumbline/maps/store.hpp"
#include "store_folder.hpp"
#include "store_world.hpp"

namespace plumbline::maps {
namespace {

using tests::equal;
using tests::header_of;
using tests::same_all;
using tests::StoreFolder;
using tests::StoreWorld;

std::shared_ptr<const std::vector<std::uint8_t>> stored_cloud(int points) {
  cloud::Cloud cloud;
  for (int i = 0; i < points; ++i) {
    cloud::Point p;
    p.x = 0.01F * static_cast<float>(i);
    p.z = 2.0F;
    cloud.push_back(p);
  }
  return std::make_shared<std::vector<std::uint8_t>>(cloud::encode_cloud(cloud));
}

/// Follows a world as the stages of a run do.
class Follower {
 public:
  explicit Follower(StoreWorld& world) : world_(world) {}

  StoreStep step() {
    StoreStep step;
    const KeyframeId id = world_.step();
    step.map = std::make_shared<MapChanges>(world_.map.changes_since(moment_));
    moment_ = world_.map.now();
    step.frames.assign(world_.frames.begin() + static_cast<std::ptrdiff_t>(frames_), world_.frames.end());
    for (std::size_t f = frames_; f < world_.frames.size(); ++f) {
      step.log.push_back(std::to_string(f) + ",tracked,0.1,\"ä\"");
      log.push_back(step.log.back());
    }
    frames_ = world_.frames.size();
    step.clouds.push_back({id, {}, stored_cloud(id.index + 1)});
    frame_clouds.push_back(world_.frame_id(frames_ - 2));
    step.clouds.push_back({{}, frame_clouds.back(), stored_cloud(500 + id.index)});
    return step;
  }
  void go_on() { moment_ = world_.map.now(); }

  std::vector<std::string> log;
  std::vector<FrameId> frame_clouds;

 private:
  StoreWorld& world_;
  MapRevision moment_;
  std::size_t frames_ = 0;
};

TEST(StoreSteps, EachLeavesTheMapInEveryBit) {
  const StoreFolder folder;
  StoreWorld world(21);
  Follower follower(world);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer) << writer.error().message;
  for (int i = 0; i < 25; ++i) {
    const auto added = writer->add(follower.step());
    ASSERT_TRUE(added) << added.error().message;
    const auto stored = load_map(folder.file());
    ASSERT_TRUE(stored) << i << ": " << stored.error().message;
    ASSERT_TRUE(equal(stored->map, world.map)) << "after " << i;
    ASSERT_TRUE(same_all(stored->frames, world.frames_by_robot())) << "after " << i;
    ASSERT_EQ(stored->log, follower.log) << "after " << i;
    ASSERT_FALSE(stored->complete);
  }
  ASSERT_GT(world.map.point_ids().back().index, 70) << "one page proves nothing";
  const auto reader = StoreReader::open(folder.file());
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->cloud(follower.frame_clouds.front()).value()->size(), 500U);
  EXPECT_EQ(reader->cloud(FrameId{0, 100000}).error().kind, core::ErrorKind::kInput);
  std::sort(follower.frame_clouds.begin(), follower.frame_clouds.end());
  EXPECT_EQ(reader->frame_cloud_ids().value(), follower.frame_clouds);
  const StoreContents contents = reader->contents().value();
  EXPECT_EQ(contents.keyframes, world.map.keyframe_count());
  EXPECT_EQ(contents.points, world.map.point_count());
  EXPECT_EQ(contents.lines, world.map.line_count());
  EXPECT_EQ(contents.edges, world.map.edges().size());
  ASSERT_FALSE(world.map.loops().empty());
  EXPECT_EQ(contents.loops, world.map.loops().size());
  EXPECT_EQ(contents.frames, world.frames.size());
  EXPECT_EQ(contents.keyframe_clouds, 25U);
  EXPECT_EQ(contents.frame_clouds, follower.frame_clouds.size());
  EXPECT_GT(contents.cloud_bytes, 1000U);
  EXPECT_FALSE(contents.complete);
}

TEST(StoreSteps, AMapThatWasMadeAnewBringsItsFramesAnew) {
  const StoreFolder folder;
  StoreWorld world(24);
  Follower follower(world);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer) << writer.error().message;

  // Frames saw landmarks of a first map.
  StoreStep first = follower.step();
  for (FramePose& frame : first.frames) {
    frame.seen = std::make_shared<SeenPoints>(SeenPoints{0.0, {{core::PointId{0, 7}, {1.0F, 2.0F}, 3.0F}}});
  }
  ASSERT_TRUE(writer->add(first));
  ASSERT_NE(load_map(folder.file())->frames.front().seen, nullptr);

  StoreStep anew = follower.step();
  anew.robot = 0;
  anew.frames = world.frames;
  anew.frames_anew = true;
  for (FramePose& frame : anew.frames) frame.camera_from_reference.translation.x() += 0.01;
  ASSERT_TRUE(writer->add(anew));

  const auto stored = load_map(folder.file());
  ASSERT_TRUE(stored) << stored.error().message;
  ASSERT_TRUE(same_all(stored->frames, anew.frames));
  for (const FramePose& frame : stored->frames) EXPECT_EQ(frame.seen, nullptr);
}

TEST(StoreSteps, ChangesAreFewWhenLittleChanged) {
  StoreWorld world(22);
  for (int i = 0; i < 30; ++i) world.step();
  const MapChanges all = world.map.changes_since({});
  EXPECT_TRUE(all.whole);
  ASSERT_GT(all.points.size(), 3U);
  const MapRevision moment = world.map.now();
  const MapChanges none = world.map.changes_since(moment);
  EXPECT_FALSE(none.whole);
  EXPECT_TRUE(none.points.empty() && none.lines.empty() && none.edges.empty());
  EXPECT_EQ(none.keyframes.size(), world.map.keyframe_count());
  const PointId moved = world.map.point_ids().front();
  world.map.point(moved).position.x() += 1.0;
  const MapChanges one = world.map.changes_since(moment);
  ASSERT_EQ(one.points.size(), 1U);
  EXPECT_EQ(one.points[0].landmarks.front().position, world.map.point(moved).position);
}

TEST(StoreSteps, GoOnAfterTheRunWasEnded) {
  const StoreFolder folder;
  StoreWorld world(23);
  Follower follower(world);
  {
    auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
    ASSERT_TRUE(writer);
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(writer->add(follower.step()));
  }
  auto left = load_map(folder.file());
  ASSERT_TRUE(left);
  world.map = std::move(left->map);  // what a run that goes on begins with
  follower.go_on();
  auto writer = StoreWriter::resume(folder.file());
  ASSERT_TRUE(writer) << writer.error().message;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(writer->add(follower.step()));
    const auto stored = load_map(folder.file());
    ASSERT_TRUE(stored) << stored.error().message;
    ASSERT_TRUE(equal(stored->map, world.map)) << i;
    ASSERT_TRUE(same_all(stored->frames, world.frames_by_robot()));
    ASSERT_EQ(stored->log, follower.log);
  }
}

TEST(StoreSteps, TheEndKeepsTheRestAndTheFrameOfTheResults) {
  const StoreFolder folder;
  StoreWorld world(24);
  Follower follower(world);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(writer->add(follower.step()));
  EXPECT_EQ(load_map(folder.file())->result.output_from_map.translation, Eigen::Vector3d::Zero());
  ResultFrame frame;
  frame.output_from_map = tests::Random(5).pose(1.0, 1.0);
  frame.upright = true;
  StoreStep rest;
  rest.log = {"last"};
  rest.clouds.push_back({{}, {0, 0}, stored_cloud(7)});
  const auto saved = writer->save_final(world.map, world.frames, frame, {rest});
  ASSERT_TRUE(saved) << saved.error().message;
  const auto stored = load_map(folder.file());
  ASSERT_TRUE(stored) << stored.error().message;
  EXPECT_TRUE(stored->complete);
  EXPECT_TRUE(stored->result.upright);
  EXPECT_EQ(stored->result.output_from_map.rotation, frame.output_from_map.rotation);
  EXPECT_EQ(stored->result.output_from_map.translation, frame.output_from_map.translation);
  EXPECT_EQ(stored->log.back(), "last");
  EXPECT_EQ(StoreReader::open(folder.file())->cloud(FrameId{0, 0}).value()->size(), 7U);
}

TEST(StoreSteps, RobotsHaveMapsOfTheirOwnUntilTheyAreOne) {
  const StoreFolder folder;
  StoreWorld worlds[2] = {StoreWorld(27), StoreWorld(28)};
  worlds[1].camera.color.width = 320;
  StoreHeader header = header_of(worlds[0].camera);
  header.robots.push_back({1, "b", worlds[1].camera});
  worlds[0].other_robot = 0;
  worlds[1].first_robot = worlds[1].other_robot = 1;
  Follower followers[2] = {Follower(worlds[0]), Follower(worlds[1])};
  std::optional<StoreWriter> writer(StoreWriter::create(folder.file(), header).value());
  for (int i = 0; i < 12; ++i) {
    const int robot = i % 3 == 0 ? 1 : 0;
    StoreStep step = followers[robot].step();
    step.robot = robot;
    ASSERT_TRUE(writer->add(step));
    if (i == 0) continue;
    const auto stored = StoreReader::open(folder.file())->load_each();
    ASSERT_TRUE(stored) << stored.error().message;
    ASSERT_EQ(stored->size(), 2U);
    for (std::size_t r = 0; r < 2; ++r) {
      EXPECT_TRUE(equal((*stored)[r].map, worlds[r].map)) << i;
      EXPECT_TRUE(same_all((*stored)[r].frames, worlds[r].frames));
      EXPECT_EQ((*stored)[r].log, followers[r].log);
    }
  }
  const auto two = load_map(folder.file());
  EXPECT_EQ(two.error().kind, core::ErrorKind::kInput);
  EXPECT_NE(two.error().message.find("are not merged yet"), std::string::npos) << two.error().message;
  const auto second = StoreReader::open(folder.file())->load("b");
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_TRUE(equal(second->map, worlds[1].map));
  EXPECT_FALSE(StoreReader::open(folder.file())->load("c"));
  StoreWorld both(29);
  both.other_robot = 1;
  for (int i = 0; i < 6; ++i) both.step();
  const std::vector<RobotInfo> robots{{0, "a", both.camera}, {1, "c", both.camera}};
  writer.reset();  // keyframes with other contents under the same ids: only who opens the store looks at them
  writer.emplace(StoreWriter::resume(folder.file()).value());
  ASSERT_TRUE(writer->save_final(both.map, both.frames, {}, {}, robots));
  const auto one = load_map(folder.file());
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_TRUE(equal(one->map, both.map));
  EXPECT_TRUE(same_all(one->frames, both.frames_by_robot()));
  EXPECT_EQ(one->header.robots.back().name, "c");
  EXPECT_EQ(one->log.size(), followers[0].log.size() + followers[1].log.size());
}

TEST(StoreSteps, SameStepsSameBytes) {
  std::string bytes[2];
  for (std::string& file : bytes) {
    const StoreFolder folder;
    StoreWorld world(25);
    Follower follower(world);
    {
      auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
      ASSERT_TRUE(writer);
      for (int i = 0; i < 8; ++i) ASSERT_TRUE(writer->add(follower.step()));
      ASSERT_TRUE(writer->save_final(world.map, world.frames));
    }
    std::ifstream in(folder.file(), std::ios::binary);
    file = {std::istreambuf_iterator<char>(in), {}};
  }
  EXPECT_GT(bytes[0].size(), 10000U);
  EXPECT_TRUE(bytes[0] == bytes[1]);
}

TEST(StoreSteps, ABlankStoreIsKnownAsOne) {
  const StoreFolder folder;
  EXPECT_FALSE(is_blank_store(folder.file()));
  std::ofstream(folder.file()).close();
  EXPECT_TRUE(is_blank_store(folder.file()).value()) << "an empty file: the run ended as it made it";
  std::filesystem::remove(folder.file());
  StoreWorld world(26);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer);
  EXPECT_FALSE(is_blank_store(folder.file()).value());
  const std::filesystem::path other = folder.path / "other.db";
  std::ofstream(other) << std::string(5000, 'x');
  EXPECT_FALSE(is_blank_store(other));
}

}  // namespace
}  // namespace plumbline::maps
