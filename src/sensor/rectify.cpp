// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/sensor/rectify.hpp"

#include <Eigen/LU>
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
constexpr std::uint16_t kSaturated = 65535;  // written by 7-Scenes and some drivers for missing depth

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

/// 1 / z = 1 / z_measured + slope . (x, y); a depth that would lie behind the camera is dropped.
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

/// Area of another image that a depth pixel covers: a rectangle of a plane.
struct DepthPatch {
  Eigen::Vector2d centre;  ///< pixels
  Eigen::Vector2d half;    ///< half the length of its sides, pixels
  double z = 0.0;          ///< metres, at the centre
  /// Relative change of the inverse depth a pixel, which is the same all over a plane.
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();

  void paint(cv::Mat& out) const;
};

/// Paints into a depth image in which 0 is empty; nearer pixels are kept.
void DepthPatch::paint(cv::Mat& out) const {
  // clamped before the cast: a point far outside must not overflow an int
  const int u0 = static_cast<int>(std::ceil(std::clamp(centre.x() - half.x(), 0.0, out.cols + 0.0)));
  const int u1 = static_cast<int>(std::floor(std::clamp(centre.x() + half.x(), -1.0, out.cols - 1.0)));
  const int v0 = static_cast<int>(std::ceil(std::clamp(centre.y() - half.y(), 0.0, out.rows + 0.0)));
  const int v1 = static_cast<int>(std::floor(std::clamp(centre.y() + half.y(), -1.0, out.rows - 1.0)));
  for (int y = v0; y <= v1; ++y) {
    auto* to = out.ptr<float>(y);
    for (int x = u0; x <= u1; ++x) {
      const double grow = 1.0 + slope.x() * (x - centre.x()) + slope.y() * (y - centre.y());
      const auto here = static_cast<float>(z / grow);
      if (to[x] == 0.0F || here < to[x]) to[x] = here;
    }
  }
}

/// Relative change of the inverse depth from one pixel to the next, of the surface that a measured pixel is
/// on: the mean of both sides, of one where the other is on another surface, and 0 where both are.
double surface_slope(std::uint16_t here, std::uint16_t before, std::uint16_t after) {
  constexpr double kSameSurface = 0.05;
  const auto to = [here](std::uint16_t there) {
    const bool measured = there != kNoReading && there != kSaturated;
    return measured ? static_cast<double>(here) / static_cast<double>(there) - 1.0 : 1.0;
  };
  const double back = -to(before);
  const double ahead = to(after);
  const bool level_back = std::abs(back) < kSameSurface;
  const bool level_ahead = std::abs(ahead) < kSameSurface;
  if (level_back && level_ahead) return 0.5 * (back + ahead);
  return level_back ? back : level_ahead ? ahead : 0.0;
}

/// Change of depth from pixel to pixel along x and y.
Eigen::Vector2d surface_slope(const cv::Mat& raw, int u, int v) {
  const auto at = [&raw](int x, int y) {
    const bool inside = x >= 0 && y >= 0 && x < raw.cols && y < raw.rows;
    return inside ? raw.at<std::uint16_t>(y, x) : kNoReading;
  };
  const std::uint16_t here = at(u, v);
  return {surface_slope(here, at(u - 1, v), at(u + 1, v)), surface_slope(here, at(u, v - 1), at(u, v + 1))};
}

}  // namespace

struct Rectifier::Maps {
  /// Ray (x, y, 1) of a pixel of a distorted image, and half the size of its square there.
  struct LensRay {
    Eigen::Vector2d ray;
    Eigen::Vector2d half;  ///< 0: outside the lens's image
  };
  Camera camera;
  Pinhole target;
  cv::Mat fixed_xy;                   ///< CV_16SC2, whole part of the source pixel
  cv::Mat fixed_fraction;             ///< CV_16UC1, index into OpenCV's table of bilinear weights
  std::vector<std::int32_t> nearest;  ///< source pixel of every target pixel, -1 outside
  std::vector<LensRay> depth_rays;    ///< rays of all depth pixels, if the lens distorts

  /// Computes only the tables that the camera needs.
  Maps(const Camera& c, const Pinhole& t) : camera(c), target(t) {
    if (camera.color_from_depth && camera.depth && camera.depth_lens.distorts()) fill_depth_rays();
    if (!moves_pixels()) return;
    cv::Mat x;
    cv::Mat y;
    source_pixels(x, y);
    cv::convertMaps(x, y, fixed_xy, fixed_fraction, CV_16SC2);
    if (!(camera.color_from_depth && camera.depth)) fill_nearest(x, y);
  }

