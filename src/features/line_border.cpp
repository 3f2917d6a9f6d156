// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/line_border.hpp"

#include <algorithm>
#include <cstdlib>
#include <opencv2/core.hpp>

namespace plumbline::features {
namespace {

constexpr int kMaxSpread = 3;        // grey levels within one constant row (JPEG leaves a little noise)
constexpr int kVisibleStep = 12;     // grey levels from the frame to the picture
constexpr double kStepShare = 0.25;  // of the side's pixels must show the step

bool constant(const cv::Mat& strip) {
  double low = 0.0;
  double high = 0.0;
  cv::minMaxLoc(strip, &low, &high);
  return high - low <= kMaxSpread;
}

double step_share(const cv::Mat& frame, const cv::Mat& picture) {
  cv::Mat difference;
  cv::absdiff(frame, picture, difference);
  return static_cast<double>(cv::countNonZero(difference > kVisibleStep)) /
         static_cast<double>(difference.total());
}

// Width of the frame at one side; strip(i) is the i-th row or column counted from that side. One row between
// frame and picture may be a blend of both (interpolated colours), so the step is looked for two strips on.
template <typename Strip>
int frame_width(const Strip& strip, int max_width, int available) {
  const int limit = std::min(max_width, available / 4);
  int width = 0;
  while (width < limit && constant(strip(width)) &&
         (width == 0 || std::abs(cv::mean(strip(width))[0] - cv::mean(strip(0))[0]) <= kMaxSpread)) {
    ++width;
  }
  if (width == 0 || width == limit) return 0;
  if (step_share(strip(0), strip(width)) >= kStepShare) return width;
  return step_share(strip(0), strip(width + 1)) >= kStepShare ? width + 1 : 0;
}

}  // namespace

cv::Rect valid_region(const cv::Mat& gray, int max_width) {
  cv::Rect whole(0, 0, gray.cols, gray.rows);
  if (gray.empty() || gray.cols < 16 || gray.rows < 16) return whole;
  CV_Assert(gray.type() == CV_8UC1);
  // Side by side: the second pair looks only at what the first left, as a frame's corners belong to both.
  const int top = frame_width([&](int i) { return gray.row(i); }, max_width, gray.rows);
  const int bottom = frame_width([&](int i) { return gray.row(gray.rows - 1 - i); }, max_width, gray.rows);
  const cv::Mat rows = gray.rowRange(top, gray.rows - bottom);
  const int left = frame_width([&](int i) { return rows.col(i); }, max_width, gray.cols);
  const int right = frame_width([&](int i) { return rows.col(gray.cols - 1 - i); }, max_width, gray.cols);
  return {left, top, gray.cols - left - right, gray.rows - top - bottom};
}

}  // namespace plumbline::features
