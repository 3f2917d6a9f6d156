// SPDX-License-Identifier: BSD-3-Clause
// Where depth steps, something begins in the picture, too. Depth that another lens has seen fits the pictures
// better when it is scaled and moved.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "grade.hpp"

namespace plumbline::diagnose {
namespace {

constexpr int kWorkWidth = 160;
constexpr std::size_t kMostEdges = 2560;
constexpr int kMostShift = 12;  // work pixels
constexpr int kScales = 10;     // to either side
constexpr double kScaleStep = 0.042;
constexpr int kMostGap = 12;  // depth pixels without measurement beside a step: the projector's shadow
constexpr float kStep = 0.12F;

// Evidence: how far the mean gradient at the moved edges rises above that of all moves, in terms of their
// spread.
constexpr double kFits = 3.0;
constexpr double kBetter = 2.3;  // than unmoved
constexpr double kLost = 0.45;   // of that, without the move
constexpr double kOff = 3.0;     // work pixels: turning while depth is 20 ms late moves it by 2

/// A step of depth: last pixel of the nearer side, in work pixels from the picture's centre.
struct Edge {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
  bool across = false;  ///< the step is along a row
};

struct Frame {
  cv::Mat across;  ///< how strongly grey values change along a row, in terms of the neighbourhood
  cv::Mat down;
  std::vector<Edge> edges;
};

struct Transform {
  double scale = 1.0;
  double x = 0.0;  ///< work pixels
  double y = 0.0;
};

/// Gradient over the mean gradient around, at most 3.
cv::Mat relative_gradient(const cv::Mat& gray, int dx, int dy, cv::Size size) {
  cv::Mat gradient, small, around;
  cv::Sobel(gray, gradient, CV_32F, dx, dy, 3, 0.125);
  cv::Mat magnitude = cv::abs(gradient);
  cv::resize(magnitude, small, size, 0.0, 0.0, cv::INTER_AREA);
  cv::blur(small, around, {21, 21});
  cv::Mat relative = small / (around + 1.0);
  cv::Mat most;
  cv::min(relative, 3.0, most);
  cv::GaussianBlur(most, relative, {3, 3}, 0.8);
  return relative;
}

/// Depth steps along rows (`across`) or columns, in pixels of the working image from its centre.
void add_steps(const cv::Mat& depth, bool across, double work_from_depth, std::vector<Edge>& edges) {
  const int outer = across ? depth.rows : depth.cols;
  const int inner = across ? depth.cols : depth.rows;
  const auto z_at = [&](int o, int i) { return across ? depth.at<float>(o, i) : depth.at<float>(i, o); };

  for (int o = 2; o < outer - 2; o += 2) {
    int last = -1;
    for (int i = 0; i < inner; ++i) {
      const float z = z_at(o, i);
      if (!(z > 0.0F)) continue;

      // A wide hole may hide a slope.
      if (last >= 0 && i - last <= kMostGap) {
        const float before = z_at(o, last);
        if (std::abs(z - before) > kStep * std::min(z, before) + 0.03F) {
          // The edge belongs to the nearer surface.
          const double at = z < before ? i - 0.5 : last + 0.5;

          // Relative to the image's centre.
          const double u = (across ? at : o) * work_from_depth - 0.5 * (depth.cols * work_from_depth - 1.0);
          const double v = (across ? o : at) * work_from_depth - 0.5 * (depth.rows * work_from_depth - 1.0);
          edges.push_back({static_cast<float>(u), static_cast<float>(v), std::min(z, before), across});
        }
      }

      // The last pixel with depth, on this side of holes.
      last = i;
    }
  }
}

/// Every n-th, so that there are no more than that.
void thin_out(std::vector<Edge>& edges, std::size_t most) {
  if (edges.size() <= most) return;
  std::vector<Edge> kept;
  for (std::size_t k = 0; k < most; ++k) kept.push_back(edges[k * edges.size() / most]);
  edges = std::move(kept);
}

/// Mean relative gradient where a transform puts the edges.
double score(const std::vector<Frame>& frames, std::size_t half, const Transform& t) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if ((k / 2) % 2 != half) continue;
    const Frame& f = frames[k];
    const float cx = 0.5F * static_cast<float>(f.across.cols - 1) + static_cast<float>(t.x) + 0.5F;
    const float cy = 0.5F * static_cast<float>(f.across.rows - 1) + static_cast<float>(t.y) + 0.5F;
    const auto s = static_cast<float>(t.scale);
    for (const Edge& e : f.edges) {
      const int u = static_cast<int>(e.x * s + cx);
      const int v = static_cast<int>(e.y * s + cy);
      if (u < 1 || v < 1 || u >= f.across.cols - 1 || v >= f.across.rows - 1) continue;
      sum += static_cast<double>((e.across ? f.across : f.down).ptr<float>(v)[u]);
      ++count;
    }
  }
  return count > 200 ? sum / static_cast<double>(count) : 0.0;
}

