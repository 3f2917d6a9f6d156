// SPDX-License-Identifier: BSD-3-Clause
// A copy of a store, told transaction by transaction, and what a stranger may tell it.
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "hot_journal.hpp"
#include "plumbline/cloud/compact/compact_cloud.hpp"
#include "plumbline/maps/map_join.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "store_dump.hpp"
#include "store_folder.hpp"
#include "store_world.hpp"

namespace plumbline::maps {
namespace {

using tests::dump;
using tests::equal;
using tests::header_of;
using tests::StoreFolder;
using tests::StoreWorld;

std::vector<std::uint8_t> small_cloud(int points) {
  cloud::Cloud cloud;
  for (int i = 0; i < points; ++i) {
    cloud::Point p;
    p.x = 0.01F * static_cast<float>(i);
    p.z = 2.0F;
    cloud.push_back(p);
  }
  return cloud::encode_cloud(cloud);
}

core::Result<void> take_one(StoreReplica& copy, StoreStream stream, const StoreTransaction& one,
                            std::size_t piece) {
  if (auto begun = copy.begin(stream, one.number); !begun) return begun;
  for (std::size_t at = 0; at < one.rows.size(); at += piece) {
    const std::size_t size = std::min(piece, one.rows.size() - at);
    if (auto taken = copy.append(one.rows.data() + at, size); !taken) return taken;
  }
  return copy.commit();
}

/// Tells the copy what it lacks; how many transactions that were.
int follow(const std::filesystem::path& store, StoreReplica& copy, std::size_t piece = 1000) {
  int count = 0;
  for (const StoreStream stream : kStoreStreams) {
    while (true) {
      const auto next = next_transaction(store, stream, copy.heads()[stream]);
      if (!next || !*next) {
        EXPECT_TRUE(next) << next.error().message;
        break;
      }
      const auto taken = take_one(copy, stream, **next, piece);
      EXPECT_TRUE(taken) << taken.error().message;
      if (!taken) break;
      ++count;
    }
  }
  return count;
}

TEST(StoreReplica, HoldsTheSameRowsWheneverItCaughtUp) {
  const StoreFolder folder;
  const auto copied = folder.path / "copy.db";
  StoreWorld world(31);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer) << writer.error().message;
  auto copy = StoreReplica::open(copied);
  ASSERT_TRUE(copy) << copy.error().message;

  for (int i = 0; i < 24; ++i) {
    const KeyframeId id = world.step();  // landmarks come and go
    for (const PointId p : world.map.point_ids()) {
      if (i == 15 && p.robot == 0 && p.index < 64) world.map.remove(p);  // a row goes
    }
    ASSERT_TRUE(writer->add_keyframe(world.map, id, small_cloud(i), world.frames));
    if (i % 5 != 0) continue;
    follow(folder.file(), *copy, 100 + static_cast<std::size_t>(i) * 97);
    ASSERT_EQ(dump(copied), dump(folder.file())) << "after " << i;
    ASSERT_EQ(copy->keyframes(), world.map.keyframe_count());
    ASSERT_FALSE(copy->complete());
  }

  ASSERT_TRUE(writer->attach("robots", {1, 2, 3}));
  ASSERT_TRUE(writer->save_final(world.map, world.frames));
  EXPECT_GT(follow(folder.file(), *copy), 2);
  EXPECT_EQ(dump(copied), dump(folder.file()));
  EXPECT_TRUE(copy->complete());
  const auto removed = dump(folder.file());
  EXPECT_TRUE(std::any_of(removed.begin(), removed.end(), [](const std::string& line) {
    return line.rfind("removed|", 0) == 0;
  })) << "the world is too simple";

  EXPECT_EQ(store_heads(folder.file())->map, copy->heads().map);
  EXPECT_EQ(store_heads(folder.file())->clouds, copy->heads().clouds);
  EXPECT_EQ(follow(folder.file(), *copy), 0) << "there is nothing more to tell";

