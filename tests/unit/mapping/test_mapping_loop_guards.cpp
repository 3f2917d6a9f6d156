// SPDX-License-Identifier: BSD-3-Clause
// What looks the same is not closed when it lies further off than drift, or when two places look it.
#include <gtest/gtest.h>

#include "plumbline/mapping/loop_closing/loop_closer.hpp"
#include "poster_view.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using tests::kTestCamera;

/// A robot that looks at one poster after another, 3 m apart; each place is seen from two views.
class Gallery {
 public:
  explicit Gallery(const LoopOptions& options) : closer_(options, kTestCamera) {}

  /// Two views of a poster where the map believes the place to be `metres` along the wall. What the closer is
  /// sure of after either of them.
  std::vector<Loop> visit(std::uint32_t poster, double metres) {
    std::vector<Loop> sure;
    for (const Rigid3& view : {Rigid3(geometry::exp_so3({0.0, 0.05, 0.0}), {0.15, 0.0, 0.0}),
                               Rigid3(geometry::exp_so3({0.02, -0.05, 0.1}), {-0.1, 0.05, 0.1})}) {
      const Rigid3 place_from_world(Eigen::Matrix3d::Identity(), {-metres, 0.0, 0.0});
      const KeyframeId id =
          tests::add_view(map_, tests::poster(1200, poster), view, view * place_from_world, stamp_);
      stamp_ += 2.0;
      const std::vector<Loop> found = closer_.detect(map_, id);
      sure.insert(sure.end(), found.begin(), found.end());
    }
    return sure;
  }
  [[nodiscard]] const LoopCloser& closer() const { return closer_; }

 private:
  maps::Map map_;
  LoopCloser closer_;
  double stamp_ = 0.0;
};

LoopOptions options_for_few() {
  LoopOptions options;
  options.enabled = true;
  options.places.consistent = 1;
  return options;
}

TEST(LoopGuards, WhatDriftExplainsIsClosed) {
  Gallery gallery(options_for_few());
  for (const auto& [poster, metres] : {std::pair{5U, 0.0}, {6U, 3.0}, {7U, 6.0}, {8U, 3.0}}) {
    EXPECT_TRUE(gallery.visit(poster, metres).empty());
  }
  const std::vector<Loop> sure = gallery.visit(5, 0.2);  // 12 m of way: 0.34 m
  ASSERT_GE(sure.size(), 2U);
  for (const Loop& loop : sure) EXPECT_LT(loop.match.index, 2);
}

TEST(LoopGuards, WhatDriftDoesNotExplainIsNot) {
  Gallery gallery(options_for_few());
  for (const auto& [poster, metres] : {std::pair{5U, 0.0}, {6U, 3.0}, {7U, 6.0}, {8U, 3.0}}) {
    gallery.visit(poster, metres);
  }
  EXPECT_TRUE(gallery.visit(5, 0.9).empty());
  int refused = 0;
  for (const LoopTrial& trial : gallery.closer().trials()) {
    if (!trial.loop.evidence.accepted) continue;
    ++refused;
    EXPECT_NE(trial.refused.find("drift"), std::string::npos) << trial.refused;
    EXPECT_NEAR(trial.correction_m, 0.9, 0.05);
    EXPECT_NEAR(trial.path_m, 13.0, 2.0);
  }
  EXPECT_GE(refused, 2) << "seen by itself it is the same place";
  LoopOptions credulous = options_for_few();
  credulous.max_drift = 1.0;
  Gallery other(credulous);
  for (const auto& [poster, metres] : {std::pair{5U, 0.0}, {6U, 3.0}, {7U, 6.0}, {8U, 3.0}}) {
    other.visit(poster, metres);
  }
  EXPECT_FALSE(other.visit(5, 0.9).empty()) << "the guard must be what refused it";
}

TEST(LoopGuards, TwoPlacesThatLookTheSameExcludeEachOther) {
  LoopOptions options = options_for_few();
  options.max_drift = 1.0;  // leave it to the alternatives
  Gallery gallery(options);
  for (const auto& [poster, metres] : {std::pair{5U, 0.0}, {6U, 3.0}, {5U, 6.0}, {8U, 9.0}}) {
    gallery.visit(poster, metres);
  }
  EXPECT_TRUE(gallery.visit(5, 1.0).empty());
  EXPECT_GE(gallery.closer().counts().verified, 4) << "both places must have been verified";
  options.max_alternative = 1.0;
  Gallery credulous(options);
  for (const auto& [poster, metres] : {std::pair{5U, 0.0}, {6U, 3.0}, {5U, 6.0}, {8U, 9.0}}) {
    credulous.visit(poster, metres);
  }
  EXPECT_FALSE(credulous.visit(5, 1.0).empty()) << "the guard must be what refused it";
}

TEST(LoopGuards, OneKeyframeAloneIsNotBelieved) {
  LoopOptions options = options_for_few();
  options.agreeing = 3;
  Gallery gallery(options);
  for (const auto& [poster, metres] : {std::pair{5U, 0.0}, {6U, 3.0}, {7U, 6.0}, {8U, 3.0}}) {
    gallery.visit(poster, metres);
  }
  EXPECT_TRUE(gallery.visit(5, 0.1).empty());
  EXPECT_GE(gallery.closer().counts().verified, 2);
  EXPECT_FALSE(gallery.visit(5, 0.1).empty());
}

// One loop that drift does not explain may be another place; loops of five keyframes that agree are evidence.
TEST(LoopGuards, LoopsThatAgreeAgainstThePathAreADispute) {
  Gallery gallery(options_for_few());
  for (const auto& [poster, metres] : {std::pair{5U, 0.0}, {6U, 3.0}, {7U, 6.0}, {8U, 3.0}}) {
    gallery.visit(poster, metres);
  }
  EXPECT_TRUE(gallery.visit(5, 0.9).empty());
  EXPECT_TRUE(gallery.visit(6, 3.9).empty());
  EXPECT_TRUE(gallery.closer().disputes().empty()) << "of four keyframes";
  EXPECT_TRUE(gallery.visit(7, 6.9).empty());
  ASSERT_EQ(gallery.closer().disputes().size(), 1U);
  const LoopDispute& dispute = gallery.closer().disputes().front();
  EXPECT_GE(dispute.loops.size(), 5U);
  EXPECT_NEAR(dispute.strongest.correction_m, 0.9, 0.05);
}

TEST(LoopGuards, LoopsThatSayDifferentThingsAreNone) {
  Gallery gallery(options_for_few());
  for (const auto& [poster, metres] : {std::pair{5U, 0.0}, {6U, 3.0}, {7U, 6.0}, {8U, 3.0}}) {
    gallery.visit(poster, metres);
  }
  for (const auto& [poster, metres] : {std::pair{5U, 0.9}, {6U, 4.9}, {7U, 9.0}})
    gallery.visit(poster, metres);
  EXPECT_TRUE(gallery.closer().disputes().empty());
}

}  // namespace
}  // namespace plumbline::mapping
