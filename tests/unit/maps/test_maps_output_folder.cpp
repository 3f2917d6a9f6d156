// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "plumbline/maps/output_folder.hpp"

namespace plumbline::maps {
namespace {

namespace fs = std::filesystem;

class OutputFolders : public testing::Test {
 protected:
  OutputFolders() : folder_(fs::path(testing::TempDir()) / ("plumbline_output_" + std::to_string(getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~OutputFolders() override { fs::remove_all(folder_); }
  static void fill(const fs::path& path, const std::string& text) {
    for (const char* file : {"summary.json", "config.yaml"}) std::ofstream(path / file) << text;
  }
  static std::string text_of(const fs::path& path) {
    std::string text;
    std::ifstream(path / "summary.json") >> text;
    return text;
  }
  fs::path folder_;
};

TEST_F(OutputFolders, AppearWholeOrNotAtAll) {
  const fs::path out = folder_ / "deep" / "out";
  {
    auto abandoned = OutputFolder::prepare(out, false);
    ASSERT_TRUE(abandoned) << abandoned.error().message;
    fill(abandoned->path(), "half");
    EXPECT_FALSE(fs::exists(out));
  }
  EXPECT_TRUE(fs::is_empty(folder_ / "deep"));
  auto kept = OutputFolder::prepare(out, false);
  ASSERT_TRUE(kept);
  fill(kept->path(), "whole");
  ASSERT_TRUE(kept->commit());
  EXPECT_EQ(text_of(out), "whole");
  EXPECT_EQ(std::distance(fs::directory_iterator(out), {}), 2);
  EXPECT_TRUE(is_result_folder(out));

  EXPECT_EQ(OutputFolder::prepare(out, false).error().kind, core::ErrorKind::kUsage);
  auto again = OutputFolder::prepare(out, true);
  ASSERT_TRUE(again);
  fill(again->path(), "newer");
  EXPECT_EQ(text_of(out), "whole");
  ASSERT_TRUE(again->commit());
  EXPECT_EQ(text_of(out), "newer");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "deep"), {}), 1);
}

TEST_F(OutputFolders, TwoRunsDoNotShareOne) {
  const auto first = OutputFolder::prepare(folder_ / "out", false);
  ASSERT_TRUE(first);
  fill(first->path(), "first");
  const auto second = OutputFolder::prepare(folder_ / "out", true);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another run is writing there"), std::string::npos);
  EXPECT_EQ(text_of(first->path()), "first");
}

TEST_F(OutputFolders, WhatAKilledRunLeftIsClearedAway) {
  fs::create_directories(folder_ / "out.partial");
  std::ofstream(folder_ / "out.partial" / ".plumbline-unfinished") << "x";
  std::ofstream(folder_ / "out.partial" / "map.ply") << "half";
  const auto out = OutputFolder::prepare(folder_ / "out", false);
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_FALSE(fs::exists(out->path() / "map.ply"));
}

TEST_F(OutputFolders, WhatAKilledRunLeftIsTakenOver) {
  fs::create_directories(folder_ / "out.partial");
  std::ofstream(folder_ / "out.partial" / ".plumbline-unfinished") << "x";
  std::ofstream(folder_ / "out.partial" / "map.db") << "half";
  {
    const auto out = OutputFolder::prepare(folder_ / "out", false, true);
    ASSERT_TRUE(out) << out.error().message;
    EXPECT_EQ(out->path(), OutputFolder::partial_of(folder_ / "out"));
    EXPECT_TRUE(fs::exists(out->path() / "map.db"));
    EXPECT_FALSE(OutputFolder::prepare(folder_ / "out", false, true)) << "one at a time";
  }
  EXPECT_TRUE(fs::exists(folder_ / "out.partial" / "map.db")) << "it failed, and the next one may go on";
  const auto fresh = OutputFolder::prepare(folder_ / "out", false);
  ASSERT_FALSE(fresh);
  EXPECT_NE(fresh.error().message.find("--resume continues it, --force drops it"), std::string::npos);
  EXPECT_TRUE(fs::exists(folder_ / "out.partial" / "map.db"));
  auto out = OutputFolder::prepare(folder_ / "out", false, true);
  ASSERT_TRUE(out) << out.error().message;
  ASSERT_TRUE(out->commit());
  EXPECT_TRUE(fs::exists(folder_ / "out" / "map.db"));
  EXPECT_FALSE(fs::exists(folder_ / "out.partial"));
  EXPECT_FALSE(fs::exists(folder_ / "out" / ".plumbline-unfinished"));
}

TEST_F(OutputFolders, WhatIsNobodysIsNotTakenOver) {
  fs::create_directories(folder_ / "out.partial");
  std::ofstream(folder_ / "out.partial" / "thesis.txt") << "x";
  EXPECT_EQ(OutputFolder::prepare(folder_ / "out", false, true).error().kind, core::ErrorKind::kUsage);
  EXPECT_TRUE(fs::exists(folder_ / "out.partial" / "thesis.txt"));
  const auto fresh = OutputFolder::prepare(folder_ / "other", false, true);
  ASSERT_TRUE(fresh) << "nothing there is no error";
}

TEST_F(OutputFolders, CanBeKeptWithoutCommit) {
  {
    auto out = OutputFolder::prepare(folder_ / "out", false);
    ASSERT_TRUE(out);
    std::ofstream(out->path() / "map.db") << "half";
    out->keep();
  }
  EXPECT_TRUE(fs::exists(folder_ / "out.partial" / "map.db"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(OutputFolders, PlacesThatCannotBeWrittenAreOutputErrors) {
  EXPECT_EQ(OutputFolder::prepare("/proc/nothing", false).error().kind, core::ErrorKind::kOutput);
  std::ofstream(folder_ / "file") << "x";
  EXPECT_EQ(OutputFolder::prepare(folder_ / "file" / "out", false).error().kind, core::ErrorKind::kOutput);
  EXPECT_EQ(OutputFolder::prepare(folder_ / "file", true).error().kind, core::ErrorKind::kUsage);
  EXPECT_EQ(OutputFolder::prepare("", false).error().kind, core::ErrorKind::kUsage);
}

}  // namespace
}  // namespace plumbline::maps
