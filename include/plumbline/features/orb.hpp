// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// ORB points spread evenly over the image (docs/method/features.md).
#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <opencv2/core/types.hpp>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/corner_patch.hpp"
#include "plumbline/features/descriptor.hpp"

namespace plumbline::features {

struct PointFeature {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  ///< full resolution, rectified image
  float depth = 0.0F;     ///< metres; 0: none, or not to be trusted (border of an object)
  float angle = 0.0F;     ///< orientation, degrees [0, 360)
  float response = 0.0F;  ///< FAST score
  std::int32_t octave = 0;
};

struct OrbOptions {
  int count = 1000;
  double scale_factor = 1.2;  ///< not an option: weights of corners depend on it
  int levels = 8;
  int fast_threshold = 20;
  int fast_threshold_min = 7;
  /// Gradients around a corner (7 x 7 pixels of its level): least share of the weaker principal direction in
  /// the stronger one, squared. On an edge a point matches as well a few pixels further along it, so that it
  /// holds a direction that it does not know. 0: all are kept.
  double min_corner = 0.03;
  bool spread = true;  ///< evenly over the image; off: the strongest, wherever they are
  void declare(core::OptionTable& table);
};

/// Points and descriptors of one image, same order; deterministic.
struct OrbFeatures {
  std::vector<PointFeature> points;
  std::vector<Descriptor256> descriptors;
  std::vector<CornerPatch> patches;
  std::vector<cv::Mat> levels;  ///< CV_8UC1, the image in each octave
};

/// FAST corners on a pyramid; in every cell of a grid the strongest are kept, with a lower threshold where a
/// cell has none; orientation by intensity centroid; descriptors by OpenCV's ORB.
/// Const methods are thread-safe.
class OrbExtractor {
 public:
  explicit OrbExtractor(const OrbOptions& options);
  /// gray: CV_8UC1; region: where features may lie (see valid_region); depth is left 0.
  [[nodiscard]] OrbFeatures extract(const cv::Mat& gray, const cv::Rect& region) const;
  /// Standard deviation of a feature's position in octave `octave`, pixels at full resolution.
  [[nodiscard]] float sigma(int octave) const;

 private:
  OrbOptions options_;
  std::vector<float> scale_;
};

}  // namespace plumbline::features
