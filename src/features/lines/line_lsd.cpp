// SPDX-License-Identifier: BSD-3-Clause
#include "lines/line_lsd.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

namespace plumbline::features {
namespace {

constexpr double kTolerance = 0.39269908;  // tau, rad: 22.5 degrees
constexpr float kDensity = 0.7F;           // aligned points per pixel of the rectangle
constexpr float kRadiusStep = 0.75F;       // factor by which the radius of a too thin region is reduced
// 2 / sin(tau): direction certain in spite of quantisation, as published.
constexpr float kStrongGradient = 5.2F;
constexpr double kWeakShare = 0.10;  // of the pixels: up to here weaker gradients may join as well
constexpr float kBinsPerLevel = 2.8F;
constexpr int kBins = 1024;  // of gradient magnitude, for the order of seeds

// Gradient of one pixel as unit vector and magnitude, (gx, gy) / |g| and |g|.
struct Gradient {
  float x = 0.0F;
  float y = 0.0F;
  float magnitude = 0.0F;
};

// Direction of a gradient that may still join a region. What is in one, or has no usable gradient, is no
// number: the only comparison that growing makes fails.
struct Direction {
  float x = std::numeric_limits<float>::quiet_NaN();
  float y = 0.0F;
};

struct Rectangle {
  Eigen::Vector2f start, end;
  float width = 0.0F;
  [[nodiscard]] float length() const { return (end - start).norm(); }
};

class Lsd {
 public:
  Lsd(const cv::Mat& image, float min_gradient, bool exact);
  std::vector<cv::Vec4f> detect(float min_length);

 private:
  struct Pixel {
    int index;
    float x, y;
    [[nodiscard]] Eigen::Vector2f position() const { return {x, y}; }
  };
  using Region = std::vector<Pixel>;  // the seed first

  [[nodiscard]] Pixel pixel(int index) const {
    return {index, static_cast<float>(index % width_), static_cast<float>(index / width_)};
  }
  void give_back(int index) {
    const Gradient& g = gradients_[static_cast<std::size_t>(index)];
    free_[static_cast<std::size_t>(index)] = {g.x, g.y};
  }
  void grow(int seed, float cosine);
  [[nodiscard]] Rectangle fit() const;
  [[nodiscard]] float density(const Rectangle& r) const {
    return static_cast<float>(region_.size()) / (std::max(r.length(), 1.0F) * r.width);
  }
  bool make_dense(Rectangle& rectangle);
  [[nodiscard]] float tolerance_near_seed(float radius) const;
  [[nodiscard]] bool meaningful(const Rectangle& rectangle) const;

