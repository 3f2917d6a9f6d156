// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/line_border.hpp"

#include <algorithm>
#include <opencv2/core.hpp>

namespace plumbline::features {
namespace {

constexpr int kMaxSpread = 3;        // grey levels within one constant row (JPEG leaves a little noise)
constexpr int kVisibleStep = 12;     // grey levels from the frame up to the image
constexpr double kStepShare = 0.25;  // of a side's pixels must show the step
constexpr int kRaggedWidth = 3;      // px: a frame that is blended or covers a part of the side only

bool constant(const cv::Mat& strip) {
  double low = 0.0;
  double high = 0.0;
  cv::minMaxLoc(strip, &low, &high);
  return high - low <= kMaxSpread;
}

// True if enough pixels differ visibly.
bool visible_step(const cv::Mat& outside, const cv::Mat& inside, bool either_sign) {
  cv::Mat step;
  if (either_sign) {
    cv::absdiff(inside, outside, step);
  } else {
    cv::subtract(inside, outside, step);  // saturates at 0: brighter inside
  }
  const int count = cv::countNonZero(step > kVisibleStep);
  return count >= kStepShare * static_cast<double>(step.total());
}

// Width of the frame at one side; strip(i) is the i-th row or column counted from that side.
template <typename Strip>
int frame_width(const Strip& strip, int max_width, int available) {
  const int limit = std::min(max_width, available / 4);
  int width = 0;
  while (width < limit && constant(strip(width))) ++width;
  // An image that is constant up to the limit shows a dark or white scene; without a step there is no border.
  if (width == limit || (width > 0 && !visible_step(strip(width - 1), strip(width + 1), true))) width = 0;
  // Lens rectification leaves frames that are black in the middle of a side and fade out towards its ends.
  int ragged = width;
  for (int i = width; i < width + kRaggedWidth; ++i) {
    if (visible_step(strip(i), strip(i + 1), false)) ragged = i + 1;
  }
  return ragged;
}

}  // namespace

cv::Rect valid_region(const cv::Mat& gray, int max_width) {
  cv::Rect whole(0, 0, gray.cols, gray.rows);
  if (gray.empty() || gray.cols < 16 || gray.rows < 16) return whole;
  CV_Assert(gray.type() == CV_8UC1);
  // One pair of sides after the other: the second only gets the rest of the first, as a frame's corners
  // belong to both.
  const int top = frame_width([&](int i) { return gray.row(i); }, max_width, gray.rows);
  const int bottom = frame_width([&](int i) { return gray.row(gray.rows - 1 - i); }, max_width, gray.rows);
  const cv::Mat rows = gray.rowRange(top, gray.rows - bottom);
  const int left = frame_width([&](int i) { return rows.col(i); }, max_width, gray.cols);
  const int right = frame_width([&](int i) { return rows.col(gray.cols - 1 - i); }, max_width, gray.cols);
  return {left, top, gray.cols - left - right, gray.rows - top - bottom};
}

}  // namespace plumbline::features
