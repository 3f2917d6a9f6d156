// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "plumbline/core/numbers.hpp"

namespace plumbline::core {
namespace {

TEST(Numbers, LeastMedianOfFewValuesIsLower) {
  EXPECT_EQ(least_median(std::vector<double>{7.0}), 7.0);
  EXPECT_EQ(least_median(std::vector<double>{1.0, 2.0, 3.0, 4.0}), 2.0);
  std::vector<double> many;
  for (int i = 0; i <= 10000; ++i) many.push_back(i);
  EXPECT_NEAR(least_median(many), 4950.0, 1.0);
  EXPECT_EQ(least_median(std::vector<double>{}, -1.0), -1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(least_median(std::vector<double>{nan, 3.0}), 3.0);
}

}  // namespace
}  // namespace plumbline::core