  const auto stored = load_map(copied);
  ASSERT_TRUE(stored) << stored.error().message;
  EXPECT_TRUE(equal(stored->map, world.map));
  EXPECT_TRUE(equal(copy->map().map()->map, world.map)) << "what it decoded as the rows came";
  EXPECT_GT(copy->bytes().place, 0U);
  EXPECT_GT(copy->bytes().map, 0U);
  EXPECT_GT(copy->bytes().cloud, 0U);
}

TEST(MapFollower, GivesItsOnlyRobotAnotherNumber) {
  for (const int other : {0, 3}) {
    const StoreFolder folder;
    StoreWorld world(33);
    world.other_robot = other;
    auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
    ASSERT_TRUE(writer) << writer.error().message;
    auto copy = StoreReplica::open(folder.path / "copy.db");
    ASSERT_TRUE(copy) << copy.error().message;
    for (int i = 0; i < 6; ++i)
      ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), small_cloud(i), world.frames));
    follow(folder.file(), *copy);

    const auto map = copy->map().map(7);
    ASSERT_EQ(map.has_value(), other == 0) << "of several robots none has another number";
    EXPECT_TRUE(equal(copy->map().map()->map, world.map));
    if (!map) continue;
    EXPECT_TRUE(equal(map->map, renumbered(world.map, {{0, 7}})));
    EXPECT_EQ(map->frames.front().reference.robot, 7);
  }
}

TEST(MapFollower, HasTheMapOfTheStoreAtEachMomentAndKeepsWhatItDecoded) {
  const StoreFolder folder;
  StoreWorld world(36);
  world.other_robot = world.first_robot;
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer) << writer.error().message;
  MapFollower follower;
  std::vector<Map> earlier;
  int kept = 0;
  for (int i = 0; i < 24; ++i) {
    ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), small_cloud(i), world.frames));
    if (i % 5 == 1) continue;  // several at once
    while (const auto next = next_transaction(folder.file(), StoreStream::kMap, follower.head()).value()) {
      ASSERT_TRUE(follower.apply(*next));
    }

    const auto map = follower.map();
    ASSERT_TRUE(map) << map.error().message;
    ASSERT_TRUE(equal(map->map, world.map)) << "after " << i;
    ASSERT_TRUE(equal(load_map(folder.file())->map, world.map)) << "after " << i;
    EXPECT_EQ(map->header.robots.front().camera.name, world.camera.name);
    EXPECT_EQ(follower.head(), store_heads(folder.file())->map);

    const KeyframeId id = world.map.keyframe_ids().front();
    if (!earlier.empty() && earlier.back().has_keyframe(id))
      kept += &earlier.back().keyframe(id) == &map->map.keyframe(id) ? 1 : 0;
    earlier.push_back(map->map);
  }
  EXPECT_GT(kept, 10) << "keyframes are decoded again";

  MapFollower late;
  const auto last = next_transaction(folder.file(), StoreStream::kMap, 3).value();
  ASSERT_TRUE(last);
  EXPECT_EQ(late.apply(*last).error().kind, core::ErrorKind::kInput) << "the camera came before it";
  EXPECT_EQ(late.apply({9, {1, 2, 3}}).error().kind, core::ErrorKind::kInput);
}

TEST(StoreReplica, OneThatComesLateIsToldLess) {
  const StoreFolder folder;
  StoreWorld world(32);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer);
  auto early = StoreReplica::open(folder.path / "early.db");
  auto late = StoreReplica::open(folder.path / "late.db");
  ASSERT_TRUE(early && late);
  for (int i = 0; i < 15; ++i) {
    ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), small_cloud(5), world.frames));
    follow(folder.file(), *early);
  }
  follow(folder.file(), *late);
  EXPECT_EQ(dump(folder.path / "early.db"), dump(folder.path / "late.db"));
  EXPECT_LT(late->bytes().map, early->bytes().map);
}

