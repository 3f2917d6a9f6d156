// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "orb_orientation.hpp"

namespace plumbline::features {
namespace {

// The weight of a ramp grows in its own direction.
TEST(OrbDescriptor, OrientationPointsTowardsTheLight) {
  for (double degrees = 0.0; degrees < 360.0; degrees += 15.0) {
    cv::Mat image(64, 64, CV_8UC1);
    const double cosine = std::cos(degrees * CV_PI / 180.0);
    const double sine = std::sin(degrees * CV_PI / 180.0);
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        image.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>(128.0 + 3.0 * ((x - 32) * cosine + (y - 32) * sine));
      }
    }
    const double found = orb_orientation(image, 32, 32);
    EXPECT_NEAR(std::remainder(found - degrees, 360.0), 0.0, 1.5) << degrees;
  }
}

}  // namespace
}  // namespace plumbline::features
