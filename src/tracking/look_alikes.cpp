// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "plumbline/tracking/relocalise.hpp"
#include "plumbline/tracking/thumbnail_alignment.hpp"

namespace plumbline::tracking {
namespace {

constexpr double kMinAlike = 0.6;
constexpr double kMinContrast = 3.0;  // grey values, standard deviation; less is a wall or a covered lens

/// Half the thumbnail's size, blurred so that a shift by a pixel or two changes little.
cv::Mat coarse(const cv::Mat& thumbnail) {
  cv::Mat half;
  cv::resize(thumbnail, half, {thumbnail.cols / 2, thumbnail.rows / 2}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(half, half, {7, 7}, 1.5);
  return half;
}

/// Best normalised correlation of the current image's middle with the other, over shifts of a fifth of the
/// image.
double correlation(const cv::Mat& current, const cv::Mat& other) {
  const cv::Rect middle(current.cols / 5, current.rows / 5, current.cols - 2 * (current.cols / 5),
                        current.rows - 2 * (current.rows / 5));
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(current(middle), mean, deviation);
  if (deviation[0] < kMinContrast) return -1.0;
  cv::Mat scores;
  cv::matchTemplate(other, current(middle), scores, cv::TM_CCOEFF_NORMED);
  double best = -1.0;
  cv::minMaxLoc(scores, nullptr, &best);
  return std::isfinite(best) ? best : -1.0;
}

}  // namespace

std::vector<LookAlike> look_alikes(const maps::Map& map, const std::vector<core::KeyframeId>& candidates,
                                   const features::FrameFeatures& features, int count) {
  if (features.thumbnail.empty() || count <= 0) return {};
  const cv::Mat current = coarse(features.thumbnail);
  std::vector<LookAlike> alike;
  for (core::KeyframeId id : candidates) {
    const cv::Mat& thumbnail = map.keyframe(id).features->thumbnail;
    if (thumbnail.size() != features.thumbnail.size()) continue;
    const double score = correlation(current, coarse(thumbnail));
    if (score >= kMinAlike) alike.push_back({id, score});
  }

  // The most similar first
  std::stable_sort(alike.begin(), alike.end(),
                   [](const LookAlike& a, const LookAlike& b) { return a.correlation > b.correlation; });
  if (alike.size() > static_cast<std::size_t>(count)) alike.resize(static_cast<std::size_t>(count));
  return alike;
}

geometry::Rigid3 align_look_alike(const maps::Map& map, core::KeyframeId keyframe,
                                  const features::FrameFeatures& features, const sensor::Pinhole& camera) {
  const features::FrameFeatures& seen = *map.keyframe(keyframe).features;
  const ThumbnailAlignment aligned =
      align_thumbnails(seen.thumbnail, seen.thumbnail_depth, features.thumbnail, camera, {});
  return aligned.current_from_previous * map.camera_from_world(keyframe);
}

}  // namespace plumbline::tracking
