// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "places_world.hpp"
#include "plumbline/places/recogniser.hpp"

namespace plumbline::places {
namespace {

using core::KeyframeId;
using tests::picture;

/// 40 places of two robots, one after the other, seen once.
Database forty_places() {
  Database database{Vocabulary()};
  for (std::int32_t i = 0; i < 40; ++i)
    database.add({i % 2, i / 2}, picture(static_cast<std::uint32_t>(i), 0));
  return database;
}
KeyframeId id_of(std::int32_t place) { return {place % 2, place / 2}; }

TEST(Database, FindsThePlaceAmongMany) {
  const Database database = forty_places();
  for (std::int32_t place : {0, 7, 39}) {
    const auto hits = database.query(*picture(static_cast<std::uint32_t>(place), 1)).best(3, {});
    ASSERT_FALSE(hits.empty());
    EXPECT_EQ(hits[0].keyframe, id_of(place));
    if (hits.size() > 1) {
      EXPECT_LT(hits[1].score, 0.8 * hits[0].score);
    }
  }
}

TEST(Database, ScoreIsOneMinusHalfTheDifferenceOfTheVectors) {
  // Recomputed from the words and weights of the vocabulary, as docs/method/places.md has it. They are fresh,
  // for the database has just begun.
  VocabularyOptions options;
  options.branching = 5;
  options.split = 10;
  Database database{Vocabulary(options)};
  database.add({0, 0}, picture(1, 3, 30));
  const auto asked = picture(1, 4, 30);
  const auto vector = [&](const features::FrameFeatures& f) {
    std::map<Word, double> v;
    const Vocabulary& voc = database.vocabulary();
    for (const auto& d : f.descriptors) v[voc.word(Kind::kPoint, d)] += 1.0;
    for (const auto& l : f.lines) v[voc.word(Kind::kLine, l.descriptor)] += 1.0;
    double norm = 0.0;
    for (auto& [word, value] : v) {
      value *= voc.weight(word) / static_cast<double>(f.descriptors.size() + f.lines.size());
      norm += value;
    }
    for (auto& [word, value] : v) value /= norm;
    return v;
  };
  std::map<Word, double> difference = vector(*asked);
  for (const auto& [word, value] : vector(*picture(1, 3, 30))) difference[word] -= value;
  double l1 = 0.0;
  for (const auto& [word, value] : difference) l1 += std::abs(value);
  EXPECT_NEAR(database.query(*asked).of({0, 0}), 1.0 - 0.5 * l1, 1e-5);
}

TEST(Database, ThePictureItselfScoresOneAndAnEmptyOneNothing) {
  Database database = forty_places();
  EXPECT_NEAR(database.query(*picture(3, 0)).of(id_of(3)), 1.0, 1e-4);
  EXPECT_TRUE(database.query({}).best(5, {}).empty());
  database.add({7, 0}, std::make_shared<features::FrameFeatures>());
  EXPECT_EQ(database.query(*picture(3, 0)).of({7, 0}), 0.0);
  EXPECT_EQ(database.query(*picture(3, 0)).of({9, 9}), 0.0) << "unknown keyframe";
}

TEST(Database, LinesAloneAreEnoughWhereThereAreNoPoints) {
  Database database{Vocabulary()};
  const auto lines_of = [](std::uint32_t place, std::uint32_t view) {
    auto f = std::make_shared<features::FrameFeatures>(*picture(place, view));
    f->points.clear();
    f->descriptors.clear();
    return f;
  };
  for (std::int32_t i = 0; i < 60; ++i) database.add({0, i}, lines_of(static_cast<std::uint32_t>(i), 0));
  const auto hits = database.query(*lines_of(12, 1)).best(1, {});
  ASSERT_FALSE(hits.empty());
  EXPECT_EQ(hits[0].keyframe.index, 12);
}

TEST(Database, RefusedKeyframesAreLeftOut) {
  const Database database = forty_places();
  const auto scores = database.query(*picture(7, 1));
  for (const Hit& hit : scores.best(40, [](KeyframeId id) { return id != id_of(7); })) {
    EXPECT_NE(hit.keyframe, id_of(7));
  }
}

TEST(Database, TheSameOrderGivesTheSameScores) {
  const Database a = forty_places();
  const Database b = forty_places();
  EXPECT_EQ(a.vocabulary().node_count(), b.vocabulary().node_count());
  const auto x = a.query(*picture(9, 2)).best(40, {});
  const auto y = b.query(*picture(9, 2)).best(40, {});
  ASSERT_EQ(x.size(), y.size());
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_EQ(x[i].score, y[i].score);
}

TEST(Database, AKeyframeIsAddedOnce) {
  Database database = forty_places();
  EXPECT_THROW(database.add(id_of(3), picture(3, 0)), std::invalid_argument);
  EXPECT_THROW(database.add({}, picture(3, 0)), std::invalid_argument);
  EXPECT_THROW(database.add({5, 0}, nullptr), std::invalid_argument);
}

TEST(Recogniser, SeenInARowByGroups) {
  // Twenty keyframes along a way; each sees its own picture, neighbours are those before and behind.
  Database database{Vocabulary()};
  for (std::int32_t i = 0; i < 40; ++i) database.add({0, i}, picture(static_cast<std::uint32_t>(i), 0));
  const Neighbours neighbours = [](KeyframeId id) {
    std::vector<KeyframeId> result;
    for (std::int32_t d : {-1, 1}) {
      if (id.index + d >= 0 && id.index + d < 40) result.push_back({0, id.index + d});
    }
    return result;
  };
  RecogniserOptions options;
  options.hits = 5;
  options.min_absolute = 0.3;
  Recogniser recogniser(options);
  for (std::int32_t step = 0; step < 3; ++step) {
    const auto seen = picture(static_cast<std::uint32_t>(10 + step), 1);
    const auto found = recogniser.recognise(database.query(*seen), {1, step}, {}, {}, neighbours);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found[0].keyframe.index, 10 + step);
    EXPECT_EQ(found[0].in_a_row, step + 1);
  }
  const auto elsewhere = recogniser.recognise(database.query(*picture(30, 1)), {1, 3}, {}, {}, neighbours);
  ASSERT_FALSE(elsewhere.empty());
  EXPECT_EQ(elsewhere[0].in_a_row, 1);
  EXPECT_TRUE(recogniser.recognise(database.query(*picture(999, 0)), {1, 4}, {}, {}, neighbours).empty());
}

TEST(Recogniser, AScoreIsGoodWhenTheNeighboursIsNotMuchBetter) {
  Database database{Vocabulary()};
  for (std::int32_t i = 0; i < 40; ++i) database.add({0, i}, picture(static_cast<std::uint32_t>(i), 0, 30));
  RecogniserOptions options;
  options.min_score = 0.9;
  // The keyframe before saw nearly the same picture; an older one much less of it.
  database.add({0, 40}, picture(5, 1, 2));
  const auto asked = database.query(*picture(5, 1, 2));
  const auto not_now = [](KeyframeId id) { return id.index < 40; };
  const Neighbours none = [](KeyframeId) { return std::vector<KeyframeId>{}; };
  EXPECT_TRUE(Recogniser(options).recognise(asked, {0, 41}, {0, 40}, not_now, none).empty());
  options.min_score = 0.05;
  const auto found = Recogniser(options).recognise(asked, {0, 41}, {0, 40}, not_now, none);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].keyframe.index, 5);
}

}  // namespace
}  // namespace plumbline::places
