// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
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
  const Vocabulary v = Vocabulary::train(all, all, {});
  std::set<Word> points;
  std::set<Word> lines;
  for (const auto& d : all) {
    points.insert(v.word(Kind::kPoint, d));
    lines.insert(v.word(Kind::kLine, d));
  }
  for (const Word w : points) EXPECT_EQ(lines.count(w), 0U);
  EXPECT_EQ(v.feature_count(Kind::kPoint), 600);
  EXPECT_EQ(v.feature_count(Kind::kLine), 600);
}

TEST(Vocabulary, TrainedWordsAreSmallAndWeighLogNOverNw) {
  VocabularyOptions options;
  options.branching = 4;
  options.levels = 8;
  const std::vector<Descriptor256> all = many(7, 400);
  const Vocabulary v = Vocabulary::train(all, {}, options);
  std::map<Word, int> count;
  for (const auto& d : all) ++count[v.word(Kind::kPoint, d)];
  for (const auto& [word, n] : count) {
    EXPECT_TRUE(v.is_word(word));
    EXPECT_LE(n, 30);
  }
  const auto& [word, n] = *count.begin();
  EXPECT_NEAR(v.weight(word), std::log(400.0 / n), 0.7)
      << "a member may come down another way than in training";
  EXPECT_TRUE(v.fixed());
  EXPECT_GT(v.depth(Kind::kPoint), 1);
  EXPECT_EQ(v.word_count(Kind::kLine), 1U);
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

TEST(Vocabulary, AFixedOneDoesNotLearn) {
  Vocabulary v = Vocabulary::train(many(1, 50), {}, {});
  EXPECT_THROW(v.count(v.word(Kind::kPoint, many(2, 1)[0])), std::logic_error);
}

TEST(VocabularyFile, ComesBackTheSame) {
  const auto file = std::filesystem::temp_directory_path() / "plumbline_test_vocabulary.bin";
  const std::vector<Descriptor256> all = many(11, 500);
  const Vocabulary v = Vocabulary::train(all, many(12, 200), {});
  ASSERT_TRUE(v.write(file));
  const auto back = Vocabulary::read(file);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->to_bytes(), v.to_bytes());
  for (const auto& d : all) EXPECT_EQ(back->word(Kind::kPoint, d), v.word(Kind::kPoint, d));
  std::filesystem::remove(file);
  EXPECT_FALSE(Vocabulary::read(file));
}

TEST(VocabularyFile, DamageIsToldNotRead) {
  const std::vector<std::uint8_t> good = Vocabulary::train(many(11, 300), {}, {}).to_bytes();
  ASSERT_TRUE(Vocabulary::from_bytes(good, "good"));
  EXPECT_FALSE(Vocabulary::from_bytes({}, "empty"));
  for (const std::size_t cut : {std::size_t{5}, std::size_t{12}, std::size_t{30}, good.size() - 1}) {
    EXPECT_FALSE(
        Vocabulary::from_bytes({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(cut)}, "cut"));
  }
  for (std::size_t i = 0; i < good.size(); i += 97) {
    std::vector<std::uint8_t> bad = good;
    bad[i] ^= 0x10U;
    EXPECT_FALSE(Vocabulary::from_bytes(bad, "bad")) << "byte " << i;
  }
  const auto foreign = Vocabulary::from_bytes(std::vector<std::uint8_t>(100, 'x'), "x.bin");
  ASSERT_FALSE(foreign);
  EXPECT_NE(foreign.error().message.find("x.bin: is not a vocabulary"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::places