  /// Positions in the lens's image of each pixel of the target.
  void source_pixels(cv::Mat& x, cv::Mat& y) const {
    const auto matrix = [](const Pinhole& p) { return cv::Matx33d(p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1); };
    const cv::Size size(target.width, target.height);
    Distortion k = camera.distortion;
    if (camera.model == LensModel::kEquidistant) {
      const cv::Mat four(1, 4, CV_64F, k.data());
      cv::fisheye::initUndistortRectifyMap(matrix(camera.color), four, cv::Matx33d::eye(), matrix(target),
                                           size, CV_32FC1, x, y);
      return;
    }
    const cv::Mat all(1, static_cast<int>(k.size()), CV_64F, k.data());
    cv::initUndistortRectifyMap(matrix(camera.color), all, cv::noArray(), matrix(target), size, CV_32FC1, x,
                                y);
  }

  [[nodiscard]] bool moves_pixels() const {
    const Pinhole& p = camera.color;
    return camera.distorted() || p.fx != target.fx || p.fy != target.fy || p.cx != target.cx ||
           p.cy != target.cy;
  }

  /// The source pixel of each rectified pixel; -1 outside the image.
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

  void fill_depth_rays() {
    const Pinhole& d = *camera.depth;
    depth_rays.reserve(static_cast<std::size_t>(d.width) * static_cast<std::size_t>(d.height));
    for (int v = 0; v < d.height; ++v) {
      for (int u = 0; u < d.width; ++u) depth_rays.push_back(lens_ray(u, v));
    }
  }

  [[nodiscard]] LensRay lens_ray(int u, int v) const;
  /// (x, y, 1) of a depth pixel, and half the size of its square there; that is 0 beyond the lens's rim.
  Eigen::Vector3d ray_of(int u, int v, Eigen::Vector2d& half) const;
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

/// Takes the nearest pixel: means across an edge would invent depth.
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

Rectifier::Maps::LensRay Rectifier::Maps::lens_ray(int u, int v) const {
  const Pinhole& d = *camera.depth;
  const auto ray = camera.depth_lens.ray_of(d.unproject(u, v, 1.0).head<2>());
  if (!ray) return {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  const Eigen::Matrix2d by_lens = camera.depth_lens.jacobian(*ray).inverse();
  return {*ray, 0.5 * by_lens.cwiseAbs() * Eigen::Vector2d(1.0 / d.fx, 1.0 / d.fy)};
}

/// The ray of a depth pixel and half its width, at depth 1.
Eigen::Vector3d Rectifier::Maps::ray_of(int u, int v, Eigen::Vector2d& half) const {
  const Pinhole& d = *camera.depth;
  if (depth_rays.empty()) {
    half = {0.5 / d.fx, 0.5 / d.fy};
    return d.unproject(u, v, 1.0);
  }
  const LensRay& bent = depth_rays[static_cast<std::size_t>(v) * static_cast<std::size_t>(d.width) +
                                   static_cast<std::size_t>(u)];
  half = bent.half;
  return bent.ray.homogeneous();
}

/// Every depth pixel covers, in the colour image, the rectangle that its own square projects to; the
/// nearest surface wins. Rectangles of neighbours on one surface meet, so a change of resolution tears no
/// holes, and where each covers several pixels it is tilted as the surface is.
cv::Mat Rectifier::Maps::registered(const cv::Mat& raw) const {
  // A depth pixel may cover several colour pixels
  constexpr double kSlack_px = 0.25;  // closes the seams that parallax opens between neighbours on a slope
  constexpr double kCoarse = 1.5;     // pixels that a depth pixel covers
  const Pinhole& c = target;
  const bool coarse = c.fx > kCoarse * camera.depth->fx;
  const auto scale = static_cast<float>(camera.depth_scale);

  // Each depth pixel becomes a patch
  cv::Mat out = cv::Mat::zeros(c.height, c.width, CV_32FC1);
  for (int v = 0; v < raw.rows; ++v) {
    const auto* from = raw.ptr<std::uint16_t>(v);
    for (int u = 0; u < raw.cols; ++u) {
      const double z_depth = static_cast<double>(metres(from[u], scale));
      if (z_depth <= 0.0) continue;

      // Transformed to the colour camera
      Eigen::Vector2d half;
      const Eigen::Vector3d ray = ray_of(u, v, half);
      const Eigen::Vector3d p = *camera.color_from_depth * (z_depth * ray);
      if (p.z() <= 1e-3 || half.x() == 0.0) continue;

      // A patch as large as the pixel's square there
      const Eigen::Vector2d focal(c.fx, c.fy);
      DepthPatch patch;
      patch.centre = c.project(p);
      patch.half = (half.cwiseProduct(focal) * (z_depth / p.z())).array() + kSlack_px;
      patch.z = p.z();
      if (coarse) patch.slope = surface_slope(raw, u, v).cwiseQuotient(2.0 * half.cwiseProduct(focal));
      patch.paint(out);
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

/// Depth in metres, aligned with the rectified colour image.
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
