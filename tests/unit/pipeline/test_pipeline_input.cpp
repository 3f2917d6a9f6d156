// SPDX-License-Identifier: BSD-3-Clause
// A part of an input: the same frames with the same numbers, of whatever kind the input is.
#include <gtest/gtest.h>

#include <filesystem>

#include "plumbline/dataset/selection.hpp"
#include "plumbline/pipeline/input.hpp"

namespace plumbline::pipeline {
namespace {

const std::filesystem::path kScenes = std::filesystem::path(PLUMBLINE_SOURCE_DIR) / "pipelines" / "scenes";

std::vector<std::size_t> selected(double from_s, double to_s, int every) {
  dataset::OpenOptions options;
  options.from_s = from_s;
  options.to_s = to_s;
  options.every = every;
  return dataset::selected_frames("x", {10.0, 10.1, 10.2, 10.3, 10.4, 10.5}, options).value();
}

TEST(SelectedFrames, EveryNthBeginsWithTheFirstInside) {
  EXPECT_EQ(selected(0.0, 1e300, 1), (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(selected(0.0, 1e300, 4), (std::vector<std::size_t>{0, 4}));
  EXPECT_EQ(selected(0.05, 1e300, 2), (std::vector<std::size_t>{1, 3, 5}));
  EXPECT_EQ(selected(0.05, 0.25, 7), (std::vector<std::size_t>{1}));
}

TEST(Input, APartOfAGeneratedWorldIsNumberedFromZero) {
  const core::Executor executor(1);
  const auto log = core::null_log();
  const std::string url = "synth:structure?frames=9&fps=10&width=160&height=120";
  const auto whole = open_input(url, {}, kScenes, executor, *log);
  dataset::OpenOptions options;
  options.from_s = 0.15;
  options.every = 3;
  const auto part = open_input(url, options, kScenes, executor, *log);
  ASSERT_TRUE(whole) << whole.error().message;
  ASSERT_TRUE(part) << part.error().message;

  ASSERT_EQ((*part)->size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t original = 2 + 3 * i;
    EXPECT_EQ((*part)->info(i).stamp, (*whole)->info(original).stamp);
    const auto frame = (*part)->read(i);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->index, static_cast<std::int64_t>(i));
    EXPECT_EQ(frame->stamp, (*whole)->info(original).stamp);
  }

  options.from_s = 50.0;
  const auto nothing = open_input(url, options, kScenes, executor, *log);
  ASSERT_FALSE(nothing);
  EXPECT_NE(nothing.error().message.find("nothing lies after 50 s (--from); the recording ends at 0.80 s"),
            std::string::npos)
      << nothing.error().message;
}

}  // namespace
}  // namespace plumbline::pipeline
