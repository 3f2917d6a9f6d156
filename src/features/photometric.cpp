// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/photometric.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "depth_roughness.hpp"
#include "plumbline/core/clones.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::features {
namespace {

constexpr int kBorder = 3;  // pixels of a level without samples along the image's edge
constexpr std::array<int, kPhotometricLevels> kCell{3, 2};
constexpr float kNearestSample_m = 0.25F;       // metres
constexpr int kBox = 7;                         // pixels of a level
constexpr float kHalo = 0.5F + 2 * (kBox / 2);  // reach of two such boxes

/// Full pixels of a depth image around one of a level.
struct Surroundings {
  int near_px;  ///< radius within which depth is averaged
  int far_px;   ///< radius from which the local mean takes grey values
};

/// Mean depth of the surface near a pixel; 0 where depth is missing or jumps nearby, because grey values of
/// another surface, even in the local mean, move with that surface.
float continuous_depth(const cv::Mat& depth, int x, int y, const Surroundings& around) {
  const float here = depth.at<float>(y, x);
  if (!(here > kNearestSample_m)) return 0.0F;

  const float tolerance = 0.02F + 6.0F * static_cast<float>(sensor::depth_sigma(here)) / here;
  const int near = around.near_px, far = around.far_px;
  float sum = 1.0F / here;

  // Opposite pixels on four rings
  int count = 1;
  for (const int r : {near / 2, near, (near + far) / 2, far}) {
    for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
      const int xa = x + r * dx, ya = y + r * dy, xb = x - r * dx, yb = y - r * dy;
      if (std::min({xa, xb, ya, yb}) < 0 || std::max(xa, xb) >= depth.cols ||
          std::max(ya, yb) >= depth.rows) {
        if (r > near) continue;
        return 0.0F;
      }

      const float a = depth.at<float>(ya, xa), b = depth.at<float>(yb, xb);
      // On a plane inverse depth on opposite sides has its mean in the middle.
      if (!(a > 0.0F) || !(b > 0.0F) || std::abs(0.5F * (here / a + here / b) - 1.0F) > tolerance)
        return 0.0F;
      if (r > near) continue;
      sum += 1.0F / a + 1.0F / b;
      count += 2;
    }
  }

  return static_cast<float>(count) / sum;
}

struct Spot {
  int x = -1;
  int y = -1;
  float steepness = -1.0F;
};

float steepness(const cv::Mat& image, int x, int y) {
  const float gx = image.at<float>(y, x + 1) - image.at<float>(y, x - 1);
  const float gy = image.at<float>(y + 1, x) - image.at<float>(y - 1, x);
  return gx * gx + gy * gy;
}

// The steepest pixel of a cell.
Spot steepest(const cv::Mat& image, int left, int top, int cell) {
  Spot best;
  for (int y = top; y < top + cell; ++y) {
    for (int x = left; x < left + cell; ++x) {
      const float s = steepness(image, x, y);
      if (s > best.steepness) best = {x, y, s};
    }
  }
  return best;
}

// Bilinear interpolation.
float interpolated(const cv::Mat& image, float x, float y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float sx = x - static_cast<float>(ix), sy = y - static_cast<float>(iy);
  const float* top = image.ptr<float>(iy) + ix;
  const float* low = image.ptr<float>(iy + 1) + ix;
  const float t = top[0] + sx * (top[1] - top[0]), l = low[0] + sx * (low[1] - low[0]);
  return t + sy * (l - t);
}

/// Removes the samples whose surroundings are rougher than most: they contain a border.
void keep_smooth(const std::vector<float>& roughness, std::vector<PhotometricSample>& samples) {
  const float limit = roughness_limit(roughness);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (roughness[i] <= limit) samples[kept++] = samples[i];
  }
  samples.resize(kept);
}

/// Value and slope of an image at the projection of `p`; none too near to the camera or the border.
std::optional<PhotometricSample> sample_at(const cv::Mat& image, const sensor::Pinhole& camera,
                                           const Eigen::Vector3f& p) {
  if (p.z() < kNearestSample_m) return std::nullopt;
  const Eigen::Vector2f pixel = camera.project(p.cast<double>()).cast<float>();
  const float u = pixel.x(), v = pixel.y();
  if (u < 1.0F || v < 1.0F || u > static_cast<float>(image.cols - 3) ||
      v > static_cast<float>(image.rows - 3)) {
    return std::nullopt;
  }
  return PhotometricSample{p,
                           interpolated(image, u, v),
                           {0.5F * (interpolated(image, u + 1.0F, v) - interpolated(image, u - 1.0F, v)),
                            0.5F * (interpolated(image, u, v + 1.0F) - interpolated(image, u, v - 1.0F))}};
}

