// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "plumbline/viz/color.hpp"

namespace plumbline::viz {
namespace {

TEST(Color, SequentialMapIsClampedAndGreyWithoutValue) {
  EXPECT_EQ(sequential_color(-1.0), sequential_color(0.0));
  EXPECT_EQ(sequential_color(2.0), sequential_color(1.0));
  const Rgb none = sequential_color(std::nan(""));
  EXPECT_EQ(none.r, none.g);
  EXPECT_EQ(none.g, none.b);
  // Lightness rises along the map, which is what makes it readable in print.
  int last = -1;
  for (int i = 0; i <= 20; ++i) {
    const Rgb c = sequential_color(i / 20.0);
    const int lightness = 2126 * c.r + 7152 * c.g + 722 * c.b;
    EXPECT_GT(lightness, last);
    last = lightness;
  }
}

TEST(Color, CategoriesDifferAndRepeat) {
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(category_color(i), category_color(j));
    EXPECT_EQ(category_color(i), category_color(i + 8));
  }
}

}  // namespace
}  // namespace plumbline::viz