TEST(StoreReplica, HasWhatIsKnownOfTheCamerasAsItsStore) {
  const StoreFolder folder;
  StoreWorld world(36);
  StoreStep step;
  world.step();
  step.map = std::make_shared<MapChanges>(world.map.changes_since({}));
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add(step));
  ASSERT_TRUE(load_map(folder.file())) << "as an earlier program made it, without the row";
  EXPECT_FALSE(load_map(folder.file())->header.robots.front().estimate);

  // It comes with a step, before the camera is used.
  std::vector<RobotInfo> robots = header_of(world.camera).robots;
  CameraEstimate& known = robots.front().estimate.emplace();
  known = {51, 207, 1, 44, true, 0.125, "", "a doubt", world.camera};
  known.found.color.fx = 517.25;
  known.covariance = Eigen::Matrix<double, 9, 9>::Identity() * 0.25;
  known.covariance(0, 8) = known.covariance(8, 0) = -0.125;
  known.wrong[5] = 0.75;
  robots.front().camera.sigma.fx = 1.5;  // as its file tells
  robots.front().camera.sigma.readout_s = 2e-4;
  step.robots = std::make_shared<std::vector<RobotInfo>>(robots);
  ASSERT_TRUE(writer->add(step));
  auto copy = StoreReplica::open(folder.path / "copy.db");
  ASSERT_TRUE(copy);
  follow(folder.file(), *copy);
  for (const char* file : {"map.db", "copy.db"}) {
    const auto stored = load_map(folder.path / file);
    ASSERT_TRUE(stored) << stored.error().message;
    const RobotInfo& robot = stored->header.robots.front();
    ASSERT_TRUE(robot.estimate && robot.versions.empty()) << file;
    EXPECT_EQ(robot.estimate->asked_at, 51);
    EXPECT_EQ(robot.estimate->used_from, 207);
    EXPECT_EQ(robot.estimate->views, 44);
    EXPECT_TRUE(robot.estimate->better);
    EXPECT_EQ(robot.estimate->doubt, "a doubt");
    EXPECT_EQ(robot.estimate->found.color.fx, 517.25);
    EXPECT_EQ(robot.estimate->covariance, known.covariance);
    EXPECT_EQ(robot.estimate->wrong, known.wrong);
    for (const sensor::Camera& camera : {robot.camera, robot.estimate->found}) {
      EXPECT_EQ(camera.sigma.fx, 1.5);
      EXPECT_EQ(camera.sigma.readout_s, 2e-4);
    }
  }
  EXPECT_EQ(dump(folder.path / "copy.db"), dump(folder.file()));

  // A stranger's nonsense is refused.
  robots.front().estimate->covariance(3, 3) = -1.0;
  step.robots = std::make_shared<std::vector<RobotInfo>>(robots);
  ASSERT_TRUE(writer->add(step));
  const auto next = next_transaction(folder.file(), StoreStream::kMap, copy->heads().map);
  ASSERT_TRUE(next && *next);
  EXPECT_FALSE(take_one(*copy, StoreStream::kMap, **next, 1000));
}

TEST(StoreReplica, GoesOnWhereItWasCommitted) {
  const StoreFolder folder;
  const auto copied = folder.path / "copy.db";
  StoreWorld world(33);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer);
  for (int i = 0; i < 6; ++i) {
    ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), small_cloud(5), world.frames));
  }
  StoreHeads before;
  {
    auto copy = StoreReplica::open(copied);
    ASSERT_TRUE(copy);
    const auto first = next_transaction(folder.file(), StoreStream::kMap, 0);
    ASSERT_TRUE(first && *first);
    ASSERT_TRUE(take_one(*copy, StoreStream::kMap, **first, 500));
    before = copy->heads();
    const auto second = next_transaction(folder.file(), StoreStream::kMap, before.map);
    ASSERT_TRUE(second && *second);
    ASSERT_TRUE(copy->begin(StoreStream::kMap, (*second)->number));
    ASSERT_TRUE(copy->append((*second)->rows.data(), (*second)->rows.size() / 2));
    const std::size_t keyframes = copy->map().map()->map.keyframe_count();
    EXPECT_EQ(copy->commit().error().kind, core::ErrorKind::kInput) << "half a row";
    EXPECT_EQ(copy->map().map()->map.keyframe_count(), keyframes) << "nothing of half a transaction";
  }
  auto copy = StoreReplica::open(copied);
  ASSERT_TRUE(copy);
  EXPECT_TRUE(equal(copy->map().map()->map, load_map(copied)->map)) << "rows that were there before";
  EXPECT_EQ(copy->heads().map, before.map);
  EXPECT_EQ(copy->begin(StoreStream::kMap, before.map).error().kind, core::ErrorKind::kInput);
  follow(folder.file(), *copy);
  EXPECT_EQ(dump(copied), dump(folder.file()));
  const MapFollower before_it_is_emptied = copy->map();
  ASSERT_TRUE(copy->clear());
  EXPECT_EQ(copy->heads().last(), 0);
  EXPECT_EQ(copy->map().map()->map.keyframe_count(), 0U);
  EXPECT_TRUE(equal(before_it_is_emptied.map()->map, world.map)) << "a map that was taken stays";
  follow(folder.file(), *copy);
  EXPECT_EQ(dump(copied), dump(folder.file()));
}

