// SPDX-License-Identifier: BSD-3-Clause
// What may be said on the command line about a network, and what is made of it.
#include <gtest/gtest.h>

#include "plumbline/net/keys.hpp"
#include "plumbline/net/options.hpp"

namespace plumbline::net {
namespace {

std::string refusal(const NetworkOptions& options, bool hub = false) {
  const auto made = checked(options, hub);
  if (made) return "it was taken";
  EXPECT_EQ(made.error().kind, core::ErrorKind::kUsage);
  return made.error().message;
}

TEST(NetworkOptions, NamesAreFoldersAndTextOnTerminals) {
  for (const char* name : {"r0", "R", "0", "a.b_c-d", "robot-12.left"})
    EXPECT_TRUE(is_robot_name(name)) << name;
  for (const char* name : {"", ".", "..", "../x", "-r", "_hub", "a/b", "a b", "a\n", "ä", "*"}) {
    EXPECT_FALSE(is_robot_name(name)) << name;
  }
  EXPECT_TRUE(is_robot_name(std::string(64, 'a')));
  EXPECT_FALSE(is_robot_name(std::string(65, 'a')));
}

TEST(NetworkOptions, AreMadeWhole) {
  NetworkOptions options;
  const auto automatic = checked(options, true);
  ASSERT_TRUE(automatic) << automatic.error().message;
  EXPECT_FALSE(automatic->interface.empty());
  options.interface = "lo";
  options.transport = Transport::kTcp;
  options.peers = {"laptop", "10.0.0.1:99"};
  const auto tcp = checked(options, false);
  ASSERT_TRUE(tcp) << tcp.error().message;
  EXPECT_EQ(tcp->port, 7500);
  EXPECT_EQ(tcp->peers, (std::vector<std::string>{"laptop:7500", "10.0.0.1:99"}));
}

TEST(NetworkOptions, WhatCannotBeIsRefusedByName) {
  NetworkOptions options;
  options.interface = "lo";
  options.domain = 231;
  EXPECT_EQ(refusal(options).rfind("--domain", 0), 0U);
  options.domain = 0;
  options.port = -1;
  EXPECT_EQ(refusal(options).rfind("--port", 0), 0U);
  options.port = 0;
  options.peers = {"\"/><Internal>"};  // would be XML
  EXPECT_EQ(refusal(options).rfind("--peers", 0), 0U);
  options.peers = {"${HOME}"};  // would be read from the environment
  EXPECT_EQ(refusal(options).rfind("--peers", 0), 0U);
  options.peers.clear();
  options.transport = Transport::kTcp;
  EXPECT_EQ(refusal(options).rfind("--transport", 0), 0U);
  EXPECT_TRUE(checked(options, true)) << "a hub is called";
  options.interface = "no such";
  EXPECT_EQ(refusal(options, true).rfind("--interface", 0), 0U);
}

}  // namespace
}  // namespace plumbline::net
