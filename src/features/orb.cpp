// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/orb.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "orb_orientation.hpp"

namespace plumbline::features {
namespace {

constexpr int kFastRadius = 3;
constexpr int kEdge = 16;        // the patch of a corner 3 px further in must lie inside the image
constexpr int kCellPixels = 32;  // cell of the spreading grid, pixels of the level

struct Corner {
  int x = 0;  ///< pixels of the level
  int y = 0;
  int score = 0;  ///< the largest threshold at which FAST still finds it, grey values
};

/// Cells of a grid over an area of width x height.
class Cells {
 public:
  Cells(int width, int height)
      : width_(width),
        height_(height),
        columns_(std::max(1, width / kCellPixels)),
        rows_(std::max(1, height / kCellPixels)) {}
  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(columns_ * rows_); }
  [[nodiscard]] std::size_t of(const Corner& corner) const {
    const int c = std::min(columns_ - 1, corner.x * columns_ / width_);
    const int r = std::min(rows_ - 1, corner.y * rows_ / height_);
    return static_cast<std::size_t>(r * columns_ + c);
  }
  /// Calls what(area) for the areas of the cells that are not `done`, adjacent cells as one area.
  template <typename What>
  void for_others(const std::vector<char>& done, const What& what) const {
    const auto is_done = [&](int r, int c) { return done[static_cast<std::size_t>(r * columns_ + c)] != 0; };
    for (int r = 0; r < rows_; ++r) {
      const int top = first(r, rows_, height_), bottom = first(r + 1, rows_, height_);
      for (int c = 0, end = 0; c < columns_; c = end + 1) {
        for (end = c; end < columns_ && !is_done(r, end);) ++end;
        const int left = first(c, columns_, width_), right = first(end, columns_, width_);
        if (left < right) what(cv::Rect(left, top, right - left, bottom - top));
      }
    }
  }

 private:
  /// The first of `size` pixels that lies in the cell `i` of `cells`.
  static int first(int i, int cells, int size) { return (i * size + cells - 1) / cells; }

