// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "plumbline/core/ids.hpp"
#include "plumbline/maps/id_map.hpp"

namespace plumbline::maps {
namespace {

using core::PointId;
using Names = IdMap<PointId, std::string>;

TEST(IdMap, StartsEmpty) {
  const Names names;
  EXPECT_EQ(names.size(), 0U);
  EXPECT_TRUE(names.ids().empty());
  EXPECT_EQ(names.find({0, 0}), nullptr);
  EXPECT_EQ(names.find({0, -1}), nullptr);
  EXPECT_THROW((void)names.at({0, 0}), std::out_of_range);
  EXPECT_EQ(names.next_id(3), (PointId{3, 0}));
}

TEST(IdMap, InsertsReplacesAndErases) {
  Names names;
  names.insert({0, 2}, "two");
  names.insert({0, 0}, "zero");
  EXPECT_EQ(names.size(), 2U);
  EXPECT_FALSE(names.contains({0, 1}));  // the hole between
  names.insert({0, 2}, "deux");
  EXPECT_EQ(names.size(), 2U);
  EXPECT_EQ(names.at({0, 2}), "deux");
  names.at({0, 2}) = "zwei";
  EXPECT_EQ(*names.find({0, 2}), "zwei");
  names.erase({0, 2});
  names.erase({0, 2});
  names.erase({7, 0});
  EXPECT_EQ(names.size(), 1U);
  EXPECT_FALSE(names.contains({0, 2}));
}

TEST(IdMap, RobotsDoNotMixAndIdsComeInOrder) {
  Names names;
  names.insert({2, 0}, "c");
  names.insert({0, 1}, "b");
  names.insert({-1, 4}, "z");
  names.insert({0, 0}, "a");
  const std::vector<PointId> expected{{-1, 4}, {0, 0}, {0, 1}, {2, 0}};
  EXPECT_EQ(names.ids(), expected);
  EXPECT_FALSE(names.contains({1, 0}));
  EXPECT_EQ(names.next_id(2), (PointId{2, 1}));
  EXPECT_EQ(names.next_id(-1), (PointId{-1, 5}));
}

TEST(IdMap, IdsOfWhatIsGoneAreNotGivenAgain) {
  Names names;
  names.insert(names.next_id(0), "a");
  names.insert(names.next_id(0), "b");
  names.erase({0, 1});
  EXPECT_EQ(names.next_id(0), (PointId{0, 2}));
}

TEST(IdMap, WhatIsErasedMakesRoomForWhatIsNew) {
  IdMap<PointId, std::shared_ptr<int>> map;
  const auto value = std::make_shared<int>(1);
  for (int i = 0; i < 100; ++i) {
    map.insert(map.next_id(0), value);
    if (i >= 4) map.erase({0, i - 4});
  }
  EXPECT_EQ(map.size(), 4U);
  EXPECT_EQ(value.use_count(), 5) << "what is erased is let go";
  const std::vector<PointId> expected{{0, 96}, {0, 97}, {0, 98}, {0, 99}};
  EXPECT_EQ(map.ids(), expected);
  const auto* kept = map.find({0, 96});
  for (int i = 0; i < 1000; ++i) map.insert(map.next_id(1), nullptr);
  EXPECT_EQ(map.find({0, 96}), kept) << "insertion moves nothing";
  EXPECT_THROW(map.insert({0, -1}, nullptr), std::invalid_argument);
}

TEST(IdMap, KnowsWhichPagesWereTouched) {
  Names names;
  for (int i = 0; i < 200; ++i) names.insert({1, i}, "x");
  names.insert({0, 3}, "y");
  using Pages = std::vector<Names::Page>;
  EXPECT_EQ(names.changed_pages(0), (Pages{{0, 0}, {1, 0}, {1, 1}, {1, 2}, {1, 3}}));
  const std::uint64_t before = names.revision();
  const Names& looked_at = names;
  EXPECT_EQ(looked_at.at({1, 5}), "x");
  EXPECT_NE(looked_at.find({1, 70}), nullptr);
  EXPECT_EQ(names.find({1, 999}), nullptr);
  names.erase({1, 999});
  EXPECT_TRUE(names.changed_pages(before).empty()) << "nothing changed";
  names.at({1, 130}) = "z";
  names.erase({0, 3});
  EXPECT_EQ(names.changed_pages(before), (Pages{{0, 0}, {1, 2}}));
  const std::uint64_t later = names.revision();
  *names.find({1, 63}) = "w";
  names.insert({1, 64}, "v");
  EXPECT_EQ(names.changed_pages(later), (Pages{{1, 0}, {1, 1}}));
}

}  // namespace
}  // namespace plumbline::maps
