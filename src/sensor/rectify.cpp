// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/sensor/rectify.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <vector>

#include "plumbline/core/clones.hpp"

namespace plumbline::sensor {
namespace {

constexpr std::uint16_t kNoReading = 0;
constexpr std::uint16_t kSaturated = 65535;  // what 7-Scenes and some drivers write where there is no depth

float metres(std::uint16_t raw, float scale) {
  return raw == kNoReading || raw == kSaturated ? 0.0F : static_cast<float>(raw) / scale;
}

/// metres() of a row.
PLUMBLINE_CLONES void row_to_metres(const std::uint16_t* raw, int count, float scale, float* to) {
  for (int u = 0; u < count; ++u) {
    const bool nothing = (raw[u] == kNoReading) | (raw[u] == kSaturated);
    const float z = static_cast<float>(raw[u]) / scale;
    to[u] = nothing ? 0.0F : z;
  }
}

/// 1 / z = 1 / z_measured + slope . (x, y); what would come to lie behind the camera is no reading.
void correct_slope(const Pinhole& camera, const std::array<double, 2>& slope, cv::Mat& depth) {
  if (slope[0] == 0.0 && slope[1] == 0.0) return;
  for (int v = 0; v < depth.rows; ++v) {
    const double row = slope[1] * (v - camera.cy) / camera.fy;
    auto* z = depth.ptr<float>(v);
    for (int u = 0; u < depth.cols; ++u) {
      const double shrink = 1.0 + static_cast<double>(z[u]) * (slope[0] * (u - camera.cx) / camera.fx + row);
      z[u] = shrink > 0.1 ? static_cast<float>(static_cast<double>(z[u]) / shrink) : 0.0F;
    }
  }
}

}  // namespace

struct Rectifier::Maps {
  Camera camera;
  Pinhole target;
  cv::Mat fixed_xy;                   ///< CV_16SC2, whole part of the source pixel
  cv::Mat fixed_fraction;             ///< CV_16UC1, index into OpenCV's table of bilinear weights
  std::vector<std::int32_t> nearest;  ///< source pixel of every target pixel, -1 outside

  Maps(const Camera& c, const Pinhole& t) : camera(c), target(t) {
    if (!moves_pixels()) return;
    const auto matrix = [](const Pinhole& p) { return cv::Matx33d(p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1); };
    const cv::Mat distortion(1, static_cast<int>(camera.distortion.size()), CV_64F, camera.distortion.data());
    cv::Mat x;
    cv::Mat y;
    cv::initUndistortRectifyMap(matrix(camera.color), distortion, cv::noArray(), matrix(target),
                                {target.width, target.height}, CV_32FC1, x, y);
    cv::convertMaps(x, y, fixed_xy, fixed_fraction, CV_16SC2);
    if (!(camera.color_from_depth && camera.depth)) fill_nearest(x, y);
  }

  [[nodiscard]] bool moves_pixels() const {
    const Pinhole& p = camera.color;
    return camera.distorted() || p.fx != target.fx || p.fy != target.fy || p.cx != target.cx ||
           p.cy != target.cy;
  }

  void fill_nearest(const cv::Mat& x, const cv::Mat& y) {
    nearest.reserve(x.total());
    for (int v = 0; v < x.rows; ++v) {
      for (int u = 0; u < x.cols; ++u) {
        const int su = cvRound(x.at<float>(v, u));
        const int sv = cvRound(y.at<float>(v, u));
        const bool inside = su >= 0 && sv >= 0 && su < x.cols && sv < x.rows;
        nearest.push_back(inside ? sv * x.cols + su : -1);
      }
    }
  }

