// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

#include "plumbline/core/crew.hpp"

namespace plumbline::core {
namespace {

TEST(Crew, DoesEverythingOnceInManyShortLoops) {
  for (const int threads : {1, 2, 5}) {
    const Executor executor(threads);
    Crew crew(&executor);
    std::vector<int> times(1000, 0);
    for (int loop = 0; loop < 2000; ++loop) {
      const std::size_t count = static_cast<std::size_t>(loop) % times.size();
      std::fill(times.begin(), times.end(), 0);
      crew.each(count, 7, [&](std::size_t i) { ++times[i]; });
      ASSERT_EQ(std::accumulate(times.begin(), times.end(), 0), static_cast<int>(count)) << loop;
      ASSERT_TRUE(count == 0 || *std::max_element(times.begin(), times.end()) == 1) << loop;
    }
  }
}

TEST(Crew, WorksAloneWithoutAnExecutor) {
  Crew crew(nullptr);
  int sum = 0;
  crew.each(10, 1, [&](std::size_t i) { sum += static_cast<int>(i); });
  EXPECT_EQ(sum, 45);
}

TEST(Crew, HelpersComeBackAfterAPause) {
  const Executor executor(2);
  Crew crew(&executor);
  for (int loop = 0; loop < 5; ++loop) {
    std::vector<int> seen(64, 0);
    crew.each(seen.size(), 1, [&](std::size_t i) { seen[i] = loop + 1; });
    EXPECT_EQ(std::count(seen.begin(), seen.end(), loop + 1), 64);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  // The executor's threads are free again for others, while the crew is there.
  int others = 0;
  executor.submit([&] { ++others; }).wait();
  EXPECT_EQ(others, 1);
}

TEST(Crew, RethrowsAndGoesOn) {
  const Executor executor(3);
  Crew crew(&executor);
  EXPECT_THROW(crew.each(100, 1,
                         [](std::size_t i) {
                           if (i == 57) throw std::runtime_error("here");
                         }),
               std::runtime_error);
  std::vector<int> seen(100, 0);
  crew.each(100, 3, [&](std::size_t i) { seen[i] = 1; });
  EXPECT_EQ(std::accumulate(seen.begin(), seen.end(), 0), 100);
}

TEST(Crew, WithinWorkOfTheExecutorItself) {
  const Executor executor(2);
  std::vector<int> sums(4, 0);
  executor.parallel_for(sums.size(), [&](std::size_t k) {
    Crew crew(&executor);
    std::vector<int> seen(50, 0);
    for (int loop = 0; loop < 20; ++loop) crew.each(seen.size(), 2, [&](std::size_t i) { ++seen[i]; });
    sums[k] = std::accumulate(seen.begin(), seen.end(), 0);
  });
  EXPECT_EQ(sums, std::vector<int>(4, 1000));
}

}  // namespace
}  // namespace plumbline::core