TEST(StoreReplica, MutatedRowsAreRefusedAndDoNoHarm) {
  const StoreFolder folder;
  StoreWorld world(34);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer);
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), small_cloud(30), world.frames));
  }
  std::vector<std::pair<StoreStream, StoreTransaction>> all;
  for (const StoreStream stream : kStoreStreams) {
    std::int64_t after = 0;
    while (auto next = next_transaction(folder.file(), stream, after).value()) {
      after = next->number;
      all.emplace_back(stream, *next);
    }
  }
  std::mt19937 random(5);
  int refused = 0;
  for (int round = 0; round < 300; ++round) {
    const auto copied = folder.path / "mutated.db";
    std::filesystem::remove(copied);
    auto copy = StoreReplica::open(copied);
    ASSERT_TRUE(copy);
    for (auto [stream, one] : all) {
      for (auto k = random() % 3; k > 0; --k) {
        const std::size_t at = random() % one.rows.size();
        if (random() % 2 == 0) {
          one.rows[at] = static_cast<std::uint8_t>(random());
        } else {
          one.rows.erase(one.rows.begin() + static_cast<std::ptrdiff_t>(at));
        }
      }
      const auto taken = take_one(*copy, stream, one, 5000);
      if (taken) continue;
      ++refused;
      EXPECT_EQ(taken.error().kind, core::ErrorKind::kInput) << taken.error().message;
    }
    const auto stored = load_map(copied);  // may be refused, must not harm
    (void)stored;
  }
  EXPECT_GT(refused, 500);
}

TEST(Ledger, KeepsTexts) {
  const StoreFolder folder;
  const Ledger ledger(folder.path / "network.db");
  EXPECT_TRUE(ledger.all()->empty());
  ASSERT_TRUE(ledger.put({{"run", "7f"}, {"hub", "a'; DROP TABLE text"}}));
  ASSERT_TRUE(ledger.put({{"run", "80"}}));
  const std::map<std::string, std::string> kept{{"run", "80"}, {"hub", "a'; DROP TABLE text"}};
  EXPECT_EQ(ledger.all().value(), kept);
  EXPECT_EQ(Ledger(folder.path / "none" / "network.db").put({{"a", "b"}}).error().kind,
            core::ErrorKind::kOutput);
  StoreWorld world(35);
  { ASSERT_TRUE(StoreWriter::create(folder.file(), header_of(world.camera))); }
  EXPECT_FALSE(Ledger(folder.file()).put({{"a", "b"}})) << "it would spoil a map";
}

TEST(Ledger, IsReadAfterItsWriterWasKilled) {
  const StoreFolder folder;
  const std::map<std::string, std::string> kept{{"run", "7f"}, {"hub", "ab"}};
  ASSERT_TRUE(Ledger(folder.path / "network.db").put(kept));
  tests::copy_with_hot_journal(folder.path / "network.db", folder.path / "left.db");

  const Ledger left(folder.path / "left.db");
  const auto texts = left.all();
  ASSERT_TRUE(texts) << texts.error().message;
  EXPECT_EQ(*texts, kept) << "the transaction that was not committed is rolled back";
  ASSERT_TRUE(left.put({{"run", "80"}}));
  EXPECT_EQ(left.all()->at("run"), "80");
}

TEST(Ledger, IsEmptyIfItsWriterWasKilledBeforeTheFirstCommit) {
  const StoreFolder folder;
  std::ofstream(folder.path / "network.db").flush();
  const auto texts = Ledger(folder.path / "network.db").all();
  ASSERT_TRUE(texts) << texts.error().message;
  EXPECT_TRUE(texts->empty());
  EXPECT_TRUE(Ledger(folder.path / "network.db").put({{"run", "7f"}}));
}

}  // namespace
}  // namespace plumbline::maps
