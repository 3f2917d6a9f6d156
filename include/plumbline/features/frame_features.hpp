// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Everything the tracker and the map need to know of one image; the image itself is kept only until the
// frame is tracked.
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/line_extractor.hpp"
#include "plumbline/features/orb.hpp"
#include "plumbline/features/photometric.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::features {

/// Indices of points by image cell, for look-ups around a pixel.
class PointGrid {
 public:
  PointGrid() = default;
  PointGrid(const std::vector<PointFeature>& points, int width, int height);
  /// Appends the indices of points within `radius` pixels of (x, y), in a fixed order.
  void within(const std::vector<PointFeature>& points, float x, float y, float radius,
              std::vector<int>& indices) const;
  [[nodiscard]] bool made() const { return columns_ > 0; }

 private:
  static constexpr int kCell = 20;  ///< pixels
  int columns_ = 0;
  int rows_ = 0;
  std::vector<int> begin_;  ///< first entry of each cell in order_
  std::vector<int> order_;
};

struct FrameFeatures {
  std::vector<PointFeature> points;
  std::vector<Descriptor256> descriptors;  ///< descriptors of `points`
  std::vector<CornerPatch> patches;        ///< patches of `points`; empty: not known
  std::vector<cv::Mat> levels;  ///< CV_8UC1, the image in each octave; empty once the frame is tracked
  std::shared_ptr<const PhotometricImage> photometric;  ///< for direct alignment; null once it is tracked
  /// Slant of the surface at each point: change of the inverse depth per pixel (1/m). No elements if not
  /// known; keyframes drop them once all of their corners are aligned.
  std::vector<Eigen::Vector2f> slants;
  PointGrid grid;
  std::vector<LineFeature> lines;
  /// Motion of the camera (m, rad, its own frame) while the image was read, as far as the features are
  /// corrected for it: they are at their positions in an image taken all at once. Zero: they are not
  /// corrected.
  geometry::Vector6d shutter_motion = geometry::Vector6d::Zero();
  cv::Mat thumbnail;        ///< CV_32FC1, kThumbnailWidth wide, blurred grey values
  cv::Mat thumbnail_depth;  ///< CV_32FC1 of the same size, metres, 0 = none

  /// True if points or lines were extracted.
  [[nodiscard]] bool extracted() const { return grid.made(); }

  /// Depth of point `i`'s surface `shift` pixels beside it, metres; 0 if unknown.
  [[nodiscard]] float depth_beside(std::size_t i, const Eigen::Vector2f& shift) const {
    const float depth = points[i].depth;
    if (slants.size() != points.size()) return depth;
    const float scale = 1.0F + depth * slants[i].dot(shift);
    return scale > 0.0F ? depth / scale : 0.0F;
  }

  /// Moves point `i` by `shift` (pixels). Its patch is not changed and keeps the offset. `grid` is not
  /// updated: make it again once all points have moved.
  void move_point(std::size_t i, const Eigen::Vector2f& shift) {
    points[i].depth = depth_beside(i, shift);
    points[i].pixel += shift;
    patches[i].offset = shift;
  }
};
constexpr int kThumbnailWidth = 80;

struct FeatureOptions {
  bool points = true;
  bool lines = true;
  bool photometric = true;
  OrbOptions orb;
  LineOptions line;
  void declare(core::OptionTable& table);
};

/// Stateless; extract is thread-safe.
class FeatureExtractor {
 public:
  FeatureExtractor(const FeatureOptions& options, const sensor::Pinhole& camera);
  [[nodiscard]] FrameFeatures extract(const sensor::RgbdFrame& frame) const;

 private:
  FeatureOptions options_;
  sensor::Pinhole camera_;
  OrbExtractor orb_;
  LineExtractor lines_;
};

/// Depth measured at a corner.
struct CornerDepth {
  float z = 0.0F;                                   ///< metres; 0: unknown
  Eigen::Vector2f slant = Eigen::Vector2f::Zero();  ///< as FrameFeatures::slants
};
/// Depth at a place between pixels: the plane (affine inverse depth) through the valid pixels around it.
/// Unknown when there are too few or they spread over a depth border.
CornerDepth corner_depth(const cv::Mat& depth, float x, float y);

}  // namespace plumbline::features