  [[nodiscard]] cv::Mat converted(const cv::Mat& raw) const;
  [[nodiscard]] cv::Mat undistorted(const cv::Mat& raw) const;
  [[nodiscard]] cv::Mat registered(const cv::Mat& raw) const;
};

/// Raw units to metres, pixel by pixel.
cv::Mat Rectifier::Maps::converted(const cv::Mat& raw) const {
  cv::Mat out(raw.size(), CV_32FC1);
  const auto scale = static_cast<float>(camera.depth_scale);
  for (int v = 0; v < raw.rows; ++v)
    row_to_metres(raw.ptr<std::uint16_t>(v), raw.cols, scale, out.ptr<float>(v));
  return out;
}

cv::Mat Rectifier::Maps::undistorted(const cv::Mat& raw) const {
  const cv::Mat source = raw.isContinuous() ? raw : raw.clone();
  cv::Mat out(raw.size(), CV_32FC1);
  const auto scale = static_cast<float>(camera.depth_scale);
  const auto* from = source.ptr<std::uint16_t>();
  auto* to = out.ptr<float>();
  for (std::size_t i = 0; i < nearest.size(); ++i)
    to[i] = nearest[i] < 0 ? 0.0F : metres(from[nearest[i]], scale);
  return out;
}

/// Every depth pixel covers, in the colour image, the rectangle that its own square projects to; the
/// nearest surface wins. Rectangles of neighbours on one surface meet, so a change of resolution tears no
/// holes.
cv::Mat Rectifier::Maps::registered(const cv::Mat& raw) const {
  constexpr double slack_px = 0.25;  // closes the seams that parallax opens between neighbours on a slope
  const Pinhole& d = *camera.depth;
  const Pinhole& c = target;
  const geometry::Rigid3& color_from_depth = *camera.color_from_depth;
  const auto scale = static_cast<float>(camera.depth_scale);
  cv::Mat out = cv::Mat::zeros(c.height, c.width, CV_32FC1);
  for (int v = 0; v < raw.rows; ++v) {
    const auto* from = raw.ptr<std::uint16_t>(v);
    for (int u = 0; u < raw.cols; ++u) {
      const double z_depth = static_cast<double>(metres(from[u], scale));
      if (z_depth <= 0.0) continue;
      const Eigen::Vector3d p = color_from_depth * d.unproject(u, v, z_depth);
      if (p.z() <= 1e-3) continue;
      const Eigen::Vector2d centre = c.project(p);
      const double half_u = 0.5 * c.fx / d.fx * z_depth / p.z() + slack_px;
      const double half_v = 0.5 * c.fy / d.fy * z_depth / p.z() + slack_px;
      // clamped before the cast: a point far outside must not overflow an int
      const int u0 = static_cast<int>(std::ceil(std::clamp(centre.x() - half_u, 0.0, c.width + 0.0)));
      const int u1 = static_cast<int>(std::floor(std::clamp(centre.x() + half_u, -1.0, c.width - 1.0)));
      const int v0 = static_cast<int>(std::ceil(std::clamp(centre.y() - half_v, 0.0, c.height + 0.0)));
      const int v1 = static_cast<int>(std::floor(std::clamp(centre.y() + half_v, -1.0, c.height - 1.0)));
      const auto z = static_cast<float>(p.z());
      for (int y = v0; y <= v1; ++y) {
        auto* to = out.ptr<float>(y);
        for (int x = u0; x <= u1; ++x) {
          if (to[x] == 0.0F || z < to[x]) to[x] = z;
        }
      }
    }
  }
  return out;
}

Rectifier::Rectifier(const Camera& camera, const Pinhole& target)
    : maps_(std::make_unique<const Maps>(camera, target)) {}
Rectifier::~Rectifier() = default;

cv::Mat Rectifier::color(const cv::Mat& raw) const {
  const Pinhole& p = maps_->camera.color;
  if (raw.cols != p.width || raw.rows != p.height || raw.depth() != CV_8U) {
    throw std::invalid_argument("Rectifier::color: an 8-bit image of the camera's size is needed");
  }
  if (!maps_->moves_pixels()) return raw;
  cv::Mat out;
  // The rim is repeated outwards: a black rim would be one long, strong line for every line detector.
  cv::remap(raw, out, maps_->fixed_xy, maps_->fixed_fraction, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return out;
}

cv::Mat Rectifier::depth(const cv::Mat& raw16) const {
  const Camera& camera = maps_->camera;
  const bool own_camera = camera.color_from_depth && camera.depth;
  const Pinhole& p = own_camera ? *camera.depth : camera.color;
  if (raw16.type() != CV_16UC1 || raw16.cols != p.width || raw16.rows != p.height) {
    throw std::invalid_argument("Rectifier::depth: a 16-bit image of the depth camera's size is needed");
  }
  cv::Mat metres = own_camera              ? maps_->registered(raw16)
                   : maps_->moves_pixels() ? maps_->undistorted(raw16)
                                           : maps_->converted(raw16);
  correct_slope(maps_->target, camera.depth_slope, metres);
  return metres;
}

}  // namespace plumbline::sensor
