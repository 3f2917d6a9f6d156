// SPDX-License-Identifier: BSD-3-Clause
// The pose of one keyframe from another's features, before landmarks and surfaces are asked.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../../src/mapping/place_matches.hpp"
#include "../../src/mapping/place_pose.hpp"

namespace plumbline::mapping {
namespace {

using Eigen::Vector3d;
using geometry::Rigid3;

class RandomViews {
 public:
  explicit RandomViews(unsigned seed) : numbers_(seed) {}
  double within(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(numbers_);
  }
  Vector3d vector(double reach) {
    const double x = within(-reach, reach);
    const double y = within(-reach, reach);
    return {x, y, within(-reach, reach)};
  }
  Rigid3 pose() {
    const Vector3d turn = vector(1.0);
    return {geometry::exp_so3(turn), vector(1.0)};
  }
  /// Seen by a camera, 0.5 to 4 m before it.
  Vector3d in_view() {
    const double z = within(0.5, 4.0);
    const double x = within(-0.55, 0.55);
    return {x * z, within(-0.4, 0.4) * z, z};
  }
  std::uint64_t word() { return numbers_(); }

 private:
  std::mt19937_64 numbers_;
};

sensor::Pinhole camera() { return {640, 480, 525.0, 520.0, 319.0, 241.0}; }

double apart(const Rigid3& a, const Rigid3& b) {
  return (a.rotation - b.rotation).norm() + (a.translation - b.translation).norm();
}

/// Pairs of a view moved by `query_from_match`, `good` of each kind right and as many again wrong.
PosePairs make_pairs(const Rigid3& query_from_match, int good_points, int good_lines, int wrong,
                     RandomViews& random) {
  PosePairs pairs;
  for (int i = 0; i < good_points + wrong; ++i) {
    PointPair pair;
    const Vector3d seen = random.in_view();
    pair.match = i < good_points ? query_from_match.inverse() * seen : random.in_view();
    pair.query = camera().project(seen);
    pair.depth = i % 3 == 0 ? 0.0 : seen.z();
    pair.sigma = i % 2 == 0 ? 1.0 : 1.44;
    pairs.points.push_back(pair);
  }
  for (int i = 0; i < good_lines + wrong; ++i) {
    LinePair pair;
    pair.query_start = random.in_view();
    pair.query_end = random.in_view();
    pair.in_space = true;
    pair.query.start = camera().project(pair.query_start).cast<float>();
    pair.query.end = camera().project(pair.query_end).cast<float>();
    pair.match_start = i < good_lines ? query_from_match.inverse() * pair.query_start : random.in_view();
    pair.match_end = i < good_lines ? query_from_match.inverse() * pair.query_end : random.in_view();
    pairs.lines.push_back(pair);
  }
  return pairs;
}

TEST(PlacePose, IsFoundAmongThreeTimesAsManyWrongPairs) {
  RandomViews random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const Rigid3 truth = random.pose();
    const PosePairs pairs = make_pairs(truth, 30, 4, 60, random);
    const auto pose = ransac_pose(pairs, camera(), 600, 10, 7);
    ASSERT_TRUE(pose.has_value()) << trial;
    EXPECT_LT(apart(pose->query_from_match, truth), 1e-3) << trial;
    EXPECT_GE(pose->points.size(), 30U);
    EXPECT_GE(pose->lines.size(), 4U);
  }
}

TEST(PlacePose, IsFoundFromLinesWherePointsAreFew) {
  RandomViews random(3);
  const Rigid3 truth = random.pose();
  const PosePairs pairs = make_pairs(truth, 2, 12, 6, random);
  const auto pose = ransac_pose(pairs, camera(), 600, 10, 7);
  ASSERT_TRUE(pose.has_value());
  EXPECT_LT(apart(pose->query_from_match, truth), 1e-2);
  EXPECT_GE(pose->lines.size(), 12U);
}

TEST(PlacePose, IsNoneOfWrongPairsAlone) {
  RandomViews random(4);
  EXPECT_FALSE(ransac_pose(make_pairs({}, 0, 0, 40, random), camera(), 600, 10, 7).has_value());
  EXPECT_FALSE(ransac_pose({}, camera(), 600, 10, 7).has_value());
}

/// The same as the words say it, one descriptor after the other.
std::vector<std::pair<std::size_t, std::size_t>> slowly(const features::FrameFeatures& a,
                                                        const features::FrameFeatures& b) {
  const auto best = [](const features::Descriptor256& one, const features::FrameFeatures& others) {
    std::size_t k = 0;
    std::vector<int> distances;
    for (const auto& d : others.descriptors) distances.push_back(features::hamming_distance(one, d));
    for (std::size_t j = 1; j < distances.size(); ++j) k = distances[j] < distances[k] ? j : k;
    bool clear = distances[k] <= 72;
    for (std::size_t j = 0; j < distances.size(); ++j) {
      const bool elsewhere = (others.points[j].pixel - others.points[k].pixel).norm() > 5.0F;
      clear = clear && !(elsewhere && distances[j] < distances[k] / 0.95);
    }
    return clear ? static_cast<int>(k) : -1;
  };
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < a.descriptors.size(); ++i) {
    const int j = best(a.descriptors[i], b);
    if (j < 0 || best(b.descriptors[static_cast<std::size_t>(j)], a) != static_cast<int>(i)) continue;
    pairs.emplace_back(i, static_cast<std::size_t>(j));
  }
  return pairs;
}

TEST(PlaceMatches, AreThoseThatLookAlikeBothWays) {
  RandomViews random(6);
  features::FrameFeatures a;
  features::FrameFeatures b;
  const auto add = [&](features::FrameFeatures& to, const features::Descriptor256& descriptor, int flips) {
    features::Descriptor256 d = descriptor;
    for (int k = 0; k < flips; ++k) d[random.word() % 4] ^= 1ULL << (random.word() % 64);
    to.descriptors.push_back(d);
    to.points.emplace_back();
    to.points.back().pixel = {static_cast<float>(random.word() % 40), static_cast<float>(random.word() % 40)};
  };
  for (int i = 0; i < 150; ++i) {
    const features::Descriptor256 d{random.word(), random.word(), random.word(), random.word()};
    add(a, d, 10);
    add(b, d, i % 90);                  // some are too far
    if (i % 4 == 0) add(b, d, i % 30);  // some are no clearer than another one
    if (i % 5 == 0) add(a, d, 12);
    if (i % 10 == 0) add(b, b.descriptors.back(), 0);  // ties
  }
  const auto pairs = alike_both_ways(a, b);
  EXPECT_EQ(pairs, slowly(a, b));
  EXPECT_GT(pairs.size(), 40U);
  EXPECT_LT(pairs.size(), 140U);
  EXPECT_TRUE(alike_both_ways(a, {}).empty());
  EXPECT_TRUE(alike_both_ways({}, b).empty());
}

}  // namespace
}  // namespace plumbline::mapping
