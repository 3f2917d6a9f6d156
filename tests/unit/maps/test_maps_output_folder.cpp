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
  static void write(const fs::path& file) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << "";
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

TEST_F(OutputFolders, WhatAppearsMeanwhileIsKept) {
  const fs::path out = folder_ / "out";
  {
    auto run = OutputFolder::prepare(out, true);
    ASSERT_TRUE(run);
    fill(run->path(), "new");
    write(out / "notes.txt");
    const auto committed = run->commit();
    ASSERT_FALSE(committed);
    EXPECT_EQ(committed.error().kind, core::ErrorKind::kOutput);
    EXPECT_NE(committed.error().message.find("out.partial"), std::string::npos) << committed.error().message;
  }
  EXPECT_TRUE(fs::exists(out / "notes.txt"));
  EXPECT_EQ(text_of(folder_ / "out.partial"), "new");

  // Neither a new run nor one that is continued takes the place of the notes or drops the result.
  EXPECT_FALSE(OutputFolder::prepare(out, true));
  const auto finished = OutputFolder::finish(out, true);
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().kind, core::ErrorKind::kOutput);

  fs::rename(out, folder_ / "mine");
  const auto fresh = OutputFolder::prepare(out, false);
  ASSERT_FALSE(fresh);
  EXPECT_NE(fresh.error().message.find("holds a complete result"), std::string::npos)
      << fresh.error().message;
  ASSERT_EQ(OutputFolder::finish(out, false).value(), true);
  EXPECT_EQ(text_of(out), "new");
  EXPECT_FALSE(fs::exists(folder_ / "out.partial"));
}

TEST_F(OutputFolders, AResultThatAppearsMeanwhileIsNotReplacedUnasked) {
  auto run = OutputFolder::prepare(folder_ / "out", false);
  ASSERT_TRUE(run);
  fill(run->path(), "new");
  fs::create_directories(folder_ / "out");
  fill(folder_ / "out", "another's");
  ASSERT_FALSE(run->commit());
  EXPECT_EQ(text_of(folder_ / "out"), "another's");
}

TEST_F(OutputFolders, WhatUsersPutIntoAResultIsKept) {
  const fs::path out = folder_ / "out";
  fs::create_directories(out / "empty");
  fill(out, "earlier");
  write(out / "notes.txt");
  write(out / "photos/desk.jpg");
  write(out / "report.html");
  const auto refused = OutputFolder::prepare(out, true);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, core::ErrorKind::kUsage);
  EXPECT_NE(refused.error().message.find("empty/, notes.txt, photos/desk.jpg; move"), std::string::npos)
      << refused.error().message;

  for (const char* own : {"empty", "notes.txt", "photos"}) fs::remove_all(out / own);
  auto run = OutputFolder::prepare(out, true);
  ASSERT_TRUE(run) << run.error().message;
  fill(run->path(), "newer");
  write(out / "notes.txt");
  ASSERT_FALSE(run->commit());
  EXPECT_EQ(text_of(out), "earlier");
  EXPECT_TRUE(fs::exists(out / "notes.txt"));
}

TEST_F(OutputFolders, FilesThatTheRunAnnouncesAreItsOwn) {
  const fs::path out = folder_ / "out";
  for (const char* text : {"first", "second"}) {
    auto run = OutputFolder::prepare(out, true);
    ASSERT_TRUE(run) << run.error().message;
    ASSERT_TRUE(run->expect({"taps/*.png", "model/**", "map.ply"}));
    fill(run->path(), text);
    write(run->path() / "taps/000001.png");
    write(run->path() / "model/images/1.png");
    ASSERT_TRUE(run->commit());
    EXPECT_EQ(text_of(out), text);
  }
  EXPECT_FALSE(fs::exists(folder_ / "out.replaced"));

  write(out / "taps/000002.png");
  const auto refused = OutputFolder::prepare(out, true);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("taps/000002.png"), std::string::npos) << refused.error().message;
}

TEST_F(OutputFolders, WhatUsersPutIntoAnInterruptedRunIsKept) {
  const fs::path partial = folder_ / "out.partial";
  write(partial / ".plumbline-unfinished");
  write(partial / "map.db");
  write(partial / "notes.txt");
  const auto refused = OutputFolder::prepare(folder_ / "out", true);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("notes.txt"), std::string::npos) << refused.error().message;
  EXPECT_TRUE(fs::exists(partial / "map.db"));
  {
    auto failed = OutputFolder::prepare(folder_ / "other", false);
    ASSERT_TRUE(failed);
    write(failed->path() / "map.ply");
    write(failed->path() / "notes.txt");
  }
  EXPECT_FALSE(fs::exists(folder_ / "other.partial/map.ply"));
  EXPECT_TRUE(fs::exists(folder_ / "other.partial/notes.txt"));
}