  int width_;
  int height_;
  bool exact_;
  std::vector<Gradient> gradients_;
  std::vector<Direction> free_;
  std::vector<int> seeds_;  // strongest first
  Region region_;
  Eigen::Vector2f sum_ = Eigen::Vector2f::Zero();  // of the region's unit gradients
};

Lsd::Lsd(const cv::Mat& image, float min_gradient, bool exact)
    : width_(image.cols),
      height_(image.rows),
      exact_(exact),
      gradients_(static_cast<std::size_t>(width_ * height_)),
      free_(static_cast<std::size_t>(width_ * height_)) {
  const int least_squared = std::max(1, static_cast<int>(std::ceil(4.0F * min_gradient * min_gradient)));
  std::vector<int> usable;
  std::vector<int> bins;
  usable.reserve(gradients_.size() / 3);
  bins.reserve(gradients_.size() / 3);
  std::array<int, kBins + 1> first{};

  // The outermost pixels are never free: regions need no bounds checks.
  for (int y = 1; y + 1 < height_; ++y) {
    const unsigned char* p = image.ptr<unsigned char>(y);
    const unsigned char* q = image.ptr<unsigned char>(y + 1);

    for (int x = 1; x + 1 < width_; ++x) {
      const int a = q[x + 1] - p[x];
      const int b = p[x + 1] - q[x];
      const int gx = a + b;  // twice the gradient of the 2 x 2 block
      const int gy = a - b;
      const int squared = gx * gx + gy * gy;
      if (squared < least_squared) continue;

      const int index = y * width_ + x;
      const float norm = std::sqrt(static_cast<float>(squared));
      gradients_[static_cast<std::size_t>(index)] = {static_cast<float>(gx) / norm,
                                                     static_cast<float>(gy) / norm, 0.5F * norm};

      // Bins by magnitude, strongest first
      const int bin = kBins - 1 - std::min(kBins - 1, static_cast<int>(0.5F * kBinsPerLevel * norm));
      usable.push_back(index);
      bins.push_back(bin);
      ++first[static_cast<std::size_t>(bin) + 1];
    }
  }

  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  // Faint edges are needed in front of a white wall, but only cost time in a busy scene: whole bins are
  // taken, strongest first, until the share is reached, but strong ones always.
  const auto strong = static_cast<std::size_t>(kBins - static_cast<int>(kStrongGradient * kBinsPerLevel));

  const auto enough = static_cast<int>(kWeakShare * width_ * height_);
  std::size_t last = strong;
  while (last < kBins && first[last + 1] <= enough) ++last;
  seeds_.resize(static_cast<std::size_t>(first[last]));

  // Counting sort; only these pixels may join regions
  for (std::size_t i = 0; i < usable.size(); ++i) {
    const auto bin = static_cast<std::size_t>(bins[i]);
    if (bin >= last) continue;
    seeds_[static_cast<std::size_t>(first[bin]++)] = usable[i];
    give_back(usable[i]);
  }
}

// Neighbours join while their level-line angle is within the tolerance of the region's.
void Lsd::grow(int seed, float cosine) {
  struct Step {
    int index;
    float x, y;
  };

  // The eight neighbours of a pixel
  const std::array<Step, 8> around = {{{-width_ - 1, -1.0F, -1.0F},
                                       {-width_, 0.0F, -1.0F},
                                       {-width_ + 1, 1.0F, -1.0F},
                                       {-1, -1.0F, 0.0F},
                                       {1, 1.0F, 0.0F},
                                       {width_ - 1, -1.0F, 1.0F},
                                       {width_, 0.0F, 1.0F},
                                       {width_ + 1, 1.0F, 1.0F}}};

  // The region begins with its seed
  region_.assign(1, pixel(seed));
  free_[static_cast<std::size_t>(seed)] = {};
  float sx = gradients_[static_cast<std::size_t>(seed)].x;
  float sy = gradients_[static_cast<std::size_t>(seed)].y;
  float limit = cosine;  // cos(tolerance) |sum|
  Direction* const free = free_.data();

  // Neighbours whose gradient agrees with the region's sum
  for (std::size_t i = 0; i < region_.size(); ++i) {
    const Pixel from = region_[i];

    for (const Step& step : around) {
      const int index = from.index + step.index;
      const Direction g = free[index];
      if (!(g.x * sx + g.y * sy >= limit)) continue;
      free[index] = {};
      region_.push_back({index, from.x + step.x, from.y + step.y});
      sx += g.x;
      sy += g.y;
      limit = cosine * std::sqrt(sx * sx + sy * sy);
    }
  }

  sum_ = {sx, sy};
}

// Centroid c = sum G x / sum G; direction = eigenvector of the smallest eigenvalue of the weighted inertia
// matrix.
Rectangle Lsd::fit() const {
  float weight = 0.0F;
  Eigen::Vector2f centre = Eigen::Vector2f::Zero();
  for (const Pixel& i : region_) {
    const float g = gradients_[static_cast<std::size_t>(i.index)].magnitude;
    weight += g;
    centre += g * i.position();
  }

  // Weighted second moments
  centre /= weight;
  float xx = 0.0F;
  float yy = 0.0F;
  float xy = 0.0F;

  for (const Pixel& i : region_) {
    const float g = gradients_[static_cast<std::size_t>(i.index)].magnitude;
    const Eigen::Vector2f p = i.position() - centre;
    xx += g * p.x() * p.x();
    yy += g * p.y() * p.y();
    xy += g * p.x() * p.y();
  }

  const float angle = 0.5F * std::atan2(2.0F * xy, xx - yy);
  Eigen::Vector2f d(std::cos(angle), std::sin(angle));
  if (d.x() * sum_.y() - d.y() * sum_.x() > 0.0F) d = -d;  // darker side on the right

  // Extent along and across the direction
  float low = 0.0F;
  float high = 0.0F;
  float left = 0.0F;
  float right = 0.0F;

  for (const Pixel& i : region_) {
    const Eigen::Vector2f p = i.position() - centre;
    const float along = d.dot(p);
    const float across = d.x() * p.y() - d.y() * p.x();
    low = std::min(low, along);
    high = std::max(high, along);
    left = std::min(left, across);
    right = std::max(right, across);
  }

  Rectangle r;
  r.start = centre + low * d;
  r.end = centre + high * d;
  r.width = std::max(1.0F, right - left);
  return r;
}

// Twice the standard deviation of the level-line angles within `radius` of the seed.
float Lsd::tolerance_near_seed(float radius) const {
  const Eigen::Vector2f seed = region_.front().position();
  const Gradient& g = gradients_[static_cast<std::size_t>(region_.front().index)];
  float sum = 0.0F;
  float squares = 0.0F;
  float count = 0.0F;
  for (const Pixel& i : region_) {
    if ((i.position() - seed).squaredNorm() > radius * radius) continue;
    const Gradient& h = gradients_[static_cast<std::size_t>(i.index)];
    const float angle = std::atan2(g.x * h.y - g.y * h.x, g.x * h.x + g.y * h.y);
    sum += angle;
    squares += angle * angle;
    count += 1.0F;
  }
  const float mean = sum / count;
  return 2.0F * std::sqrt(std::max(0.0F, squares / count - mean * mean));
}

// A region bent or branched has too few points for its rectangle: cut it back.
bool Lsd::make_dense(Rectangle& rectangle) {
  if (density(rectangle) >= kDensity) return true;
  const Pixel seed = region_.front();
  const float tolerance = tolerance_near_seed(rectangle.width);

  // Grown again with the tolerance measured near the seed
  for (const Pixel& i : region_) give_back(i.index);
  grow(seed.index, std::cos(tolerance));
  if (region_.size() < 3) return false;

  rectangle = fit();
  const Eigen::Vector2f middle = seed.position();
  float radius = std::max((rectangle.start - middle).norm(), (rectangle.end - middle).norm());

  // Still too few points: a smaller radius
  while (density(rectangle) < kDensity) {
    radius *= kRadiusStep;
    const auto inside = [&](const Pixel& i) {
      return !((i.position() - middle).squaredNorm() > radius * radius);
    };

    const auto kept = std::stable_partition(region_.begin(), region_.end(), inside);
    for (auto i = kept; i != region_.end(); ++i) give_back(i->index);
    region_.erase(kept, region_.end());
    if (region_.size() < 3) return false;
    rectangle = fit();
  }

  return true;
}

// log B(n, k, p), the binomial tail: each term is the one before times (n - j) / (j + 1) p / (1 - p).
double log_binomial_tail(double n, double k, double p) {
  const double first = std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) +
                       k * std::log(p) + (n - k) * std::log(1.0 - p);
  double sum = 1.0;
  double term = 1.0;
  for (double j = k; j < n && term > 1e-9 * sum; ++j) {
    term *= (n - j) / (j + 1.0) * p / (1.0 - p);
    sum += term;
  }
  return first + std::log(sum);
}

// NFA(r) = (N M)^(5/2) gamma B(n, k, p) <= 1, the binomial tail by its Chernoff bound exp(-n KL(k/n || p)),
// or as it is, with as many angle tolerances tried (gamma) as published.
bool Lsd::meaningful(const Rectangle& rectangle) const {
  const auto k = static_cast<double>(region_.size());
  const double n = std::max(k, static_cast<double>((rectangle.length() + 1.0F) * rectangle.width));
  const double p = kTolerance / 3.14159265358979;
  constexpr double kGamma = 11.0;
  const double tests = 2.5 * std::log(static_cast<double>(width_) * height_);
  if (exact_) return log_binomial_tail(std::round(n), k, p) + tests + std::log(kGamma) <= 0.0;
  const double q = k / n;
  const double divergence =
      q * std::log(q / p) + (q < 1.0 ? (1.0 - q) * std::log((1.0 - q) / (1.0 - p)) : 0.0);
  return n * divergence >= tests;
}

std::vector<cv::Vec4f> Lsd::detect(float min_length) {
  std::vector<cv::Vec4f> lines;
  const auto cosine = static_cast<float>(std::cos(kTolerance));
  const auto fewest = static_cast<std::size_t>(std::max(3.0F, min_length));
  for (const int seed : seeds_) {
    if (std::isnan(free_[static_cast<std::size_t>(seed)].x)) continue;
    grow(seed, cosine);
    if (region_.size() < fewest) continue;
    Rectangle r = fit();
    if (!make_dense(r) || r.length() < min_length || !meaningful(r)) continue;
    // A gradient belongs to the middle of its 2 x 2 block.
    lines.emplace_back(r.start.x() + 0.5F, r.start.y() + 0.5F, r.end.x() + 0.5F, r.end.y() + 0.5F);
  }
  return lines;
}

}  // namespace

std::vector<cv::Vec4f> detect_lsd(const cv::Mat& image, float min_length, float min_gradient, bool exact) {
  CV_Assert(image.type() == CV_8UC1);
  if (image.cols < 4 || image.rows < 4) return {};
  return Lsd(image, min_gradient, exact).detect(min_length);
}

}  // namespace plumbline::features
