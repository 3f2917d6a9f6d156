// SPDX-License-Identifier: BSD-3-Clause
// What strangers may send a hub: it names them, and the others notice nothing.
#include <random>

#include "bus.hpp"
#include "network/network_test.hpp"
#include "plumbline/core/hash.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/maps/store_replica.hpp"

namespace plumbline::integration {
namespace {

using net::Answer;
using net::Chunk;
using net::HubStatus;
using net::RobotBus;
using net::RobotStatus;

class Strangers : public NetworkTest {
 protected:
  [[nodiscard]] std::unique_ptr<RobotBus> bus(const std::string& name) const {
    net::NetworkOptions options;
    options.interface = "lo";
    options.domain = 1 + getpid() % 200;
    auto opened = net::open_robot_bus(options, name, {});
    EXPECT_TRUE(opened) << opened.error().message;
    return opened ? std::move(*opened) : nullptr;
  }
  static RobotStatus status_of(const std::string& name) {
    RobotStatus status;
    status.store_format = maps::kStoreFormat;
    status.name = name;
    status.run = "0123456789abcdef";
    status.incarnation = 1;
    status.heads_at_start = {0};
    status.map_head = 100;
    status.clouds_head = 100;
    return status;
  }
  /// What the hub says to this robot, at the latest after some seconds.
  static std::optional<HubStatus> answer(RobotBus& robot, const RobotStatus& status, double seconds = 20.0) {
    std::optional<HubStatus> found;
    happens(
        [&] {
          robot.publish(status);
          robot.wait(std::chrono::milliseconds(100));
          for (const HubStatus& hub : robot.poll_hub()) {
            if (hub.robot == status.name && hub.incarnation == status.incarnation) found = hub;
          }
          return found.has_value();
        },
        seconds);
    return found;
  }
  static std::uint64_t hash(const std::vector<std::uint8_t>& bytes) {
    core::Hash hash;
    hash.bytes(bytes.data(), bytes.size());
    return hash.value();
  }
  static Chunk chunk_of(const RobotStatus& status, const maps::StoreTransaction& one, std::int64_t after) {
    Chunk chunk;
    chunk.name = status.name;
    chunk.run = status.run;
    chunk.incarnation = status.incarnation;
    chunk.after = after;
    chunk.number = one.number;
    chunk.count = 1;
    chunk.bytes = one.rows;
    chunk.hash = chunk.checksum = hash(chunk.bytes);
    return chunk;
  }
};

TEST_F(Strangers, ChangedMessagesDoNoHarm) {
  Process h = hub(" --robots 3");
  const auto evil = bus("evil");
  ASSERT_NE(evil, nullptr);
  Process a = robot("a");
  Process b = robot("b");
  std::vector<maps::StoreTransaction> real;
  std::int64_t after = 0;
  while (auto next = maps::next_transaction(world("a/map.db"), maps::StoreStream::kMap, after).value()) {
    after = next->number;
    real.push_back(*next);
  }
  ASSERT_GT(real.size(), 2U);
  std::mt19937 random(7);
  RobotStatus status = status_of("evil");
  int refused = 0;
  for (int round = 0; round < 120; ++round) {
    ++status.incarnation;
    status.heads_at_start = {0};
    const auto admitted = answer(*evil, status);
    ASSERT_TRUE(admitted) << h.told();
    ASSERT_TRUE(happens([&] { return evil->has_reader(); }, 20.0));
    std::int64_t held = admitted->map_held;
    for (int k = 0; k < 8; ++k) {  // about 1000 in all
      const auto next =
          std::find_if(real.begin(), real.end(), [&](const auto& t) { return t.number > held; });
      if (next == real.end()) break;
      maps::StoreTransaction one = *next;
      const auto changes = random() % 4;
      for (auto i = changes; i > 0; --i)
        one.rows[random() % one.rows.size()] = static_cast<std::uint8_t>(random());
      Chunk chunk = chunk_of(status, one, held);
      const auto field = random() % 12;
      if (field == 0) chunk.number = static_cast<std::int64_t>(random()) << 31U;
      if (field == 1) chunk.stream = static_cast<std::uint8_t>(random());
      if (field == 2) chunk.count = static_cast<std::uint32_t>(random());
      if (field == 3) chunk.index = static_cast<std::uint32_t>(random());
      if (field == 4) chunk.hash = random();
      if (field == 5) chunk.after = -1;
      if (field == 6) chunk.name = "a";
      if (field == 7) chunk.protocol = 99;
      happens([&] { return evil->send(chunk); }, 20.0);
    }
    const auto told = answer(*evil, status);
    ASSERT_TRUE(told) << h.told();
    refused += told->answer == Answer::kRefused ? 1 : 0;
  }
  EXPECT_GT(refused, 30);
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told();
  ASSERT_EQ(b.wait(kLong_s), 0) << b.told();
  EXPECT_NE(h.told().find("evil sent data that Plumbline"), std::string::npos) << h.told();
  h.send(SIGINT);
  const int code = h.wait(kLong_s);
  EXPECT_TRUE(code == 4 || code == 3) << h.told();  // what evil left loads or does not, but is told
}

TEST_F(Strangers, OtherVersionsNamesAndIncarnationsAreTold) {
  Process h = hub(" --robots 1");
  const auto robot_x = bus("x");
  ASSERT_NE(robot_x, nullptr);
  RobotStatus old = status_of("x");
  old.store_format = 5;
  const auto version = answer(*robot_x, old);
  ASSERT_TRUE(version) << h.told();
  EXPECT_EQ(version->answer, Answer::kRefused);
  EXPECT_NE(version->problem.find("use the same version on both"), std::string::npos);
  RobotStatus foreign = status_of("y");  // in the partition of x
  EXPECT_FALSE(answer(*robot_x, foreign, 2.0));
  RobotStatus wild = status_of("../../x");
  EXPECT_FALSE(answer(*robot_x, wild, 2.0));
  const RobotStatus good = status_of("x");
  EXPECT_EQ(answer(*robot_x, good)->answer, Answer::kAccepted);
  RobotStatus later = good;
  later.incarnation = 2;
  later.heads_at_start = {0, 50};
  EXPECT_EQ(answer(*robot_x, later)->answer, Answer::kAccepted);
  EXPECT_FALSE(answer(*robot_x, good, 2.0)) << "the process before is not listened to any more";
  EXPECT_TRUE(happens([&] { return h.told().find("an invalid name") != std::string::npos; }, 5.0));
  EXPECT_TRUE(happens([&] { return h.told().find("in the name of y") != std::string::npos; }, 5.0));
  EXPECT_FALSE(fs::exists(path("out.partial/robots/y")));
}

TEST_F(Strangers, WhatARobotLostIsAskedForAgain) {
  Process h = hub(" --robots 1");
  const auto robot_x = bus("x");
  ASSERT_NE(robot_x, nullptr);
  RobotStatus status = status_of("x");
  ASSERT_TRUE(answer(*robot_x, status));
  ASSERT_TRUE(happens([&] { return robot_x->has_reader(); }, 20.0));
  const auto first = maps::next_transaction(world("a/map.db"), maps::StoreStream::kMap, 0).value();
  ASSERT_TRUE(first);
  ASSERT_TRUE(happens([&] { return robot_x->send(chunk_of(status, *first, 0)); }, 20.0));
  ASSERT_TRUE(happens([&] { return answer(*robot_x, status)->map_held == first->number; }, 20.0)) << h.told();
  status.incarnation = 2;  // it had not even that when it heads_at_start
  status.heads_at_start = {0, 0};
  EXPECT_EQ(answer(*robot_x, status)->map_held, 0) << h.told();
  EXPECT_NE(h.told().find("everything is requested again"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::integration