/// The states in which a run that replaces an earlier result can be killed, in order.
class KilledCommits : public OutputFolders, public testing::WithParamInterface<const char*> {
 protected:
  KilledCommits() {
    const std::string state = GetParam();
    const fs::path partial = folder_ / "out.partial", old = folder_ / "out.replaced";
    const bool moved = state != "marked" && state != "earlier marked";
    fs::create_directories(moved ? old : out_);
    fill(moved ? old : out_, "earlier");
    if (state != "marked") write(moved ? old / ".plumbline-replaced" : out_ / ".plumbline-replaced");

    const bool renamed = state == "renamed" || state == "half removed" || state == "removed";
    fs::create_directories(renamed ? out_ : partial);
    fill(renamed ? out_ : partial, "newer");
    std::ofstream((renamed ? out_ : partial) / ".plumbline-files") << "# replaces an earlier result\n";

    if (state == "half removed" || state == "removed") {
      write(old / ".plumbline-unfinished");
      fs::remove(old / "config.yaml");
      if (state == "removed") fs::remove(old / "summary.json");
    }
  }
  const fs::path out_ = folder_ / "out";
};

TEST_P(KilledCommits, AreFinished) {
  const auto finished = OutputFolder::finish(out_, false);
  ASSERT_TRUE(finished) << finished.error().message;
  EXPECT_TRUE(*finished);
  EXPECT_EQ(text_of(out_), "newer");
  EXPECT_EQ(std::distance(fs::directory_iterator(out_), {}), 2) << "without markers";
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_P(KilledCommits, AreToldToANewRun) {
  const auto run = OutputFolder::prepare(out_, false);
  ASSERT_FALSE(run);
  EXPECT_EQ(run.error().kind, core::ErrorKind::kUsage);
  EXPECT_NE(run.error().message.find("--force"), std::string::npos) << run.error().message;
  EXPECT_EQ(run.error().message.find("is in the way"), std::string::npos) << run.error().message;
  EXPECT_TRUE(is_result_folder(out_)) << "the earlier one is where it was, or the new one";
}

TEST_P(KilledCommits, AreReplacedWhenAskedFor) {
  {
    auto run = OutputFolder::prepare(out_, true);
    ASSERT_TRUE(run) << run.error().message;
    EXPECT_TRUE(is_result_folder(out_)) << "until the new one is complete";
    fill(run->path(), "newest");
    ASSERT_TRUE(run->commit());
  }
  EXPECT_EQ(text_of(out_), "newest");
  EXPECT_EQ(std::distance(fs::directory_iterator(out_), {}), 2);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

INSTANTIATE_TEST_SUITE_P(States, KilledCommits,
                         testing::Values("marked", "earlier marked", "earlier moved", "renamed",
                                         "half removed", "removed"));

TEST_F(OutputFolders, ACompleteResultWithoutMarkerIsRecognised) {
  fs::create_directories(folder_ / "out.partial");
  fill(folder_ / "out.partial", "newer");
  const auto fresh = OutputFolder::prepare(folder_ / "out", false);
  ASSERT_FALSE(fresh);
  EXPECT_NE(fresh.error().message.find("holds a complete result"), std::string::npos)
      << fresh.error().message;
  ASSERT_EQ(OutputFolder::finish(folder_ / "out", false).value(), true);
  EXPECT_EQ(text_of(folder_ / "out"), "newer");
}

TEST_F(OutputFolders, AFolderThatAUserHasNamedReplacedIsLeftAlone) {
  const fs::path mine = folder_ / "out.replaced";
  fs::create_directories(mine);
  fill(mine, "mine");
  for (const char* text : {"first", "second"}) {
    auto run = OutputFolder::prepare(folder_ / "out", true);
    if (std::string(text) == "second") {
      ASSERT_FALSE(run);
      EXPECT_NE(run.error().message.find("out.replaced: is in the way"), std::string::npos);
      break;
    }
    ASSERT_TRUE(run) << run.error().message;
    fill(run->path(), text);
    ASSERT_TRUE(run->commit());
  }
  EXPECT_EQ(text_of(mine), "mine");
  EXPECT_EQ(text_of(folder_ / "out"), "first");
}

TEST_F(OutputFolders, WhoseFolderVanishesAreOutputErrors) {
  const fs::path partial = folder_ / "out.partial";
  {
    auto run = OutputFolder::prepare(folder_ / "out", false);
    ASSERT_TRUE(run);
    EXPECT_EQ(run->explained({core::ErrorKind::kInput, "something else"}).message, "something else");
    fs::rename(partial, folder_ / "moved");
    write(partial / "map.ply");  // a user's
    const core::Error why = run->explained({core::ErrorKind::kInput, "map.db: no such file"});
    EXPECT_EQ(why.kind, core::ErrorKind::kOutput);
    EXPECT_NE(why.message.find("was removed or moved away"), std::string::npos) << why.message;
    const auto committed = run->commit();
    ASSERT_FALSE(committed);
    EXPECT_EQ(committed.error().kind, core::ErrorKind::kOutput);
  }
  EXPECT_TRUE(fs::exists(partial / "map.ply"));
  EXPECT_TRUE(fs::exists(folder_ / "moved"));
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
