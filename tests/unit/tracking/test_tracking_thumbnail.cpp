// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/tracking/thumbnail_alignment.hpp"
#include "tracking_world.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;
using tests::kTestCamera;

/// Thumbnails as the feature extractor makes them, of a poster on a wall 2 m away.
class Thumbnails : public testing::Test {
 protected:
  static features::FrameFeatures look(const Rigid3& pose, double gain = 1.0, double offset = 0.0) {
    static const cv::Mat kPoster = [] {
      cv::Mat p;
      cv::GaussianBlur(tests::poster(1200, 3), p, {0, 0}, 6.0);
      cv::normalize(p, p, 30, 200, cv::NORM_MINMAX);
      return p;
    }();
    static const features::FeatureExtractor kExtractor = [] {
      features::FeatureOptions options;
      options.points = options.lines = false;
      return features::FeatureExtractor(options, kTestCamera);
    }();
    sensor::RgbdFrame frame;
    frame.gray = tests::render_wall(kPoster, 300.0, 2.0, pose);
    frame.gray.convertTo(frame.gray, CV_8U, gain, offset);
    frame.depth = tests::render_depth({{{0.0, 0.0, 2.0}, {0.0, 0.0, -1.0}, 0.0}}, pose);
    return kExtractor.extract(frame);
  }
  static ThumbnailAlignment align(const features::FrameFeatures& a, const features::FrameFeatures& b,
                                  const Rigid3& guess = {}) {
    return align_thumbnails(a.thumbnail, a.thumbnail_depth, b.thumbnail, kTestCamera, guess);
  }
};

TEST_F(Thumbnails, FindASmallMotion) {
  tests::Random random(1);
  const features::FrameFeatures before = look({});
  for (int i = 0; i < 6; ++i) {
    const Rigid3 motion = random.step(0.04, 0.03);
    const ThumbnailAlignment found = align(before, look(motion));
    // What moves the picture is what counts: one thumbnail pixel is 3 cm on the wall.
    const Eigen::Vector3d on_wall(0.2, 0.1, 2.0);
    const double shift = (kTestCamera.project(motion * on_wall) - kTestCamera.project(on_wall)).norm();
    const double left =
        (kTestCamera.project(motion * on_wall) - kTestCamera.project(found.current_from_previous * on_wall))
            .norm();
    EXPECT_LT(left, std::max(2.0, 0.15 * shift)) << "of " << shift << " px";
    EXPECT_LT(found.rms, found.initial_rms);
    EXPECT_TRUE(found.better);
    EXPECT_GT(found.pixels, 3000);
  }
}

TEST_F(Thumbnails, ToleratesAChangeOfBrightness) {
  const Rigid3 motion(geometry::exp_so3({0.0, 0.03, 0.01}), {0.02, 0.01, 0.0});
  const features::FrameFeatures before = look({});
  const Eigen::Vector3d on_wall(-0.2, 0.1, 2.0);
  for (const double offset : {-25.0, 30.0}) {
    const ThumbnailAlignment found = align(before, look(motion, 1.0, offset));
    EXPECT_LT(
        (kTestCamera.project(motion * on_wall) - kTestCamera.project(found.current_from_previous * on_wall))
            .norm(),
        2.5)
        << offset;
    EXPECT_TRUE(found.better);
  }
}

TEST_F(Thumbnails, StaysWhereTheGuessIsRight) {
  const Rigid3 motion(geometry::exp_so3({0.01, 0.02, 0.0}), {0.02, 0.0, 0.01});
  const ThumbnailAlignment found = align(look({}), look(motion), motion);
  EXPECT_LT(tests::distance(found.current_from_previous, motion), 0.006);
  EXPECT_LT(tests::angle(found.current_from_previous, motion), 0.003);
}

TEST_F(Thumbnails, BlankOrMissingPicturesLeaveTheGuess) {
  const Rigid3 guess(geometry::exp_so3({0.01, 0.02, 0.0}), {0.02, 0.0, 0.01});
  const features::FrameFeatures wall = look({});
  const cv::Mat black(wall.thumbnail.size(), CV_32FC1, cv::Scalar(0));
  const cv::Mat none;
  const auto expect_guess = [&](const cv::Mat& a, const cv::Mat& depth, const cv::Mat& b) {
    const ThumbnailAlignment found = align_thumbnails(a, depth, b, kTestCamera, guess);
    EXPECT_FALSE(found.better);
    EXPECT_LT(tests::distance(found.current_from_previous, guess), 1e-9);
    EXPECT_LT(tests::angle(found.current_from_previous, guess), 1e-7);
  };
  expect_guess(black, wall.thumbnail_depth, black);
  expect_guess(none, wall.thumbnail_depth, wall.thumbnail);
  expect_guess(wall.thumbnail, none, wall.thumbnail);
  expect_guess(wall.thumbnail, wall.thumbnail_depth, none);
  expect_guess(wall.thumbnail, black, wall.thumbnail);  // no depth anywhere
  expect_guess(wall.thumbnail, wall.thumbnail_depth,
               cv::Mat(30, 40, CV_32FC1, cv::Scalar(0)));  // another size
}

}  // namespace
}  // namespace plumbline::tracking
