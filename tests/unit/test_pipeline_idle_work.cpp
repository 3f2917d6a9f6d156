// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <vector>

#include "../../src/pipeline/idle_work.hpp"

namespace plumbline::pipeline {
namespace {

constexpr std::size_t kPieces = 200;

TEST(IdleWork, DoesEachPieceOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 4}) {
    const core::Executor executor(threads);
    std::vector<std::atomic<int>> done(kPieces);
    IdleWork work(
        kPieces, [&](std::size_t i) { ++done[i]; }, executor);
    work.finish();
    EXPECT_TRUE(std::all_of(done.begin(), done.end(), [](const auto& d) { return d == 1; })) << threads;
    work.finish();
    EXPECT_TRUE(std::all_of(done.begin(), done.end(), [](const auto& d) { return d == 1; })) << "again";
  }
}

TEST(IdleWork, LeavesUndoneWhatNobodyWaitsFor) {
  const core::Executor executor(2);
  std::atomic<int> begun{0};
  std::atomic<int> ended{0};
  {
    const IdleWork work(
        kPieces,
        [&](std::size_t) {
          ++begun;
          ++ended;
        },
        executor);
  }
  const int after = begun;
  EXPECT_EQ(after, ended) << "nothing is under way any more";
  executor.parallel_for(50, [](std::size_t) {});
  EXPECT_EQ(begun, after);
}

TEST(IdleWork, NothingToDoIsDone) {
  const core::Executor executor(2);
  IdleWork work(
      0, [](std::size_t) { FAIL(); }, executor);
  work.finish();
}

}  // namespace
}  // namespace plumbline::pipeline