/// The steepest spot of each cell, where depth is continuous.
std::vector<PhotometricSample> sample_level(const cv::Mat& image, std::size_t level, const cv::Mat& depth,
                                            const sensor::Pinhole& camera,
                                            const geometry::Rigid3& camera_from_depth) {
  std::vector<PhotometricSample> samples;
  std::vector<float> roughness;
  const sensor::Pinhole small = photometric_camera(camera, level);
  const float per_x = static_cast<float>(depth.cols) / static_cast<float>(image.cols);
  const float per_y = static_cast<float>(depth.rows) / static_cast<float>(image.rows);
  const Surroundings around{static_cast<int>(2.5F * per_x + 0.5F), static_cast<int>(kHalo * per_x + 0.5F)};
  const int cell = kCell[level];
  const Eigen::Matrix3f rotation = camera_from_depth.rotation.cast<float>();
  const Eigen::Vector3f translation = camera_from_depth.translation.cast<float>();

  // A cell's steepest pixel, where depth is continuous
  for (int cy = kBorder; cy + cell <= image.rows - kBorder; cy += cell) {
    for (int cx = kBorder; cx + cell <= image.cols - kBorder; cx += cell) {
      const Spot best = steepest(image, cx, cy, cell);
      const int full_x = static_cast<int>((static_cast<float>(best.x) + 0.5F) * per_x);
      const int full_y = static_cast<int>((static_cast<float>(best.y) + 0.5F) * per_y);
      const float z = continuous_depth(depth, full_x, full_y, around);
      if (!(z > 0.0F)) continue;

      // From the depth image to the camera
      const Eigen::Vector3f in_depth = camera.unproject(full_x, full_y, static_cast<double>(z)).cast<float>();
      const auto sample = sample_at(image, small, rotation * in_depth + translation);
      if (!sample) continue;

      samples.push_back(*sample);
      roughness.push_back(
          depth_roughness(depth, full_x, full_y, around.near_px, static_cast<int>(level) + 1));
    }
  }

  // Rough depth is not reliable
  keep_smooth(roughness, samples);
  return samples;
}

/// Means of 2 x 2 pixels, not rounded.
PLUMBLINE_CLONES void halve_rows(const std::uint8_t* top, const std::uint8_t* low, int count, float* to) {
  for (int x = 0; x < count; ++x) {
    const int sum = top[2 * x] + top[2 * x + 1] + low[2 * x] + low[2 * x + 1];
    to[x] = 0.25F * static_cast<float>(sum);
  }
}

/// Half of the image's size. An odd size has no pairs of pixels: each of half the size gets its share of
/// three.
cv::Mat half_size(const cv::Mat& gray) {
  const cv::Size size(gray.cols / 2, gray.rows / 2);
  cv::Mat half(size, CV_32FC1);
  if (gray.cols % 2 == 0 && gray.rows % 2 == 0) {
    for (int y = 0; y < size.height; ++y)
      halve_rows(gray.ptr(2 * y), gray.ptr(2 * y + 1), size.width, half.ptr<float>(y));
  } else {
    cv::Mat exact;
    gray.convertTo(exact, CV_32F);
    cv::resize(exact, half, size, 0, 0, cv::INTER_AREA);
  }
  return half;
}

}  // namespace

PhotometricImage make_photometric_image(const cv::Mat& gray) {
  PhotometricImage result;
  if (gray.cols < 64 || gray.rows < 64) return result;
  cv::Mat half;
  for (cv::Mat& level : result) {
    if (half.empty()) {
      half = half_size(gray);
    } else {
      cv::resize(half, half, {half.cols / 2, half.rows / 2}, 0, 0, cv::INTER_AREA);
    }
    cv::Mat smooth, mean;
    cv::GaussianBlur(half, smooth, {3, 3}, 0.6);
    // Two boxes have the spread of a Gaussian of 2.8 pixels.
    cv::boxFilter(half, mean, CV_32F, {kBox, kBox});
    cv::boxFilter(mean, mean, CV_32F, {kBox, kBox});
    level = smooth - mean;
  }
  return result;
}

sensor::Pinhole photometric_camera(const sensor::Pinhole& camera, std::size_t level) {
  sensor::Pinhole result = camera;
  for (std::size_t i = 0; i <= level; ++i) result = result.resized(result.width / 2, result.height / 2);
  return result;
}

PhotometricSamples sample_photometric(const PhotometricImage& image, const cv::Mat& depth,
                                      const sensor::Pinhole& camera,
                                      const geometry::Rigid3& camera_from_depth) {
  PhotometricSamples result;
  if (depth.empty()) return result;
  for (std::size_t level = 0; level < kPhotometricLevels; ++level) {
    if (!image[level].empty())
      result[level] = sample_level(image[level], level, depth, camera, camera_from_depth);
  }
  return result;
}

}  // namespace plumbline::features
