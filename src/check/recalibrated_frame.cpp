// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/check/recalibrated_frame.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace plumbline::check {

RecalibratedFrame::RecalibratedFrame(const sensor::Pinhole& image, const sensor::Camera& before,
                                     const sensor::Camera& after) {
  const sensor::Recalibration forth(image, before, after);
  const sensor::Recalibration back(image, after, before);
  delay_s_ = forth.delay_s();
  if (forth.keeps_images()) return;

  const cv::Size size = small_size(image);
  const double step_x = static_cast<double>(image.width) / size.width;
  const double step_y = static_cast<double>(image.height) / size.height;
  const bool own_depth = before.color_from_depth.has_value();  // the colour camera's lens does not move it
  gray_from_.create(size, CV_32FC2);
  depth_from_.create(size, CV_16SC2);
  slope_.create(size, CV_32FC1);

  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      // Grey values are interpolated between the old picture's pixels, each of
      // which is a mean around its middle.
      const Eigen::Vector2d middle((x + 0.5) * step_x - 0.5, (y + 0.5) * step_y - 0.5);
      const Eigen::Vector2d gray = back.pixel(middle);
      gray_from_.at<cv::Vec2f>(y, x) = {static_cast<float>((gray.x() + 0.5) / step_x - 0.5),
                                        static_cast<float>((gray.y() + 0.5) / step_y - 0.5)};

      // Depth is taken from a single pixel, because interpolation would invent surfaces at edges.
      const Eigen::Vector2d now(grid_pixel(x, image.width, size.width),
                                grid_pixel(y, image.height, size.height));
      const Eigen::Vector2d was = own_depth ? now : back.pixel(now);
      const int u = static_cast<int>(std::floor((was.x() + 0.5) / step_x));
      const int v = static_cast<int>(std::floor((was.y() + 0.5) / step_y));
      const bool inside = u >= 0 && v >= 0 && u < size.width && v < size.height;
      depth_from_.at<cv::Vec2s>(y, x) = {static_cast<short>(inside ? u : -1), static_cast<short>(v)};

      // The correction adds a constant to the inverse depth: its value at one metre holds at all depths.
      const double one = forth.depth(was, now, 1.0);
      slope_.at<float>(y, x) = one > 0.0 ? static_cast<float>(1.0 / one - 1.0) : 0.0F;
    }
  }
}

SmallFrame RecalibratedFrame::operator()(const SmallFrame& frame) const {
  SmallFrame changed = frame;
  changed.depth_stamp += delay_s_;
  if (gray_from_.empty()) return changed;

  changed.gray = cv::Mat();
  cv::remap(frame.gray, changed.gray, gray_from_, cv::Mat(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  changed.depth =
      cv::Mat(frame.depth.size(), CV_16UC1, cv::Scalar(0));  // zeros() would write into the shared pixels

  // Each pixel of depth from where it was, with the correction of its distance.
  for (int y = 0; y < frame.depth.rows; ++y) {
    for (int x = 0; x < frame.depth.cols; ++x) {
      const auto& from = depth_from_.at<cv::Vec2s>(y, x);
      if (from[0] < 0) continue;
      const int units = frame.depth.at<std::uint16_t>(from[1], from[0]);
      if (units == 0) continue;

      const double inverse = kDepthUnits_per_m / units + static_cast<double>(slope_.at<float>(y, x));
      const double now = inverse > 0.0 ? kDepthUnits_per_m / inverse : 0.0;
      if (now < 65535.0) changed.depth.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(now + 0.5);
    }
  }
  return changed;
}

}  // namespace plumbline::check
