// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/orb.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace plumbline::features {
namespace {

constexpr int kEdge = 16;  // ORB's patch (31 px) must lie inside the picture
constexpr int kHalfPatch = 15;
constexpr int kCellPixels = 32;  // cell of the spreading grid, pixels of the level

/// Half width of the circular patch in each row, as in the ORB paper's intensity centroid. u^2 + v^2 <= r (r
/// + 1) is the same seen along x and along y; rounding each row is not, and bends orientations by several
/// degrees.
std::array<int, kHalfPatch + 1> patch_rows() {
  std::array<int, kHalfPatch + 1> rows{};
  for (int v = 0; v <= kHalfPatch; ++v) {
    rows[static_cast<std::size_t>(v)] =
        static_cast<int>(std::sqrt(static_cast<double>(kHalfPatch * (kHalfPatch + 1) - v * v)));
  }
  return rows;
}

/// Orientation from the first moments of a circular patch (Rublee et al., ICCV 2011), degrees.
float patch_angle(const cv::Mat& image, int x, int y, const std::array<int, kHalfPatch + 1>& rows) {
  const auto step = static_cast<std::ptrdiff_t>(image.step1());
  const std::uint8_t* centre = image.ptr<std::uint8_t>(y) + x;
  int m01 = 0;
  int m10 = 0;
  for (int u = -kHalfPatch; u <= kHalfPatch; ++u) m10 += u * centre[u];
  for (int v = 1; v <= kHalfPatch; ++v) {
    const int d = rows[static_cast<std::size_t>(v)];
    const std::uint8_t* below = centre + v * step;
    const std::uint8_t* above = centre - v * step;
    int row_difference = 0;
    for (int u = -d; u <= d; ++u) {
      row_difference += below[u] - above[u];
      m10 += u * (below[u] + above[u]);
    }
    m01 += v * row_difference;
  }
  return cv::fastAtan2(static_cast<float>(m01), static_cast<float>(m10));
}

/// Strongest first; ties by position, so that the order never depends on how FAST found them.
bool stronger(const cv::KeyPoint& a, const cv::KeyPoint& b) {
  if (a.response != b.response) return a.response > b.response;
  if (a.pt.y != b.pt.y) return a.pt.y < b.pt.y;
  return a.pt.x < b.pt.x;
}

/// Picks about `wanted` corners: every cell gives its strongest in turn until enough are taken.
std::vector<cv::KeyPoint> spread(std::vector<cv::KeyPoint> corners, const cv::Size& size, int wanted) {
  if (static_cast<int>(corners.size()) <= wanted) {
    std::sort(corners.begin(), corners.end(), stronger);
    return corners;
  }
  const int columns = std::max(1, size.width / kCellPixels);
  const int rows = std::max(1, size.height / kCellPixels);
  std::vector<std::vector<cv::KeyPoint>> cells(static_cast<std::size_t>(columns * rows));
  for (const cv::KeyPoint& corner : corners) {
    const int c = std::min(columns - 1, static_cast<int>(corner.pt.x) * columns / size.width);
    const int r = std::min(rows - 1, static_cast<int>(corner.pt.y) * rows / size.height);
    cells[static_cast<std::size_t>(r * columns + c)].push_back(corner);
  }
  for (auto& cell : cells) std::sort(cell.begin(), cell.end(), stronger);

  std::vector<cv::KeyPoint> chosen;
  chosen.reserve(static_cast<std::size_t>(wanted));
  for (std::size_t rank = 0; static_cast<int>(chosen.size()) < wanted; ++rank) {
    std::vector<cv::KeyPoint> round;
    for (const auto& cell : cells) {
      if (rank < cell.size()) round.push_back(cell[rank]);
    }
    if (round.empty()) break;
    const auto room = static_cast<std::size_t>(wanted) - chosen.size();
    if (round.size() > room) {
      std::sort(round.begin(), round.end(), stronger);
      round.resize(room);
    }
    chosen.insert(chosen.end(), round.begin(), round.end());
  }
  return chosen;
}

/// FAST over the region; cells where the high threshold finds nothing get the low one.
std::vector<cv::KeyPoint> detect(const cv::Mat& level, const cv::Rect& region, int high, int low) {
  std::vector<cv::KeyPoint> all;
  cv::FAST(level(region), all, low, true);
  const int columns = std::max(1, region.width / kCellPixels);
  const int rows = std::max(1, region.height / kCellPixels);
  std::vector<char> has_strong(static_cast<std::size_t>(columns * rows), 0);
  const auto cell_of = [&](const cv::KeyPoint& k) {
    const int c = std::min(columns - 1, static_cast<int>(k.pt.x) * columns / region.width);
    const int r = std::min(rows - 1, static_cast<int>(k.pt.y) * rows / region.height);
    return static_cast<std::size_t>(r * columns + c);
  };
  for (const cv::KeyPoint& k : all) {
    if (k.response >= static_cast<float>(high)) has_strong[cell_of(k)] = 1;
  }
  std::vector<cv::KeyPoint> kept;
  kept.reserve(all.size());
  for (cv::KeyPoint& k : all) {
    if (k.response < static_cast<float>(high) && has_strong[cell_of(k)] != 0) continue;
    k.pt.x += static_cast<float>(region.x);
    k.pt.y += static_cast<float>(region.y);
    kept.push_back(k);
  }
  return kept;
}

}  // namespace

