// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
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

TEST_P(ExecutorThreads, WaitingDoesTheWorkWhenNobodyElseHas) {
  const Executor executor(GetParam());
  EXPECT_FALSE(Executor::Job().ready());
  std::vector<int> order;
  std::mutex mutex;
  const auto note = [&](int i) {
    const std::lock_guard<std::mutex> lock(mutex);
    order.push_back(i);
  };
  // Inside a loop the waiting thread takes up nothing else: with one thread only the wait itself can do it.
  executor.parallel_for(static_cast<std::size_t>(executor.threads()), [&](std::size_t i) {
    if (i != 0) return;
    Executor::Job job = executor.submit([&] { note(1); });
    job.wait();
    note(2);
  });
  EXPECT_EQ(order, (std::vector<int>{1, 2}));
}

TEST_P(ExecutorThreads, AJobMayUseAllThreadsItself) {
  const Executor executor(GetParam());
  std::vector<int> squares(100);
  Executor::Job job = executor.submit([&] {
    executor.parallel_for(squares.size(), [&](std::size_t i) { squares[i] = static_cast<int>(i * i); });
  });
  job.wait();
  EXPECT_EQ(squares.back(), 99 * 99);
}

TEST_P(ExecutorThreads, WorkOfALetGoJobIsDoneBeforeTheExecutorEnds) {
  std::atomic<int> done{0};
  {
    const Executor executor(GetParam());
    for (int i = 0; i < 50; ++i) {
      Executor::Job job = executor.submit([&] { ++done; });
      job = Executor::Job();
    }
    EXPECT_EQ(done.load(), 50);
  }
  EXPECT_EQ(done.load(), 50);
}

INSTANTIATE_TEST_SUITE_P(Threads, ExecutorThreads, testing::Values(1, 2, 5));

}  // namespace
}  // namespace plumbline::core
