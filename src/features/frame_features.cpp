// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/frame_features.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "depth_roughness.hpp"
#include "plumbline/features/line_border.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::features {
namespace {

/// Blurred small grey image: blur and noise of the original hardly show in it.
cv::Mat make_thumbnail(const cv::Mat& gray) {
  const cv::Size size(kThumbnailWidth, std::max(1, gray.rows * kThumbnailWidth / std::max(1, gray.cols)));
  cv::Mat small;
  cv::resize(gray, small, size, 0, 0, cv::INTER_AREA);
  cv::Mat result;
  small.convertTo(result, CV_32F);
  cv::GaussianBlur(result, result, {3, 3}, 0.8);
  return result;
}

/// Depth at the middle of each thumbnail pixel: the median of a few samples, never a mix over a border.
cv::Mat make_thumbnail_depth(const cv::Mat& depth, const cv::Size& size) {
  cv::Mat result(size, CV_32FC1, cv::Scalar(0));
  if (depth.empty()) return result;
  const float step_x = static_cast<float>(depth.cols) / static_cast<float>(size.width);
  const float step_y = static_cast<float>(depth.rows) / static_cast<float>(size.height);

  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      std::array<float, 5> found{};
      std::size_t count = 0;
      for (const auto& [dx, dy] :
           {std::pair{0.5F, 0.5F}, {0.25F, 0.5F}, {0.75F, 0.5F}, {0.5F, 0.25F}, {0.5F, 0.75F}}) {
        const int px = std::min(depth.cols - 1, static_cast<int>((static_cast<float>(x) + dx) * step_x));
        const int py = std::min(depth.rows - 1, static_cast<int>((static_cast<float>(y) + dy) * step_y));
        const float z = depth.at<float>(py, px);
        if (z > 0.0F) found[count++] = z;
      }

      // The median, if most samples have depth
      if (count < 3) continue;
      std::sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count));
      result.at<float>(y, x) = found[count / 2];
    }
  }

  return result;
}

/// True if depth jumps within `reach` pixels of a corner, or is missing in part (as in a border's shadow): on
/// a plane, the inverse depths of opposite sides have their mean in the middle. False if all of it is
/// missing, since then nothing is known.
bool at_border(const cv::Mat& depth, const Eigen::Vector2f& pixel, float reach) {
  const auto at = [&](const Eigen::Vector2f& p) {
    const int u = cvRound(p.x());
    const int v = cvRound(p.y());
    return u < 0 || v < 0 || u >= depth.cols || v >= depth.rows ? 0.0F : depth.at<float>(v, u);
  };

  // Opposite pixels on rings around the corner
  constexpr std::array<float, 4> kRings{0.4F, 0.7F, 1.0F, 1.3F};
  constexpr float kDiagonal = 0.70710678F;
  const std::array<Eigen::Vector2f, 4> ways{
      Eigen::Vector2f(1.0F, 0.0F), Eigen::Vector2f(kDiagonal, kDiagonal), Eigen::Vector2f(0.0F, 1.0F),
      Eigen::Vector2f(-kDiagonal, kDiagonal)};
  constexpr std::size_t kPairs = 16;

  // Without depth here, any depth around is a border
  const float here = at(pixel);
  if (!(here > 0.0F)) {
    for (const float ring : kRings) {
      for (const Eigen::Vector2f& way : ways) {
        if (at(pixel + ring * reach * way) > 0.0F || at(pixel - ring * reach * way) > 0.0F) return true;
      }
    }
    return false;
  }

  // Deviations from a plane that noise does not explain
  const float tolerance = 0.01F + 4.0F * static_cast<float>(sensor::depth_sigma(here)) / here;
  std::size_t seen = 0;

  for (const float ring : kRings) {
    for (const Eigen::Vector2f& way : ways) {
      const float a = at(pixel + ring * reach * way);
      const float b = at(pixel - ring * reach * way);
      if (!(a > 0.0F) || !(b > 0.0F)) continue;
      ++seen;
      if (std::abs(0.5F * (here / a + here / b) - 1.0F) > tolerance) return true;
    }
  }

  // Depth is missing on too many sides
  return 4 * seen < 3 * kPairs;
}

/// Leaves patches at depth borders empty: background and foreground move against each other there.
void empty_patches_at_borders(const cv::Mat& depth, const OrbExtractor& extractor, OrbFeatures& orb) {
  if (depth.empty()) return;
  constexpr int kSteps = 5;  // from the corner to the end of the tested range
  std::vector<float> roughness;
  std::vector<std::size_t> asked;

  // Patches that span a depth border
  for (std::size_t i = 0; i < orb.points.size(); ++i) {
    const Eigen::Vector2f& pixel = orb.points[i].pixel;
    const auto reach = static_cast<float>(CornerPatch::kReach) * extractor.sigma(orb.points[i].octave);
    if (at_border(depth, pixel, reach)) {
      orb.patches[i].gray.fill(0);
      continue;
    }

    // Roughness of the depth under the patch
    const int x = std::clamp(cvRound(pixel.x()), 0, depth.cols - 1);
    const int y = std::clamp(cvRound(pixel.y()), 0, depth.rows - 1);
    if (!(depth.at<float>(y, x) > 0.0F)) continue;  // nothing is known
    roughness.push_back(depth_roughness(depth, x, y, cvRound(reach), std::max(1, cvRound(reach) / kSteps)));
    asked.push_back(i);
  }

  // Patches on rougher depth than usual
  const float limit = roughness_limit(roughness);
  for (std::size_t k = 0; k < asked.size(); ++k) {
    if (roughness[k] > limit) orb.patches[asked[k]].gray.fill(0);
  }
}

}  // namespace

