// SPDX-License-Identifier: BSD-3-Clause
// The bounds of JSON that others wrote, and JSON of names that are not UTF-8.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "plumbline/core/json.hpp"

namespace plumbline::core {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;
using Json = nlohmann::ordered_json;

std::string repeated(const std::string& text, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

std::string problem_of(const std::string& text) {
  const auto read = parse_json(text, "a.json");
  return read ? "" : read.error().message;
}

TEST(ReadJson, KeepsValuesAndTheirOrder) {
  const auto read =
      parse_json(R"({"z": [1, 2.5, -3], "a": {"b": null, "c": "\u00e4"}, "z": true})", "a.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(json_text(*read, -1), "{\"z\":true,\"a\":{\"b\":null,\"c\":\"\xc3\xa4\"}}");
}

TEST(ReadJson, DepthIsBounded) {
  EXPECT_EQ(problem_of(repeated("[", 64) + repeated("]", 64)), "");
  EXPECT_THAT(problem_of(repeated("[", 65) + repeated("]", 65)), StartsWith("a.json:1:65: "));
  EXPECT_THAT(problem_of("\n" + repeated("[{\"a\":\n", 40)), StartsWith("a.json:34:1: "));
  EXPECT_THAT(problem_of(repeated("[", 1000000)), HasSubstr("nested deeper than 64 levels"));
  EXPECT_THAT(problem_of(repeated("{\"a\":", 200000)), HasSubstr("nested deeper than 64 levels"));
  EXPECT_EQ(problem_of("[" + repeated("[[[]]],", 10000) + "1]"), "") << "many side by side are not deep";
}

TEST(ReadJson, SizeAndKeysAreBounded) {
  const auto object_of = [](int keys) {
    std::string text = "{";
    for (int i = 0; i < keys; ++i) text += "\"" + std::to_string(i) + "\":0,";
    return text + "\"last\":0}";
  };
  EXPECT_EQ(problem_of(object_of(999)), "");
  EXPECT_THAT(problem_of(object_of(1000)), HasSubstr("more than 1000 keys"));
  EXPECT_THAT(problem_of(std::string(JsonLimits::kBytes + 1, ' ')), HasSubstr("more than 64 MB"));
}

TEST(ReadJson, WhatIsNoJsonIsToldWithItsPlace) {
  for (const char* text : {"", " ", "{", "[1,]", "nul", "1 2", "\"\xff\"", "NaN", "1e999", "{\"a\":1,}"})
    EXPECT_THAT(problem_of(text), testing::MatchesRegex("a.json:1:[0-9]+: is not valid JSON")) << text;
  EXPECT_EQ(problem_of("{\"a\": 1,\n \"b\": x}"), "a.json:2:7: is not valid JSON");
}

TEST(ReadJson, OfAFile) {
  const fs::path file = fs::path(testing::TempDir()) / ("core_json_" + std::to_string(getpid()) + ".json");
  EXPECT_THAT(read_json(file).error().message, HasSubstr("no such file"));
  EXPECT_FALSE(read_json(fs::path(testing::TempDir())));
  std::ofstream(file) << "{\"a\": [1, 2]}";
  const auto read = read_json(file);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ((*read)["a"][1], 2);
  std::ofstream(file) << "{\"a\": ";
  EXPECT_EQ(read_json(file).error().kind, ErrorKind::kInput);
  EXPECT_THAT(read_json(file).error().message, StartsWith(file.string() + ":1:"));
  fs::remove(file);
}

TEST(JsonText, IsValidForAnyName) {
  const Json named = {{"name", "a\xff\x1b[2J\n"}};
  EXPECT_EQ(json_text(named, -1), "{\"name\":\"a\xef\xbf\xbd\\u001b[2J\\n\"}");
  EXPECT_EQ(json_text(Json{{"a", 1}}), "{\n  \"a\": 1\n}\n");
}

}  // namespace
}  // namespace plumbline::core
