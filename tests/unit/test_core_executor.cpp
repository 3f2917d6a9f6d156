// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "plumbline/core/executor.hpp"

namespace plumbline::core {
namespace {

class ExecutorThreads : public testing::TestWithParam<int> {};

TEST_P(ExecutorThreads, EveryIndexIsVisitedOnce) {
  const Executor executor(GetParam());
  EXPECT_EQ(executor.threads(), GetParam());
  std::vector<std::atomic<int>> visits(1000);
  executor.parallel_for(visits.size(), [&](std::size_t i) { ++visits[i]; });
  for (const auto& v : visits) EXPECT_EQ(v.load(), 1);
  executor.parallel_for(0, [](std::size_t) { FAIL(); });
}

TEST_P(ExecutorThreads, ExceptionsReachTheCaller) {
  const Executor executor(GetParam());
  const auto body = [](std::size_t i) {
    if (i == 7) throw std::runtime_error("seven");
  };
  EXPECT_THROW(executor.parallel_for(20, body), std::runtime_error);
  Executor::Job job = executor.submit([] { throw std::runtime_error("later"); });
  EXPECT_THROW(job.wait(), std::runtime_error);
}

TEST_P(ExecutorThreads, JobsAreDoneWhenWaitedForOrDestroyed) {
  const Executor executor(GetParam());
  std::atomic<int> done{0};
  {
    Executor::Job first = executor.submit([&] { ++done; });
    ASSERT_TRUE(first.valid());
    first.wait();
    EXPECT_EQ(done.load(), 1);
    EXPECT_FALSE(first.valid());
    Executor::Job second = executor.submit([&] { ++done; });
  }
  EXPECT_EQ(done.load(), 2);
}

INSTANTIATE_TEST_SUITE_P(Threads, ExecutorThreads, testing::Values(1, 2, 5));

}  // namespace
}  // namespace plumbline::core
