// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// OpenCV's band descriptor on our segments, the yardstick for ours.
#include <algorithm>
#include <cstring>
#include <opencv2/line_descriptor.hpp>
#include <vector>

#include "plumbline/features/lbd.hpp"

namespace plumbline::features::benchmarks {

inline std::vector<cv::line_descriptor::KeyLine> key_lines(const std::vector<LineSegment>& segments,
                                                           const cv::Size& size) {
  std::vector<cv::line_descriptor::KeyLine> result;
  for (const LineSegment& s : segments) {
    cv::line_descriptor::KeyLine k;
    k.class_id = static_cast<int>(result.size());
    k.octave = 0;
    k.startPointX = k.sPointInOctaveX = s.start.x();
    k.startPointY = k.sPointInOctaveY = s.start.y();
    k.endPointX = k.ePointInOctaveX = s.end.x();
    k.endPointY = k.ePointInOctaveY = s.end.y();
    k.angle = s.angle();
    k.lineLength = s.length();
    k.numOfPixels = std::max(1, static_cast<int>(s.length()));
    k.response = s.length() / static_cast<float>(std::max(size.width, size.height));
    k.size = (s.end.x() - s.start.x()) * (s.end.y() - s.start.y());
    k.pt = cv::Point2f(s.middle().x(), s.middle().y());
    result.push_back(k);
  }
  return result;
}

inline std::vector<LineDescriptor> opencv_lbd(const cv::Mat& gray, const std::vector<LineSegment>& segments) {
  auto lines = key_lines(segments, gray.size());
  cv::Mat bytes;
  cv::line_descriptor::BinaryDescriptor::createBinaryDescriptor()->compute(gray, lines, bytes);
  std::vector<LineDescriptor> result(segments.size());
  for (int i = 0; i < bytes.rows; ++i) {
    std::memcpy(result[static_cast<std::size_t>(lines[static_cast<std::size_t>(i)].class_id)].data(),
                bytes.ptr(i), sizeof(LineDescriptor));
  }
  return result;
}

}  // namespace plumbline::features::benchmarks
