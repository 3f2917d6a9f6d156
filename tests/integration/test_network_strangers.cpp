// SPDX-License-Identifier: BSD-3-Clause
// What strangers may send a hub: it names them, and the others notice nothing.
#include <random>

#include "bus.hpp"
#include "network_test.hpp"
#include "plumbline/core/hash.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/maps/store_replica.hpp"

namespace plumbline::integration {
namespace {

using net::Answer;
using net::Hello;
using net::Piece;
using net::RobotBus;
using net::Word;

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
  static Hello hello_of(const std::string& name) {
    Hello hello;
    hello.store_format = maps::kStoreFormat;
    hello.name = name;
    hello.run = "0123456789abcdef";
    hello.incarnation = 1;
    hello.began = {0};
    hello.map_head = 100;
    hello.clouds_head = 100;
    return hello;
  }
  /// What the hub says to this robot, at the latest after some seconds.
  static std::optional<Word> answer(RobotBus& robot, const Hello& hello, double seconds = 20.0) {
    std::optional<Word> found;
    happens(
        [&] {
          robot.say(hello);
          robot.wait(std::chrono::milliseconds(100));
          for (const Word& word : robot.hear()) {
            if (word.robot == hello.name && word.incarnation == hello.incarnation) found = word;
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
  static Piece piece_of(const Hello& hello, const maps::StoreTransaction& one, std::int64_t after) {
    Piece piece;
    piece.name = hello.name;
    piece.run = hello.run;
    piece.incarnation = hello.incarnation;
    piece.after = after;
    piece.number = one.number;
    piece.count = 1;
    piece.bytes = one.rows;
    piece.hash = piece.edition = hash(piece.bytes);
    return piece;
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
  while (auto next = maps::next_transaction(world("a/map.db"), maps::StoreShare::kMap, after).value()) {
    after = next->number;
    real.push_back(*next);
  }
  ASSERT_GT(real.size(), 2U);
  std::mt19937 random(7);
  Hello hello = hello_of("evil");
  int refused = 0;
  for (int round = 0; round < 120; ++round) {
    ++hello.incarnation;
    hello.began = {0};
    const auto let_in = answer(*evil, hello);
    ASSERT_TRUE(let_in) << h.told();
    ASSERT_TRUE(happens([&] { return evil->listened_to(); }, 20.0));
    std::int64_t held = let_in->map;
    for (int k = 0; k < 8; ++k) {  // about 1000 in all
      const auto next =
          std::find_if(real.begin(), real.end(), [&](const auto& t) { return t.number > held; });
      if (next == real.end()) break;
      maps::StoreTransaction one = *next;
      const auto changes = random() % 4;
      for (auto i = changes; i > 0; --i)
        one.rows[random() % one.rows.size()] = static_cast<std::uint8_t>(random());
      Piece piece = piece_of(hello, one, held);
      const auto field = random() % 12;
      if (field == 0) piece.number = static_cast<std::int64_t>(random()) << 31U;
      if (field == 1) piece.share = static_cast<std::uint8_t>(random());
      if (field == 2) piece.count = static_cast<std::uint32_t>(random());
      if (field == 3) piece.index = static_cast<std::uint32_t>(random());
      if (field == 4) piece.hash = random();
      if (field == 5) piece.after = -1;
      if (field == 6) piece.name = "a";
      if (field == 7) piece.protocol = 99;
      happens([&] { return evil->send(piece); }, 20.0);
    }
    const auto told = answer(*evil, hello);
    ASSERT_TRUE(told) << h.told();
    refused += told->answer == Answer::kRefused ? 1 : 0;
  }
  EXPECT_GT(refused, 30);
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told();
  ASSERT_EQ(b.wait(kLong_s), 0) << b.told();
  EXPECT_NE(h.told().find("evil sent what no map of Plumbline"), std::string::npos) << h.told();
  h.send(SIGINT);
  const int code = h.wait(kLong_s);
  EXPECT_TRUE(code == 4 || code == 3) << h.told();  // what evil left loads or does not, but is told
}

TEST_F(Strangers, OtherVersionsNamesAndIncarnationsAreTold) {
  Process h = hub(" --robots 1");
  const auto robot_x = bus("x");
  ASSERT_NE(robot_x, nullptr);
  Hello old = hello_of("x");
  old.store_format = 5;
  const auto version = answer(*robot_x, old);
  ASSERT_TRUE(version) << h.told();
  EXPECT_EQ(version->answer, Answer::kRefused);
  EXPECT_NE(version->problem.find("use the same on both"), std::string::npos);
  Hello foreign = hello_of("y");  // in the partition of x
  EXPECT_FALSE(answer(*robot_x, foreign, 2.0));
  Hello wild = hello_of("../../x");
  EXPECT_FALSE(answer(*robot_x, wild, 2.0));
  const Hello good = hello_of("x");
  EXPECT_EQ(answer(*robot_x, good)->answer, Answer::kAccepted);
  Hello later = good;
  later.incarnation = 2;
  later.began = {0, 50};
  EXPECT_EQ(answer(*robot_x, later)->answer, Answer::kAccepted);
  EXPECT_FALSE(answer(*robot_x, good, 2.0)) << "the process before is not listened to any more";
  EXPECT_TRUE(happens([&] { return h.told().find("a name that cannot be") != std::string::npos; }, 5.0));
  EXPECT_TRUE(happens([&] { return h.told().find("somebody who is not y") != std::string::npos; }, 5.0));
  EXPECT_FALSE(fs::exists(path("out.partial/robots/y")));
}

TEST_F(Strangers, WhatARobotLostIsAskedForAgain) {
  Process h = hub(" --robots 1");
  const auto robot_x = bus("x");
  ASSERT_NE(robot_x, nullptr);
  Hello hello = hello_of("x");
  ASSERT_TRUE(answer(*robot_x, hello));
  ASSERT_TRUE(happens([&] { return robot_x->listened_to(); }, 20.0));
  const auto first = maps::next_transaction(world("a/map.db"), maps::StoreShare::kMap, 0).value();
  ASSERT_TRUE(first);
  ASSERT_TRUE(happens([&] { return robot_x->send(piece_of(hello, *first, 0)); }, 20.0));
  ASSERT_TRUE(happens([&] { return answer(*robot_x, hello)->map == first->number; }, 20.0)) << h.told();
  hello.incarnation = 2;  // it had not even that when it began
  hello.began = {0, 0};
  EXPECT_EQ(answer(*robot_x, hello)->map, 0) << h.told();
  EXPECT_NE(h.told().find("everything is asked for again"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::integration
