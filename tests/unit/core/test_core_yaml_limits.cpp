// SPDX-License-Identifier: BSD-3-Clause
// Files made to cost time or memory: each ends at once, with a message.
#include <gtest/gtest.h>

#include <chrono>

#include "plumbline/core/config.hpp"

namespace plumbline::core {
namespace {

std::string repeated(const std::string& piece, int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += piece;
  return text;
}

/// The message, or "" when the text is taken.
std::string told(const std::string& text) {
  const auto start = std::chrono::steady_clock::now();
  const auto node = parse_yaml(text, "t.yaml");
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  EXPECT_LT(spent.count(), 8.0) << text.substr(0, 40);
  return node ? "" : node.error().message;
}

TEST(YamlLimits, ManyKeysAreComparedQuickly) {
  std::string text;
  for (int i = 0; i < 49000; ++i) text += "k" + std::to_string(i) + ":\n";
  EXPECT_EQ(told(text), "");
  EXPECT_NE(told(text + "k7: 1\n").find("t.yaml:49001:1: k7: the key is given twice (first in line 8)"),
            std::string::npos);
}

TEST(YamlLimits, AnchorsWithinAnchorsCountAsOftenAsTheyAreKept) {
  std::string text = repeated("- x\n", 9000);
  std::string nested = "[" + repeated("x, ", 9000) + "x]";
  for (int i = 0; i < 15; ++i) nested = "&a" + std::to_string(i) + " [\n" + nested + "]";
  EXPECT_NE(told(nested).find("too many values after alias expansion"), std::string::npos) << told(nested);
  EXPECT_EQ(told(text), "");
}

TEST(YamlLimits, LinesAndBracketsWithoutEnd) {
  EXPECT_EQ(told(std::string(900000, '[')), "t.yaml:1:1001: over 1000 brackets are open here");
  EXPECT_EQ(told(repeated("{a:\n", 200000)), "t.yaml:1001:1: over 1000 brackets are open here");
  EXPECT_EQ(told("a: [" + repeated("[], ", 200000) + "]"),
            "t.yaml:1:100001: the line is over 100000 characters long");
  EXPECT_EQ(told("a: " + std::string(90000, 'b')), "");
}

}  // namespace
}  // namespace plumbline::core
