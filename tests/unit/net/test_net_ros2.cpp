// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/net/ros2.hpp"

namespace plumbline::net {
namespace {

TEST(Ros2Address, SettingsAreTaken) {
  const auto address =
      parse_ros2_address("ros2://42?interface=lo&color=/a/image&depth=b/image&info=/a/info&peers=10.0.0.1,h");
  ASSERT_TRUE(address) << address.error().message;
  EXPECT_EQ(address->network.domain, 42);
  EXPECT_EQ(address->network.interface, "lo");
  EXPECT_EQ(address->network.peers, (std::vector<std::string>{"10.0.0.1", "h"}));
  EXPECT_EQ(address->topics.color, "/a/image");
  EXPECT_EQ(address->topics.depth, "/b/image") << "names of topics begin with a slash";
  EXPECT_EQ(address->topics.info, "/a/info");
}

TEST(Ros2Address, WhatIsWrongIsNamed) {
  const std::pair<const char*, const char*> wrong[] = {
      {"ros2://", "is not a domain"},          {"ros2://1a", "'1a' is not a domain"},
      {"ros2://-1?interface=lo", "--domain"},  {"ros2://1?colour=/a", "'colour' is not a setting"},
      {"ros2://1?color", "is not NAME=VALUE"}, {"ros2://1?interface=no such", "no interface"},
      {"http://1", "is not an address"}};
  for (const auto& [text, word] : wrong) {
    const auto address = parse_ros2_address(text);
    ASSERT_FALSE(address) << text;
    EXPECT_EQ(address.error().kind, core::ErrorKind::kUsage) << text;
    EXPECT_NE(address.error().message.find(word), std::string::npos) << address.error().message;
  }
}

}  // namespace
}  // namespace plumbline::net