/// Scores of all transforms: the best one, that of none, their mean and spread.
struct Search {
  Transform best;
  double at_best = 0.0;
  double at_none = 0.0;
  double mean = 0.0;
  double spread = 1.0;
};

/// Scores of all scales and shifts in range.
Search search(const std::vector<Frame>& frames, std::size_t half) {
  Search found;
  double sum = 0.0, squares = 0.0;
  int count = 0;

  for (int s = -kScales; s <= kScales; ++s) {
    for (int y = -kMostShift; y <= kMostShift; ++y) {
      for (int x = -kMostShift; x <= kMostShift; ++x) {
        const Transform t{std::exp(s * kScaleStep), static_cast<double>(x), static_cast<double>(y)};
        const double value = score(frames, half, t);

        if (s == 0 && x == 0 && y == 0) found.at_none = value;
        if (value > found.at_best) found.at_best = value, found.best = t;
        sum += value;
        squares += value * value;
        ++count;
      }
    }
  }

  // Spread of scores, to judge the best one.
  found.mean = sum / count;
  found.spread = std::sqrt(std::max(1e-9, squares / count - found.mean * found.mean));
  return found;
}

/// Mean distance by which two transforms differ at the edges, work pixels.
double distance(const std::vector<Frame>& frames, const Transform& a, const Transform& b) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const Frame& f : frames) {
    for (const Edge& e : f.edges) {
      sum += std::hypot(e.x * (a.scale - b.scale) + a.x - b.x, e.y * (a.scale - b.scale) + a.y - b.y);
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

}  // namespace

Sign registration_sign(const Samples& samples) {
  Sign sign{"not_registered", "px"};
  std::vector<Frame> frames;
  const std::vector<Sample> all = samples.samples();

  // Two frames of each group.
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (k % 4 != 0 && k % 4 != 3) continue;
    const Sample& sample = all[k];
    const cv::Size size(kWorkWidth, kWorkWidth * sample.gray.rows / sample.gray.cols);
    Frame frame{relative_gradient(sample.gray, 1, 0, size), relative_gradient(sample.gray, 0, 1, size), {}};

    // Edges along both directions, thinned out.
    const double work_from_depth = static_cast<double>(kWorkWidth) / sample.depth.cols;
    add_steps(sample.depth, true, work_from_depth, frame.edges);
    add_steps(sample.depth, false, work_from_depth, frame.edges);
    thin_out(frame.edges, kMostEdges / 16);
    frames.push_back(std::move(frame));
  }

  if (frames.size() < 4) return sign;

  // The finding of one half of the recording must hold for the other one.
  const Search a = search(frames, 0);
  const Search b = search(frames, 1);
  const double a_by_b = (score(frames, 0, b.best) - a.mean) / a.spread,
               a_now = (a.at_none - a.mean) / a.spread;
  const double b_by_a = (score(frames, 1, a.best) - b.mean) / b.spread,
               b_now = (b.at_none - b.mean) / b.spread;

  const double gain = std::min(a_by_b - a_now, b_by_a - b_now);
  const double kept = std::max(a_now / std::max(a_by_b, 1e-3), b_now / std::max(b_by_a, 1e-3));
  const double off = std::min(distance(frames, a.best, {}), distance(frames, b.best, {}));

  // Evidence: fit, gain, loss and size.
  const double px = static_cast<double>(all.front().gray.cols) / kWorkWidth;
  sign.size = off * px;
  if (!grade(sign, {std::min(a_by_b, b_by_a) / kFits, gain / kBetter, (1.0 - kept) / kLost, off / kOff}))
    return sign;

  const Transform& t = a_by_b - a_now > b_by_a - b_now ? b.best : a.best;
  sign.text = fmt::format(
      "colour and depth are not registered: edges of depth lie {:.0f} px off those of the pictures (depth "
      "fits when it is {:.2f} times as large and moved by {:+.0f}, {:+.0f} px)",
      sign.size, t.scale, t.x * px, t.y * px);
  sign.remedy = fmt::format(
      "record depth aligned to colour, or add the depth camera to camera.yaml (color_from_depth, and depth: "
      "with fx about {:.0f}; docs/guide/inputs.md)",
      samples.camera().fx / t.scale);
  return sign;
}

}  // namespace plumbline::diagnose