void OrbOptions::declare(core::OptionTable& table) {
  table.integer("orb.count", count, {50, 20000}, "", "ORB points per picture");
  table.number("orb.scale_factor", scale_factor, {1.05, 2.0}, "",
               "Size ratio of neighbouring pyramid levels");
  table.integer("orb.levels", levels, {1, 12}, "", "Pyramid levels");
  table.integer("orb.fast_threshold", fast_threshold, {1, 200}, "", "FAST threshold, grey values");
  table.integer("orb.fast_threshold_min", fast_threshold_min, {1, 200}, "",
                "FAST threshold where a cell of the picture has no corner otherwise");
}

OrbExtractor::OrbExtractor(const OrbOptions& options) : options_(options) {
  for (int i = 0; i < options_.levels; ++i) {
    scale_.push_back(static_cast<float>(std::pow(options_.scale_factor, i)));
  }
}

float OrbExtractor::sigma(int octave) const {
  return scale_[static_cast<std::size_t>(std::clamp(octave, 0, options_.levels - 1))];
}

OrbFeatures OrbExtractor::extract(const cv::Mat& gray, const cv::Rect& region) const {
  static const auto rows = patch_rows();
  OrbFeatures result;
  double share_sum = 0.0;
  for (float s : scale_) share_sum += 1.0 / s;
  std::vector<cv::KeyPoint> keypoints;
  std::vector<cv::Mat> pyramid{gray};
  for (int level = 0; level < options_.levels; ++level) {
    const float scale = scale_[static_cast<std::size_t>(level)];
    if (level > 0) {
      cv::Mat smaller;
      const cv::Size size(cvRound(static_cast<float>(gray.cols) / scale),
                          cvRound(static_cast<float>(gray.rows) / scale));
      if (size.width < 2 * kEdge + 8 || size.height < 2 * kEdge + 8) break;
      cv::resize(pyramid.back(), smaller, size, 0, 0, cv::INTER_LINEAR);
      pyramid.push_back(smaller);
    }
    const cv::Mat& image = pyramid.back();
    const int x0 = std::max(kEdge, static_cast<int>(std::ceil(static_cast<float>(region.x) / scale)) + 3);
    const int y0 = std::max(kEdge, static_cast<int>(std::ceil(static_cast<float>(region.y) / scale)) + 3);
    const int x1 = std::min(image.cols - kEdge,
                            static_cast<int>(static_cast<float>(region.x + region.width) / scale) - 3);
    const int y1 = std::min(image.rows - kEdge,
                            static_cast<int>(static_cast<float>(region.y + region.height) / scale) - 3);
    if (x1 - x0 < 8 || y1 - y0 < 8) continue;
    const int wanted = static_cast<int>(std::lround(options_.count / (scale * share_sum)));
    auto corners = spread(detect(image, {x0, y0, x1 - x0, y1 - y0}, options_.fast_threshold,
                                 std::min(options_.fast_threshold, options_.fast_threshold_min)),
                          image.size(), wanted);
    for (cv::KeyPoint& k : corners) {
      k.angle = patch_angle(image, cvRound(k.pt.x), cvRound(k.pt.y), rows);
      k.octave = level;
      k.size = 31.0F * scale;
      k.pt *= scale;
      keypoints.push_back(k);
    }
  }
  if (keypoints.empty()) return result;

  cv::Mat descriptors;
  const auto orb =
      cv::ORB::create(static_cast<int>(keypoints.size()), static_cast<float>(options_.scale_factor),
                      options_.levels, kEdge, 0, 2, cv::ORB::HARRIS_SCORE, 31, 20);
  orb->compute(gray, keypoints, descriptors);
  result.points.resize(keypoints.size());
  result.descriptors.resize(keypoints.size());
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const cv::KeyPoint& k = keypoints[i];
    result.points[i] = {{k.pt.x, k.pt.y}, 0.0F, k.angle, k.response, k.octave};
    std::memcpy(result.descriptors[i].data(), descriptors.ptr(static_cast<int>(i)), 32);
  }
  return result;
}

}  // namespace plumbline::features
