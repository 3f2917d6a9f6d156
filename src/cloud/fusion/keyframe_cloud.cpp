// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/fusion/keyframe_cloud.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "finite.hpp"
#include "fusion/inverse_depth.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::cloud {
namespace {

/// Half base in cells that gives the same angular noise at every depth as `at_2m` pixels do at 2 m.
int base_cells(float w, float sigma, float at_2m, int stride, int longest) {
  const float at = inverse_depth_sigma(0.5F) / 0.5F;
  const float pixels = at_2m * std::clamp(sigma / (w * at), 0.4F, 1.75F);
  return std::clamp(static_cast<int>(std::lround(pixels / static_cast<float>(stride))), 2, longest);
}

/// Strength of smoothing for this depth image, 0 to 1: its noise relative to the sensor model's, measured by
/// the bending of the inverse depth, which is straight on planes. 1 from half the model's noise on; below,
/// details of the surface soon outweigh it. Exact depth is not changed.
float smoothing_share(const cv::Mat& depth, float min_depth, float max_depth) {
  constexpr int kStep = 4;  // px
  constexpr float kMedianOfNormal = 0.6745F;
  constexpr std::size_t kFew = 200;
  std::vector<float> bends;

  // Bending of the inverse depth, relative to its noise
  for (int v = 0; v < depth.rows; v += kStep) {
    const float* row = depth.ptr<float>(v);
    for (int u = kStep; u + kStep < depth.cols; u += kStep) {
      const float least = std::min({row[u - kStep], row[u], row[u + kStep]});
      const float most = std::max({row[u - kStep], row[u], row[u + kStep]});
      if (!(least >= min_depth && most <= max_depth)) continue;

      const float w = 1.0F / row[u];
      const float bend = std::abs(1.0F / row[u - kStep] + 1.0F / row[u + kStep] - 2.0F * w);
      bends.push_back(bend / (2.45F * inverse_depth_sigma(w)));
    }
  }

  // Too few pixels to judge: the model's noise
  if (bends.size() < kFew) return 1.0F;
  const float share = core::median(std::move(bends)) / (0.5F * kMedianOfNormal);
  return std::min(1.0F, share * share);
}

/// Makes the points of one grid, row after row.
class PointMaker {
 public:
  PointMaker(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera,
             const KeyframeCloudOptions& options)
      : frame_(frame),
        stride_(options.stride(frame.depth.cols)),
        base_(static_cast<float>(options.base_px)),
        longest_(std::clamp(static_cast<int>(std::lround(1.75 * options.base_px / stride_)), 2, 250)),
        fx_(static_cast<float>(camera.fx)),
        fy_(static_cast<float>(camera.fy)),
        cx_(static_cast<float>(camera.cx)),
        cy_(static_cast<float>(camera.cy)),
        noise_(2.0F / static_cast<float>(options.smooth_px)),
        grid_(smooth_inverse_depth(frame.depth, stride_, options.smooth_px,
                                   static_cast<float>(options.min_depth_m),
                                   static_cast<float>(options.max_depth_m), fx_)),
        reach_(surface_reach(grid_, stride_, fx_, longest_)),
        position_(options.smooth_position ? positions(options) : Grid()) {}

  [[nodiscard]] int width() const { return grid_.width; }
  [[nodiscard]] int height() const { return grid_.height; }

  void row(int j, Point* out) const {
    const float* w = grid_.row(j);
    const int v = j * stride_;
    const float* depth = frame_.depth.ptr<float>(v);
    const cv::Vec3b* color = frame_.color.empty() ? nullptr : frame_.color.ptr<cv::Vec3b>(v);

    const float y = (static_cast<float>(v) - cy_) / fy_;
    for (int i = 0; i < grid_.width; ++i) {
      Point& p = out[i];

      // White if there is no colour image
      const int u = i * stride_;
      const cv::Vec3b bgr = color == nullptr ? cv::Vec3b(255, 255, 255) : color[u];
      p.b = bgr[0];
      p.g = bgr[1];
      p.r = bgr[2];
      p.a = 255;
      p.normal_x = p.normal_y = p.normal_z = kNan;

      // Pixels without depth
      if (w[i] == 0.0F) {
        p.x = p.y = p.z = kNan;
        continue;
      }

      // Position from the mean, or from the raw depth
      const float x = (static_cast<float>(u) - cx_) / fx_;
      p.z = position_.values.empty() ? depth[u] : 1.0F / position_.row(j)[i];
      p.x = x * p.z;
      p.y = y * p.z;
      set_normal(w + i, j, i, x, y, p);
    }
  }