PointGrid::PointGrid(const std::vector<PointFeature>& points, int width, int height)
    : columns_(std::max(1, (width + kCell - 1) / kCell)), rows_(std::max(1, (height + kCell - 1) / kCell)) {
  const auto cell_of = [&](const PointFeature& p) {
    const int c = std::clamp(static_cast<int>(p.pixel.x()) / kCell, 0, columns_ - 1);
    const int r = std::clamp(static_cast<int>(p.pixel.y()) / kCell, 0, rows_ - 1);
    return static_cast<std::size_t>(r * columns_ + c);
  };

  // Counting sort: where each cell begins
  begin_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  for (const PointFeature& p : points) ++begin_[cell_of(p) + 1];
  for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];

  // Points in the order of their cells
  order_.resize(points.size());
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    order_[static_cast<std::size_t>(next[cell_of(points[i])]++)] = static_cast<int>(i);
  }
}

void PointGrid::within(const std::vector<PointFeature>& points, float x, float y, float radius,
                       std::vector<int>& indices) const {
  if (columns_ == 0) return;
  const auto cell = [](float v, int count) {
    return std::clamp(static_cast<int>(std::floor(v / static_cast<float>(kCell))), 0, count - 1);
  };
  const float radius_sq = radius * radius;

  // Only cells that the circle may touch
  for (int r = cell(y - radius, rows_); r <= cell(y + radius, rows_); ++r) {
    for (int c = cell(x - radius, columns_); c <= cell(x + radius, columns_); ++c) {
      const auto k = static_cast<std::size_t>(r * columns_ + c);

      for (int i = begin_[k]; i < begin_[k + 1]; ++i) {
        const int index = order_[static_cast<std::size_t>(i)];
        const Eigen::Vector2f& p = points[static_cast<std::size_t>(index)].pixel;
        const float dx = p.x() - x;
        const float dy = p.y() - y;
        if (dx * dx + dy * dy <= radius_sq) indices.push_back(index);
      }
    }
  }
}

CornerDepth corner_depth(const cv::Mat& depth, float x, float y) {
  if (depth.empty()) return {};
  const int cx = cvRound(x);
  const int cy = cvRound(y);
  constexpr int kRadius = 2;
  float nearest = 1e30F;
  float farthest = 0.0F;
  int count = 0;
  Eigen::Matrix3f normal = Eigen::Matrix3f::Zero();
  Eigen::Vector3f right = Eigen::Vector3f::Zero();

  for (int v = std::max(0, cy - kRadius); v <= std::min(depth.rows - 1, cy + kRadius); ++v) {
    const float* row = depth.ptr<float>(v);

    for (int u = std::max(0, cx - kRadius); u <= std::min(depth.cols - 1, cx + kRadius); ++u) {
      const float z = row[u];
      if (!(z > 0.0F)) continue;
      nearest = std::min(nearest, z);
      farthest = std::max(farthest, z);
      const Eigen::Vector3f basis(1.0F, static_cast<float>(u) - x, static_cast<float>(v) - y);
      normal += basis * basis.transpose();
      right += basis / z;
      ++count;
    }
  }

  if (count < 8) return {};
  const double tolerance = 0.01 * nearest + 6.0 * sensor::depth_sigma(nearest);
  if (farthest - nearest > tolerance) return {};

  const Eigen::Vector3f plane = normal.ldlt().solve(right);
  const float z = 1.0F / plane.x();
  // Too few neighbouring measurements to determine a slant.
  if (!(z >= nearest - tolerance && z <= farthest + tolerance)) return {};
  return {z, plane.tail<2>()};
}

void FeatureOptions::declare(core::OptionTable& table) {
  table.boolean("points", points, "Extract ORB points, track them, and relocalise with them");
  table.boolean("lines", lines, "Extract and track lines");
  table.boolean("photometric", photometric, "Align grey values with keyframes directly");
  orb.declare(table);
  line.declare(table);
}

FeatureExtractor::FeatureExtractor(const FeatureOptions& options, const sensor::Pinhole& camera)
    : options_(options), camera_(camera), orb_(options.orb), lines_(options.line) {}

FrameFeatures FeatureExtractor::extract(const sensor::RgbdFrame& frame) const {
  FrameFeatures result;
  if (frame.gray.empty()) return result;

  // Corners with their depth and slant
  if (options_.points) {
    OrbFeatures orb = orb_.extract(frame.gray, valid_region(frame.gray));
    result.slants.reserve(orb.points.size());
    for (PointFeature& p : orb.points) {
      const CornerDepth found = corner_depth(frame.depth, p.pixel.x(), p.pixel.y());
      p.depth = found.z;
      result.slants.push_back(found.slant);
    }

    // No patch may span a depth border
    empty_patches_at_borders(frame.depth, orb_, orb);
    result.points = std::move(orb.points);
    result.descriptors = std::move(orb.descriptors);
    result.patches = std::move(orb.patches);
    result.levels = std::move(orb.levels);
  }

  if (options_.points || options_.lines)
    result.grid = PointGrid(result.points, frame.gray.cols, frame.gray.rows);
  if (options_.lines) result.lines = lines_.extract(frame.gray, frame.depth, camera_);
  if (options_.photometric)
    result.photometric = std::make_shared<const PhotometricImage>(make_photometric_image(frame.gray));
  result.thumbnail = make_thumbnail(frame.gray);
  result.thumbnail_depth = make_thumbnail_depth(frame.depth, result.thumbnail.size());
  return result;
}

}  // namespace plumbline::features
