// SPDX-License-Identifier: BSD-3-Clause
// Images of a live camera, paired as they come.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "layout.hpp"
#include "live/stamp_pairs.hpp"

namespace plumbline::dataset {
namespace {

constexpr double kGap_s = 0.02;

StampPairs::Stamped at_ms(double ms) { return {std::llround(ms * 1e6), 0, std::make_shared<const Bytes>()}; }

double seconds(const StampPairs::Stamped& image) { return seconds_of(image.stamp_ns); }

std::vector<StampPairs::Pair> all_of(StampPairs& pairs, bool at_end) {
  std::vector<StampPairs::Pair> found;
  while (auto pair = pairs.next(at_end)) found.push_back(*pair);
  return found;
}

TEST(StampPairs, SameStampsArePairedAtOnce) {
  StampPairs pairs(kGap_s, 0.0);
  pairs.add_color(at_ms(1000.0));
  EXPECT_TRUE(all_of(pairs, false).empty());
  pairs.add_depth(at_ms(1000.0));
  EXPECT_EQ(all_of(pairs, false).size(), 1U);
  EXPECT_EQ(pairs.unpaired(), 0U);
}

TEST(StampPairs, WaitsUntilNothingNearerCanCome) {
  StampPairs pairs(kGap_s, 0.0);
  pairs.add_color(at_ms(1000.0));
  pairs.add_depth(at_ms(990.0));
  EXPECT_TRUE(all_of(pairs, false).empty()) << "a depth at 1005 ms would be nearer";
  pairs.add_depth(at_ms(1005.0));
  EXPECT_TRUE(all_of(pairs, false).empty()) << "a colour at 1006 ms would be nearer to that";
  pairs.add_color(at_ms(1033.0));
  const auto found = all_of(pairs, false);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().depth.stamp_ns, at_ms(1005.0).stamp_ns);
  EXPECT_EQ(pairs.unpaired(), 1U) << "the depth at 990 ms";
}

TEST(StampPairs, WhatIsAloneIsLeftOut) {
  StampPairs pairs(kGap_s, 0.0);
  pairs.add_color(at_ms(1000.0));
  pairs.add_depth(at_ms(1100.0));
  pairs.add_color(at_ms(1100.0));
  EXPECT_EQ(all_of(pairs, false).size(), 1U);
  EXPECT_EQ(pairs.unpaired(), 1U);
}

TEST(StampPairs, DelayOfDepthCounts) {
  StampPairs pairs(kGap_s, 0.015);
  pairs.add_color(at_ms(1015.0));
  pairs.add_depth(at_ms(1000.0));
  EXPECT_EQ(all_of(pairs, false).size(), 1U);
}

TEST(StampPairs, OneKindAloneTakesNoMemory) {
  StampPairs pairs(kGap_s, 0.0);
  for (int i = 0; i < 1000; ++i) pairs.add_color(at_ms(33.3 * i));
  EXPECT_TRUE(all_of(pairs, false).empty());
  EXPECT_GT(pairs.unpaired(), 900U);
}

/// Whatever came besides: of the images of the pairs alone, pair_by_stamp makes the same pairs.
TEST(StampPairs, ARecordIsPairedAlike) {
  std::mt19937 random(7);
  const auto uniform = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  for (int run = 0; run < 200; ++run) {
    const double offset_ms = run % 3 == 0 ? 1000.0 / 60.0 : uniform(-16.0, 16.0);
    const double jitter_ms = run % 2 == 0 ? 0.0 : 6.0;
    std::vector<std::pair<double, bool>> arrivals;  // stamp, whether it is colour
    for (int i = 0; i < 60; ++i) {
      for (const bool color : {true, false}) {
        if (uniform(0.0, 1.0) < 0.1) continue;  // lost on the way
        const double jitter = uniform(-jitter_ms, jitter_ms);
        arrivals.emplace_back(1.7e12 + i * 1000.0 / 30.0 + (color ? 0.0 : offset_ms) + jitter, color);
      }
    }
    std::sort(arrivals.begin(), arrivals.end());

    StampPairs pairs(kGap_s, 0.0);
    std::vector<StampPairs::Pair> found;
    for (const auto& [stamp, color] : arrivals) {
      color ? pairs.add_color(at_ms(stamp)) : pairs.add_depth(at_ms(stamp));
      for (auto& pair : all_of(pairs, false)) found.push_back(pair);
    }
    for (auto& pair : all_of(pairs, true)) found.push_back(pair);
    ASSERT_GT(found.size(), 20U);

    std::vector<StampedFile> colors;
    std::vector<StampedFile> depths;
    for (const StampPairs::Pair& pair : found) {
      colors.push_back({seconds(pair.color), "", 0});
      depths.push_back({seconds(pair.depth), "", 0});
    }
    std::sort(depths.begin(), depths.end(),
              [](const StampedFile& a, const StampedFile& b) { return a.stamp < b.stamp; });
    const auto again = pair_by_stamp(colors, depths, kGap_s);
    ASSERT_EQ(again.size(), found.size()) << run;
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(again[i].stamp, seconds(found[i].color)) << run;
      EXPECT_EQ(again[i].depth_stamp, seconds(found[i].depth)) << run;
    }
  }
}

}  // namespace
}  // namespace plumbline::dataset