 private:
  /// Inverse depth of the points' positions: means over neighbours on one plane, over more of them the
  /// noisier the depth. No point moves further than the noise measured in the image.
  [[nodiscard]] Grid positions(const KeyframeCloudOptions& options) const {
    constexpr float kWanted_m = 0.0015F;
    Grid means = grid_;
    const int step = std::max(2, static_cast<int>(std::lround(8.0 / stride_)));
    widen_means(means, step, noise_ * 1.75F, kWanted_m);
    widen_means(means, 2 * step, noise_ * 0.7F, kWanted_m);
    const float most = 3.0F * smoothing_share(frame_.depth, static_cast<float>(options.min_depth_m),
                                              static_cast<float>(options.max_depth_m));

    // No point moves farther than the noise
    for (int j = 0; j < means.height; ++j) {
      const float* depth = frame_.depth.ptr<float>(j * stride_);
      float* row = means.row(j);
      for (int i = 0; i < means.width; ++i) {
        if (row[i] == 0.0F) continue;
        const float raw = 1.0F / depth[i * stride_];
        const float limit = most * inverse_depth_sigma(raw);
        row[i] = std::clamp(row[i], raw - limit, raw + limit);
      }
    }

    return means;
  }
  void set_normal(const float* w, int j, int i, float x, float y, Point& p) const {
    const auto cell =
        static_cast<std::size_t>(j) * static_cast<std::size_t>(grid_.width) + static_cast<std::size_t>(i);
    const float sigma = inverse_depth_sigma(*w);
    const int base = base_cells(*w, sigma, base_, stride_, longest_);
    const Slope along_x = slope_along(w, 1, reach_.left[cell], reach_.right[cell], base, noise_ * sigma);
    if (!along_x.known) return;

    const Slope along_y =
        slope_along(w, grid_.width, reach_.up[cell], reach_.down[cell], base, noise_ * sigma);
    if (!along_y.known) return;

    // The normal is the gradient of the inverse depth
    const float per_x = fx_ / static_cast<float>(stride_);
    const float per_y = fy_ / static_cast<float>(stride_);
    const float a = along_x.value * per_x;
    const float b = along_y.value * per_y;
    const float c = *w - a * x - b * y;

    // (a, b, c) . p = 1 on the plane, so it points away from the camera.
    const float scale = -1.0F / std::sqrt(a * a + b * b + c * c);
    p.normal_x = a * scale;
    p.normal_y = b * scale;
    p.normal_z = c * scale;
    p.curvature = -scale * std::hypot(along_x.bend * per_x, along_y.bend * per_y);
  }

  const sensor::RgbdFrame& frame_;
  int stride_;
  float base_;
  int longest_;
  float fx_, fy_, cx_, cy_;
  float noise_;  ///< noise of the smoothed inverse depth relative to the raw one; neighbours are correlated
  Grid grid_;
  Reach reach_;
  Grid position_;  ///< empty: raw depth
};

}  // namespace

void KeyframeCloudOptions::declare(core::OptionTable& table) {
  table.integer("stride", stride_px, {0, 16}, "px",
                "One point per stride x stride pixels; 0: 2, or more in images wider than 1100 px");
  table.number("min_depth", min_depth_m, {0.05, 20.0}, "m", "Smallest depth of points");
  table.number("max_depth", max_depth_m, {0.1, 20.0}, "m", "Largest depth of points");
  table.integer("smooth", smooth_px, {1, 31}, "px", "Window of the edge-aware mean of inverse depth, odd");
  table.boolean("smooth_position", smooth_position,
                "Move points onto the edge-aware mean of the depth around them, wider where it is noisier; "
                "off: raw measurements");
  table.number("base", base_px, {2.0, 60.0}, "px", "Half base of the differences for normals at 2 m");
}

int KeyframeCloudOptions::stride(int width) const {
  constexpr double kWidthPerStride = 440.0;
  if (stride_px > 0) return stride_px;
  return std::max(2, static_cast<int>(std::lround(width / kWidthPerStride)));
}

CloudPtr organised_cloud(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera,
                         const KeyframeCloudOptions& options) {
  const cv::Size size(camera.width, camera.height);
  if (frame.depth.type() != CV_32FC1 || frame.depth.size() != size || size.empty()) {
    throw std::invalid_argument("organised_cloud: depth must be CV_32FC1 of the camera's size");
  }
  if (!frame.color.empty() && (frame.color.type() != CV_8UC3 || frame.color.size() != size)) {
    throw std::invalid_argument("organised_cloud: colour must be CV_8UC3 of the camera's size");
  }

  // Organised: pixels without depth are points as well
  const PointMaker maker(frame, camera, options);
  auto cloud = std::make_shared<Cloud>(static_cast<std::uint32_t>(maker.width()),
                                       static_cast<std::uint32_t>(maker.height()));
  cloud->is_dense = false;
  for (int j = 0; j < maker.height(); ++j) {
    maker.row(j, cloud->points.data() + static_cast<std::ptrdiff_t>(j) * maker.width());
  }
  return cloud;
}

}  // namespace plumbline::cloud
