// SPDX-License-Identifier: BSD-3-Clause
// The largest set of pairs that tell one story, and its alternatives.
#include <gtest/gtest.h>

#include <cmath>

#include "plumbline/mapping/loop_closing/consistent_pairs.hpp"
#include "random_world.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

constexpr int kCount = 12;
const Rigid3 kBFromA{geometry::exp_so3({0.1, -0.7, 0.2}), {4.0, -3.0, 2.0}};  // worlds of the two maps

/// Two robots along the same wall, half a metre a keyframe; each map has a world of its own.
struct TwoMaps {
  maps::Map a;
  maps::Map b;
  TwoMaps() {
    for (int i = 0; i < kCount; ++i) {
      const Rigid3 pose(geometry::exp_so3({0.02 * i, 0.1 * std::sin(i), 0.0}), {-0.5 * i, 0.0, 0.0});
      add(a, 0, i, pose);
      add(b, 1, i, Rigid3(geometry::exp_so3({0.0, 0.1, 0.0}), {0.1, 0.05, 0.0}) * pose * kBFromA.inverse());
    }
  }
  static void add(maps::Map& map, int robot, int index, const Rigid3& pose) {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = {robot, index};
    keyframe->features = std::make_shared<features::FrameFeatures>();
    map.add_keyframe(keyframe, pose);
  }
  /// What is true when B's world lies `shift` metres along the wall from where it does.
  [[nodiscard]] PlacePair pair(int i, int j, double shift = 0.0) const {
    const Rigid3 moved(Eigen::Matrix3d::Identity(), {shift, 0.0, 0.0});
    const Rigid3 b_from_a =
        b.camera_from_world({1, j}) * kBFromA * moved * a.camera_from_world({0, i}).inverse();
    return {{0, i}, {1, j}, b_from_a};
  }
};

TEST(ConsistentPairs, RightOnesAreFoundAmongWrongOnes) {
  const TwoMaps maps;
  tests::Random random(3);
  std::vector<PlacePair> pairs;
  std::vector<std::size_t> right;
  for (int i = 0; i < kCount; ++i) {
    PlacePair wrong = maps.pair(i, (i * 5) % kCount);
    wrong.b_from_a = random.step(random.uniform(0.5, 3.0), random.uniform(0.2, 1.0)) * wrong.b_from_a;
    pairs.push_back(wrong);
    if (i % 3 != 0) continue;
    right.push_back(pairs.size());
    PlacePair noisy = maps.pair(i, std::min(i + 1, kCount - 1));
    noisy.b_from_a = random.step(0.02, 0.005) * noisy.b_from_a;
    pairs.push_back(noisy);
  }
  const auto sets = consistent_sets(maps.a, maps.b, pairs, {});
  ASSERT_GE(sets.size(), 2U);
  EXPECT_EQ(sets[0].members, right);
  EXPECT_EQ(sets[0].keyframes_a, 4U);
  EXPECT_EQ(sets[0].keyframes_b, 4U);
  EXPECT_NEAR(sets[0].span_m, 4.5, 0.01);
  EXPECT_LE(sets[1].members.size(), 2U);
}

TEST(ConsistentPairs, PlacesThatRepeatHaveAlternatives) {
  const TwoMaps maps;
  std::vector<PlacePair> pairs;
  for (int i = 0; i < kCount; ++i) {
    for (const int shift : {-4, 0, 4}) {  // doors every 2 m
      if (i + shift >= 0 && i + shift < kCount) pairs.push_back(maps.pair(i, i, 0.5 * shift));
    }
  }
  const auto sets = consistent_sets(maps.a, maps.b, pairs, {});
  ASSERT_EQ(sets.size(), 3U);
  EXPECT_EQ(sets[0].members.size(), 12U);
  EXPECT_EQ(sets[1].members.size(), 8U);
  EXPECT_EQ(sets[2].members.size(), 8U);
  EXPECT_NE(sets[1].members.front(), sets[2].members.front());
}

TEST(ConsistentPairs, ToleranceGrowsWithTheWayBetween) {
  const TwoMaps maps;
  ConsistencyOptions options;
  const auto off = [&](int i, double metres) {
    PlacePair pair = maps.pair(i, i);
    pair.b_from_a.translation.x() += metres;
    return pair;
  };
  EXPECT_TRUE(agree(maps.a, maps.b, maps.pair(0, 0), off(1, 0.14), options));
  EXPECT_FALSE(agree(maps.a, maps.b, maps.pair(0, 0), off(1, 0.18), options));
  EXPECT_TRUE(agree(maps.a, maps.b, maps.pair(0, 0), off(11, 0.18), options)) << "5.5 m apart";
  PlacePair turned = maps.pair(1, 1);
  turned.b_from_a = Rigid3(geometry::exp_so3({0.0, 0.0, 0.09}), Eigen::Vector3d::Zero()) * turned.b_from_a;
  EXPECT_FALSE(agree(maps.a, maps.b, maps.pair(0, 0), turned, options));
}

TEST(ConsistentPairs, NoneAndOne) {
  const TwoMaps maps;
  EXPECT_TRUE(consistent_sets(maps.a, maps.b, {}, {}).empty());
  const auto sets = consistent_sets(maps.a, maps.b, {maps.pair(2, 3)}, {});
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_EQ(sets[0].members, std::vector<std::size_t>{0});
  EXPECT_EQ(sets[0].span_m, 0.0);
}

/// All subsets, for small graphs.
std::size_t largest_by_force(const std::vector<std::vector<bool>>& joined) {
  std::size_t best = 0;
  for (std::uint32_t set = 0; set < (1U << joined.size()); ++set) {
    std::size_t size = 0;
    bool clique = true;
    for (std::size_t i = 0; i < joined.size() && clique; ++i) {
      if (((set >> i) & 1U) == 0) continue;
      ++size;
      for (std::size_t j = 0; j < i; ++j) clique = clique && (((set >> j) & 1U) == 0 || joined[i][j]);
    }
    if (clique) best = std::max(best, size);
  }
  return best;
}

TEST(MaximumClique, IsTheLargestThereIs) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    tests::Random random(seed);
    constexpr std::size_t kNodes = 12;
    std::vector<std::vector<bool>> joined(kNodes, std::vector<bool>(kNodes, false));
    for (std::size_t i = 0; i < kNodes; ++i) {
      for (std::size_t j = 0; j < i; ++j) joined[i][j] = joined[j][i] = random.uniform(0.0, 1.0) < 0.6;
    }
    const auto clique = maximum_clique(joined, 100000);
    EXPECT_EQ(clique.size(), largest_by_force(joined)) << "seed " << seed;
    for (std::size_t i : clique) {
      for (std::size_t j : clique) EXPECT_TRUE(i == j || joined[i][j]);
    }
  }
  EXPECT_TRUE(maximum_clique({}, 10).empty());
}

TEST(MaximumClique, AnExhaustedBudgetStillGivesAClique) {
  constexpr std::size_t kNodes = 120;
  tests::Random random(9);
  std::vector<std::vector<bool>> joined(kNodes, std::vector<bool>(kNodes, false));
  for (std::size_t i = 0; i < kNodes; ++i) {
    for (std::size_t j = 0; j < i; ++j) joined[i][j] = joined[j][i] = random.uniform(0.0, 1.0) < 0.8;
  }
  const auto clique = maximum_clique(joined, 50);
  EXPECT_GE(clique.size(), 8U);
  for (std::size_t i : clique) {
    for (std::size_t j : clique) EXPECT_TRUE(i == j || joined[i][j]);
  }
}

}  // namespace
}  // namespace plumbline::mapping