  int width_;
  int height_;
  int columns_;
  int rows_;
};

/// Strongest first; ties by position, so that the order never depends on how corners were found.
bool stronger(const Corner& a, const Corner& b) {
  if (a.score != b.score) return a.score > b.score;
  if (a.y != b.y) return a.y < b.y;
  return a.x < b.x;
}

/// Picks about `wanted` corners: every cell gives its strongest in turn until enough are taken.
std::vector<Corner> spread(std::vector<Corner> corners, const cv::Size& size, int wanted, bool evenly) {
  const auto count = static_cast<std::size_t>(std::max(0, wanted));
  if (corners.size() <= count || !evenly) {
    std::sort(corners.begin(), corners.end(), stronger);
    corners.resize(std::min(count, corners.size()));
    return corners;
  }

  // Corners by cell, the strongest first
  const Cells cells(size.width, size.height);
  std::vector<std::size_t> begin(cells.count() + 1, 0);
  for (const Corner& corner : corners) ++begin[cells.of(corner) + 1];
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  std::vector<Corner> by_cell(corners.size());
  std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
  for (const Corner& corner : corners) by_cell[next[cells.of(corner)]++] = corner;

  const auto place = [&](std::size_t i) { return by_cell.begin() + static_cast<std::ptrdiff_t>(i); };
  for (std::size_t i = 0; i + 1 < begin.size(); ++i)
    std::sort(place(begin[i]), place(begin[i + 1]), stronger);

  // Every cell gives a corner in each round
  std::vector<Corner> chosen;
  chosen.reserve(count);
  std::vector<Corner> round;
  for (std::size_t rank = 0; chosen.size() < count; ++rank) {
    round.clear();
    for (std::size_t i = 0; i + 1 < begin.size(); ++i) {
      if (begin[i] + rank < begin[i + 1]) round.push_back(by_cell[begin[i] + rank]);
    }
    if (round.empty()) break;

    // The last round only gives its strongest
    const std::size_t room = count - chosen.size();
    if (round.size() > room) {
      std::sort(round.begin(), round.end(), stronger);
      round.resize(room);
    }

    chosen.insert(chosen.end(), round.begin(), round.end());
  }

  return chosen;
}

/// True if the gradients around a pixel nearly all point the same way or its opposite (structure tensor;
/// Harris and Stephens 1988 test the same with one number).
bool on_edge(const cv::Mat& level, int x, int y, double min_corner) {
  constexpr int kTensorReach = 3;
  int xx = 0;
  int xy = 0;
  int yy = 0;

  // Structure tensor of the gradients
  for (int v = y - kTensorReach; v <= y + kTensorReach; ++v) {
    const unsigned char* above = level.ptr<unsigned char>(v - 1);
    const unsigned char* row = level.ptr<unsigned char>(v);
    const unsigned char* below = level.ptr<unsigned char>(v + 1);

    for (int u = x - kTensorReach; u <= x + kTensorReach; ++u) {
      const int dx = row[u + 1] - row[u - 1];
      const int dy = below[u] - above[u];
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
  }

  // Eigenvalues are compared without computing roots
  const double sum = static_cast<double>(xx) + yy;  // of the tensor's eigenvalues
  const double apart = static_cast<double>(xx) - yy;
  const double squared = apart * apart + 4.0 * xy * xy;  // of their difference
  const double least = (1.0 - min_corner) / (1.0 + min_corner) * sum;
  return least * least < squared;
}

/// FAST (Rosten, Porter, Drummond, PAMI 32, 2010) in an area of the region, without what lies on edges.
/// Whether a pixel is the best of its neighbours does not depend on where the area ends.
void find_corners(const cv::Mat& level, const cv::Rect& region, const cv::Rect& area, int threshold,
                  double min_corner, std::vector<Corner>& corners) {
  constexpr int kAround = kFastRadius + 1;  // the circle of a neighbour
  const cv::Rect around =
      cv::Rect(area.x - kAround, area.y - kAround, area.width + 2 * kAround, area.height + 2 * kAround) &
      cv::Rect(0, 0, region.width, region.height);
  std::vector<cv::KeyPoint> found;
  cv::FAST(level(around + region.tl()), found, threshold);
  for (const cv::KeyPoint& k : found) {
    const cv::Point at(cvRound(k.pt.x) + around.x, cvRound(k.pt.y) + around.y);
    if (!area.contains(at)) continue;
    if (min_corner > 0.0 && on_edge(level, at.x + region.x, at.y + region.y, min_corner)) continue;
    corners.push_back({at.x, at.y, cvRound(k.response)});
  }
}

/// Corners of the high threshold, and in cells without any those of the low one. FAST with the low one alone
/// would find the same, but the many weak corners of a busy image cost most of its time.
std::vector<Corner> detect(const cv::Mat& level, const cv::Rect& region, int high, int low,
                           double min_corner) {
  std::vector<Corner> corners;
  find_corners(level, region, {0, 0, region.width, region.height}, high, min_corner, corners);
  if (low < high) {
    const Cells cells(region.width, region.height);
    std::vector<char> has_strong(cells.count(), 0);
    for (const Corner& c : corners) has_strong[cells.of(c)] = 1;
    cells.for_others(has_strong, [&](const cv::Rect& area) {
      find_corners(level, region, area, low, min_corner, corners);
    });
  }
  for (Corner& c : corners) {
    c.x += region.x;
    c.y += region.y;
  }
  return corners;
}

/// cv::ORB's descriptors of one level.
std::vector<Descriptor256> describe(const cv::Mat& level, std::vector<cv::KeyPoint>& points) {
  const auto orb = cv::ORB::create(static_cast<int>(points.size()), 1.2F, 1, kEdge + kFastRadius);
  cv::Mat rows;
  const std::size_t count = points.size();
  orb->compute(level, points, rows);
  CV_Assert(points.size() == count && rows.cols == sizeof(Descriptor256) && rows.isContinuous());
  std::vector<Descriptor256> descriptors(count);
  std::memcpy(descriptors.data(), rows.data, count * sizeof(Descriptor256));
  return descriptors;
}

}  // namespace

void OrbOptions::declare(core::OptionTable& table) {
  table.integer("orb.count", count, {50, 20000}, "", "ORB points per image");
  table.integer("orb.levels", levels, {1, 12}, "", "Pyramid levels");
  table.integer("orb.fast_threshold", fast_threshold, {1, 200}, "", "FAST threshold, grey values");
  table.integer("orb.fast_threshold_min", fast_threshold_min, {1, 200}, "",
                "FAST threshold in cells of the image that would have no corner");
  table.number("orb.min_corner", min_corner, {0.0, 1.0}, "",
               "Drop corners on edges, whose squared gradient across the main direction is below this share "
               "of that along it; 0: none");
  table.boolean("orb.spread", spread, "Spread points evenly over the image; off: take the strongest");
}

OrbExtractor::OrbExtractor(const OrbOptions& options) : options_(options) {
  for (int i = 0; i < options_.levels; ++i) {
    scale_.push_back(static_cast<float>(std::pow(options_.scale_factor, i)));
  }
}

float OrbExtractor::sigma(int octave) const {
  return scale_[static_cast<std::size_t>(std::clamp(octave, 0, options_.levels - 1))];
}

namespace {

/// Area of a level in which corners may lie; `region` is in pixels of the full image.
cv::Rect inner_region(const cv::Rect& region, const cv::Size& level, float scale) {
  const int x0 = std::max(kEdge, static_cast<int>(std::ceil(static_cast<float>(region.x) / scale)) + 3);
  const int y0 = std::max(kEdge, static_cast<int>(std::ceil(static_cast<float>(region.y) / scale)) + 3);
  const int x1 = std::min(level.width - kEdge,
                          static_cast<int>(static_cast<float>(region.x + region.width) / scale) - 3);
  const int y1 = std::min(level.height - kEdge,
                          static_cast<int>(static_cast<float>(region.y + region.height) / scale) - 3);
  return {x0, y0, x1 - x0, y1 - y0};
}

/// Position of the middle of a level's pixel in the full image. Both show the same from edge to edge, and a
/// level is a whole number of pixels wide, which its scale is not exactly.
Eigen::Vector2f in_full_image(const Corner& corner, const cv::Size& level, const cv::Size& full) {
  const auto there = [](int at, int size, int full_size) {
    return (static_cast<float>(at) + 0.5F) * static_cast<float>(full_size) / static_cast<float>(size) - 0.5F;
  };
  return {there(corner.x, level.width, full.width), there(corner.y, level.height, full.height)};
}

}  // namespace

OrbFeatures OrbExtractor::extract(const cv::Mat& gray, const cv::Rect& region) const {
  OrbFeatures result;
  double share_sum = 0.0;
  for (float s : scale_) share_sum += 1.0 / s;
  cv::Mat image = gray;  // of the level

  for (int level = 0; level < options_.levels; ++level) {
    const float scale = scale_[static_cast<std::size_t>(level)];

    // Each level is made from the one before
    if (level > 0) {
      cv::Mat smaller;
      const cv::Size size(cvRound(static_cast<float>(gray.cols) / scale),
                          cvRound(static_cast<float>(gray.rows) / scale));
      if (size.width < 2 * kEdge + 8 || size.height < 2 * kEdge + 8) break;
      cv::resize(image, smaller, size, 0, 0, cv::INTER_LINEAR);
      image = smaller;
    }

    result.levels.push_back(image);
    const cv::Rect inner = inner_region(region, image.size(), scale);
    if (inner.width < 8 || inner.height < 8) continue;

    // Number in proportion to the level's width
    const int wanted = static_cast<int>(std::lround(options_.count / (scale * share_sum)));
    const std::vector<Corner> corners =
        spread(detect(image, inner, options_.fast_threshold,
                      std::min(options_.fast_threshold, options_.fast_threshold_min), options_.min_corner),
               image.size(), wanted, options_.spread);
    if (corners.empty()) continue;

    // Position, orientation and patch of each corner
    std::vector<cv::KeyPoint> on_level;
    for (const Corner& c : corners) {
      const float angle = orb_orientation(image, c.x, c.y);
      const Eigen::Vector2f pixel = in_full_image(c, image.size(), gray.size());
      result.points.push_back({pixel, 0.0F, angle, static_cast<float>(c.score), level});
      result.patches.push_back(cut_patch(image, c.x, c.y, pixel));
      on_level.emplace_back(static_cast<float>(c.x), static_cast<float>(c.y), 31.0F, angle);
    }

    const std::vector<Descriptor256> descriptors = describe(image, on_level);
    result.descriptors.insert(result.descriptors.end(), descriptors.begin(), descriptors.end());
  }

  return result;
}

}  // namespace plumbline::features
