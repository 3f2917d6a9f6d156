// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "plumbline/features/corner_patch.hpp"
#include "smooth_picture.hpp"

namespace plumbline::features {
namespace {

using tests::draw;
using tests::Waves;

constexpr int kSize = 64;
constexpr int kMiddle = 32;

CornerPatch patch_of(const cv::Mat& picture) { return cut_patch(picture, kMiddle, kMiddle, {32.0F, 32.0F}); }

TEST(CornerPatch, IsWhatLiesAroundThePixel) {
  const cv::Mat picture = draw(kSize, kSize, Waves(1));
  const CornerPatch patch = patch_of(picture);
  EXPECT_EQ(patch.gray[CornerPatch::kPixels / 2], picture.at<std::uint8_t>(kMiddle, kMiddle));
  EXPECT_EQ(patch.gray.front(), picture.at<std::uint8_t>(kMiddle - 5, kMiddle - 5));
  EXPECT_EQ(patch.gray.back(), picture.at<std::uint8_t>(kMiddle + 5, kMiddle + 5));
  EXPECT_TRUE(patch.offset.isZero());
}

TEST(CornerPatch, IsFoundToATwentiethOfAPixelInOtherLightAndNoise) {
  tests::Random random(3);
  double sum_sq = 0.0;
  int found = 0;
  constexpr int kTrials = 60;
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    const Waves waves(trial);
    const CornerPatch patch = patch_of(draw(kSize, kSize, waves));
    const Eigen::Vector2d shift(random.uniform(-0.9, 0.9), random.uniform(-0.9, 0.9));
    const cv::Mat later = draw(kSize, kSize, [&](double x, double y) {
      return 20.0 + 0.7 * waves(x - shift.x(), y - shift.y()) + random.normal(2.0);
    });
    const auto at = align_patch(patch, later, {32.0F, 32.0F}, Eigen::Matrix2f::Identity());
    if (!at) continue;
    ++found;
    sum_sq += (at->cast<double>() - Eigen::Vector2d(32.0, 32.0) - shift).squaredNorm();
  }
  EXPECT_GE(found, kTrials - 2);
  EXPECT_LT(std::sqrt(sum_sq / (2 * found)), 0.05);
}

TEST(CornerPatch, IsFoundTurnedAndOfAnotherSizeWhenThatIsTold) {
  const Eigen::Vector2d shift(0.4, -0.6);
  for (std::uint32_t trial = 0; trial < 10; ++trial) {
    const Waves waves(trial);
    const CornerPatch patch = patch_of(draw(kSize, kSize, waves));
    Eigen::Matrix2d a;
    a << 1.1, -0.3, 0.2, 0.8;
    const Eigen::Matrix2d back = a.inverse();
    const cv::Mat later = draw(kSize, kSize, [&](double x, double y) {
      const Eigen::Vector2d p =
          back * (Eigen::Vector2d(x, y) - Eigen::Vector2d(32.0, 32.0) - shift) + Eigen::Vector2d(32.0, 32.0);
      return waves(p.x(), p.y());
    });
    const auto at = align_patch(patch, later, {32.0F, 32.0F}, a.cast<float>());
    ASSERT_TRUE(at) << trial;
    EXPECT_LT((at->cast<double>() - Eigen::Vector2d(32.0, 32.0) - shift).norm(), 0.06) << trial;
  }
}

TEST(CornerPatch, IsNotFoundInWhatIsNotAlike) {
  int found = 0;
  for (std::uint32_t trial = 0; trial < 40; ++trial) {
    const CornerPatch patch = patch_of(draw(kSize, kSize, Waves(trial)));
    const cv::Mat other = draw(kSize, kSize, Waves(trial + 1000));
    if (align_patch(patch, other, {32.0F, 32.0F}, Eigen::Matrix2f::Identity())) ++found;
  }
  EXPECT_EQ(found, 0);
}

TEST(CornerPatch, IsNotFoundWhereNothingHoldsIt) {
  const Eigen::Matrix2f same = Eigen::Matrix2f::Identity();
  const cv::Mat even = draw(kSize, kSize, [](double, double) { return 90.0; });
  EXPECT_FALSE(align_patch(patch_of(even), even, {32.0F, 32.0F}, same)) << "no texture";
  const cv::Mat edge =
      draw(kSize, kSize, [](double x, double) { return 120.0 + 60.0 * std::tanh(0.5 * (x - 32.0)); });
  EXPECT_FALSE(align_patch(patch_of(edge), edge, {32.0F, 32.0F}, same)) << "may slide along the edge";
}

TEST(CornerPatch, IsNotFoundOutsideThePictureOrFarAway) {
  const Waves waves(5);
  const cv::Mat picture = draw(kSize, kSize, waves);
  const CornerPatch patch = patch_of(picture);
  const Eigen::Matrix2f same = Eigen::Matrix2f::Identity();
  for (const Eigen::Vector2f& start : {Eigen::Vector2f(1.0F, 32.0F), Eigen::Vector2f(32.0F, 62.5F),
                                       Eigen::Vector2f(-500.0F, 1e9F), Eigen::Vector2f(NAN, 32.0F)}) {
    EXPECT_FALSE(align_patch(patch, picture, start, same)) << start.transpose();
  }
  const cv::Mat far = draw(kSize, kSize, [&](double x, double y) { return waves(x - 3.5, y); });
  const auto at = align_patch(patch, far, {32.0F, 32.0F}, same);
  EXPECT_FALSE(at && (*at - Eigen::Vector2f(32.0F, 32.0F)).norm() > 2.0F);
}

}  // namespace
}  // namespace plumbline::features
