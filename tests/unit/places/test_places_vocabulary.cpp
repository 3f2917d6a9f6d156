// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "places_world.hpp"
#include "plumbline/places/majority.hpp"
#include "plumbline/places/vocabulary.hpp"

namespace plumbline::places {
namespace {

using features::Descriptor256;
using tests::flipped;
using tests::random_descriptor;

std::vector<Descriptor256> many(std::uint32_t seed, int count) {
  tests::Bits bits(seed);
  std::vector<Descriptor256> result;
  for (int i = 0; i < count; ++i) result.push_back(random_descriptor(bits));
  return result;
}

TEST(BitCounter, MajorityIsThatOfAPlainCount) {
  tests::Bits bits(3);
  for (int n : {1, 2, 3, 7, 8, 31, 100}) {
    BitCounter counter;
    std::vector<int> ones(256, 0);
    for (int i = 0; i < n; ++i) {
      const Descriptor256 d = random_descriptor(bits);
      counter.add(d);
      for (std::size_t b = 0; b < 256; ++b) ones[b] += (d[b / 64] >> (b % 64)) & 1U ? 1 : 0;
    }
    const Descriptor256 majority = counter.majority();
    for (std::size_t b = 0; b < 256; ++b) {
      EXPECT_EQ(((majority[b / 64] >> (b % 64)) & 1U) != 0, 2 * ones[b] > n) << n << " bit " << b;
    }
  }
}

TEST(BitCounter, ZeroesHaveNoMajority) {
  BitCounter counter;
  for (int i = 0; i < 5; ++i) counter.add({});
  EXPECT_EQ(counter.majority(), Descriptor256{});
}

TEST(KMajority, FindsClustersThatAreThere) {
  tests::Bits bits(5);
  const std::vector<Descriptor256> seeds = many(9, 4);
  std::vector<Descriptor256> all;
  for (int i = 0; i < 120; ++i) all.push_back(flipped(seeds[static_cast<std::size_t>(i % 4)], 15, bits));
  const Clusters clusters = k_majority(all, 4, 10, 1);
  ASSERT_EQ(clusters.centres.size(), 4U);
  for (std::size_t i = 0; i < all.size(); ++i)
    EXPECT_EQ(clusters.member_of[i], clusters.member_of[i % 4]) << i;
  for (const Descriptor256& seed : seeds) {
    int nearest = 257;
    for (const auto& c : clusters.centres) nearest = std::min(nearest, features::hamming_distance(seed, c));
    EXPECT_LE(nearest, 4);
  }
}

TEST(KMajority, FewOrEqualDescriptors) {
  EXPECT_TRUE(k_majority({}, 10, 5, 1).centres.empty());
  const std::vector<Descriptor256> equal(50, many(1, 1)[0]);
  EXPECT_EQ(k_majority(equal, 10, 5, 1).centres.size(), 1U);
  const Clusters three = k_majority(many(2, 3), 10, 5, 1);
  EXPECT_EQ(three.centres.size(), 3U);
  EXPECT_EQ(std::set<int>(three.member_of.begin(), three.member_of.end()).size(), 3U);
}

TEST(Vocabulary, PointsAndLinesNeverMix) {
  const std::vector<Descriptor256> all = many(4, 600);
  Vocabulary v;
  std::array<std::set<Word>, 2> words;
  for (const Kind kind : kKinds) {
    const Word root = v.word(kind, all[0]);
    for (const auto& d : all) v.count(v.word(kind, d));
    v.divide(root, all);
    for (const auto& d : all) words[static_cast<std::size_t>(kind)].insert(v.word(kind, d));
    EXPECT_EQ(v.feature_count(kind), 600);
  }
  for (const Word w : words[0]) EXPECT_EQ(words[1].count(w), 0U);
}

TEST(Vocabulary, LearnsByDividing) {
  VocabularyOptions options;
  options.split = 10;
  Vocabulary v(options);
  const std::vector<Descriptor256> all = many(8, 201);
  const Word root = v.word(Kind::kPoint, all[0]);
  for (const auto& d : all) v.count(v.word(Kind::kPoint, d));
  ASSERT_TRUE(v.overfull(root));
  const std::vector<Word> words = v.divide(root, all);
  ASSERT_EQ(words.size(), all.size());
  EXPECT_FALSE(v.is_word(root));
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(v.word(Kind::kPoint, all[i]), words[i]) << i;
  for (const Word w : std::set<Word>(words.begin(), words.end())) {
    const auto n = static_cast<double>(std::count(words.begin(), words.end(), w));
    EXPECT_NEAR(v.weight(w), std::log(201.0 / n), 1e-12);
  }
  EXPECT_EQ(v.depth(Kind::kPoint), 1);
  EXPECT_EQ(v.word_count(Kind::kLine), 1U);
}

TEST(Vocabulary, EqualDescriptorsCannotBeDividedAndAreAskedLater) {
  VocabularyOptions options;
  options.split = 10;
  Vocabulary v(options);
  const std::vector<Descriptor256> equal(250, many(1, 1)[0]);
  const Word root = v.word(Kind::kPoint, equal[0]);
  for (const auto& d : equal) v.count(v.word(Kind::kPoint, d));
  EXPECT_TRUE(v.divide(root, equal).empty());
  EXPECT_TRUE(v.is_word(root));
  EXPECT_FALSE(v.overfull(root));
}

}  // namespace
}  // namespace plumbline::places
