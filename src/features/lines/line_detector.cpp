// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/line_detector.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/ximgproc/edge_drawing.hpp>
#include <opencv2/ximgproc/fast_line_detector.hpp>

#include "lines/line_geometry.hpp"
#include "lines/line_lsd.hpp"
#include "plumbline/features/line_border.hpp"

namespace plumbline::features {
namespace {

constexpr int kSmallestImage = 32;       // px; nothing of min_length to be found below
constexpr double kPieceShare = 0.4;      // pieces this long, relative to min_length, may still be joined
constexpr double kHalfScaleBlur = 0.5;   // px of the half image
constexpr double kFullScaleBlur = 0.75;  // px
constexpr float kMinResponse = 1.0F;     // grey levels per px

// The image in which lines are detected: the region at the requested scale, smoothed.
cv::Mat detection_image(const cv::Mat& region, const LineDetectorOptions& options) {
  const bool half = options.scale == LineScale::kHalf;
  cv::Mat image = region;
  if (half) {
    // An odd last row or column has no partner to be averaged with.
    const cv::Size even(region.cols / 2, region.rows / 2);
    cv::resize(region(cv::Rect(0, 0, even.width * 2, even.height * 2)), image, even, 0.0, 0.0,
               cv::INTER_AREA);
  }
  if (options.method != LineMethod::kLsd) return image;  // the others smooth by themselves
  // Pixel noise tears regions apart: at a noise of 8 grey levels smoothing doubles the length of the detected
  // lines.
  const double sigma = half ? kHalfScaleBlur : kFullScaleBlur;
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, cv::Size(5, 5), sigma, sigma, cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
  return smooth;
}

// Detectors keep scratch state, so each call has its own.
std::vector<cv::Vec4f> run(const LineDetectorOptions& options, const cv::Mat& image, float min_length) {
  std::vector<cv::Vec4f> lines;
  switch (options.method) {
    case LineMethod::kLsd:
      lines = detect_lsd(image, min_length, static_cast<float>(options.min_gradient), options.exact_nfa);
      break;

    case LineMethod::kEdlines: {
      auto drawing = cv::ximgproc::createEdgeDrawing();
      drawing->params.EdgeDetectionOperator = cv::ximgproc::EdgeDrawing::SOBEL;
      drawing->params.GradientThresholdValue = 20;
      drawing->params.AnchorThresholdValue = 4;
      drawing->params.MinLineLength = static_cast<int>(min_length);
      drawing->detectEdges(image);
      drawing->detectLines(lines);
      break;
    }

    case LineMethod::kFld:
      cv::ximgproc::createFastLineDetector(static_cast<int>(min_length), 1.414F, 30.0, 60.0, 3, false)
          ->detect(image, lines);
      break;
  }

  return lines;
}

// True if a segment runs within the margin of a side.
bool at_border(const LineSegment& s, const cv::Rect& region, const LineDetectorOptions& options) {
  const auto margin = static_cast<float>(options.border_px);
  const auto both_below = [&](float a, float b, float limit) {
    return options.border_either ? a < limit || b < limit : a < limit && b < limit;
  };
  const float left = static_cast<float>(region.x);
  const float top = static_cast<float>(region.y);
  const float right = static_cast<float>(region.x + region.width - 1);
  const float bottom = static_cast<float>(region.y + region.height - 1);
  return both_below(s.start.x() - left, s.end.x() - left, margin) ||
         both_below(s.start.y() - top, s.end.y() - top, margin) ||
         both_below(right - s.start.x(), right - s.end.x(), margin) ||
         both_below(bottom - s.start.y(), bottom - s.end.y(), margin);
}

}  // namespace

void LineDetectorOptions::declare(core::OptionTable& table) {
  table.choice("line.detector", method,
               {{"lsd", LineMethod::kLsd}, {"edlines", LineMethod::kEdlines}, {"fld", LineMethod::kFld}},
               "Line detector");
  table.choice("line.scale", scale, {{"half", LineScale::kHalf}, {"full", LineScale::kFull}},
               "Resolution of edge detection; positions are refined at full resolution in any case");
  table.number("line.min_gradient", min_gradient, {0.5, 100.0}, "",
               "LSD: weakest gradient, grey levels per pixel of the detection image; below 5.2 only where "
               "there are few strong ones");
  table.number("line.min_length", min_length_px, {5.0, 1000.0}, "px", "Smallest length of a line");
  table.number("line.border", border_px, {0.0, 100.0}, "px",
               "Drop lines that run within this margin of a side");
  table.boolean("line.border_either", border_either, "Also drop lines with one end within that margin");
  table.boolean("line.exact_nfa", exact_nfa,
                "LSD: compute the number of false alarms by its sum, not by a bound");
  table.integer("line.max_count", max_count, {0, 10000}, "",
                "Largest number of lines, the longest ones; 0: all");
  table.boolean("line.join", join, "Join collinear pieces and drop near-duplicates");
}

std::vector<LineSegment> LineDetector::detect(const cv::Mat& gray) const {
  if (gray.empty() || std::min(gray.cols, gray.rows) < kSmallestImage) return {};
  CV_Assert(gray.type() == CV_8UC1);
  const cv::Rect region = valid_region(gray);
  const bool half = options_.scale == LineScale::kHalf;

  // A pixel of the half image is centred between four pixels: full = 2 half + 0.5.
  const float factor = half ? 2.0F : 1.0F;
  const float shift = half ? 0.5F : 0.0F;
  const Eigen::Vector2f origin(static_cast<float>(region.x) + shift, static_cast<float>(region.y) + shift);
  const auto min_length = static_cast<float>(options_.min_length_px);
  const float piece = options_.join ? static_cast<float>(kPieceShare) * min_length : min_length;

  // Segments in pixels of the full image
  std::vector<LineSegment> segments;
  for (const cv::Vec4f& line :
       run(options_, detection_image(gray(region), options_), std::max(4.0F, piece / factor))) {
    LineSegment s;
    s.start = factor * Eigen::Vector2f(line[0], line[1]) + origin;
    s.end = factor * Eigen::Vector2f(line[2], line[3]) + origin;

    // Long enough, away from the border, with a clear step
    if (!(s.length() >= piece) || at_border(s, region, options_)) continue;
    orient(s, gray);
    if (s.response >= kMinResponse) segments.push_back(s);
  }

  if (options_.join) segments = join_collinear(std::move(segments), options_);

  // Positions are refined at full resolution
  std::vector<LineSegment> kept;
  for (LineSegment& s : segments) {
    if (s.length() < min_length) continue;
    refine(s, gray);
    orient(s, gray);
    if (s.response >= kMinResponse && s.length() >= min_length) kept.push_back(s);
  }

  sort_segments(kept);
  if (options_.max_count > 0 && kept.size() > static_cast<std::size_t>(options_.max_count)) {
    kept.resize(static_cast<std::size_t>(options_.max_count));
  }

  return kept;
}

}  // namespace plumbline::features
