// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/diagnose/samples.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace plumbline::diagnose {
namespace {

constexpr std::size_t kGroups = 8;
constexpr std::size_t kOffsets[] = {0, 1, 7, 20};
constexpr std::size_t kLastOffset = 20;
constexpr std::size_t kLiveSpacing = 300;
constexpr std::size_t kStretches = 5;
constexpr std::size_t kStretch = 120;
constexpr int kDepthWidth = 320;
constexpr int kThumbnailWidth = 80;

/// First frame of a group.
std::size_t group_start(std::size_t group, std::size_t frames) {
  if (frames == 0) return group * kLiveSpacing;
  const std::size_t last = frames > kLastOffset + 1 ? frames - 1 - kLastOffset : 0;
  return group * last / (kGroups - 1);
}

/// Every n-th pixel: means would make depths that are not there.
cv::Mat thinned(const cv::Mat& depth, int step) {
  if (step == 1) return depth.clone();
  cv::Mat thin(depth.rows / step, depth.cols / step, CV_32FC1);
  for (int v = 0; v < thin.rows; ++v) {
    const auto* from = depth.ptr<float>(v * step);
    auto* to = thin.ptr<float>(v);
    for (int u = 0; u < thin.cols; ++u) to[u] = from[u * step];
  }
  return thin;
}

/// Mean inverse depth of each block of the thinned image.
cv::Mat inverse_thumbnail(const cv::Mat& depth, cv::Size size) {
  cv::Mat small(size, CV_32FC1);

  // A few pixels represent each block.
  const int bu = std::max(1, depth.cols / size.width);
  const int bv = std::max(1, depth.rows / size.height);
  const int step = std::max(1, bu / 4);

  for (int v = 0; v < size.height; ++v) {
    auto* to = small.ptr<float>(v);
    for (int u = 0; u < size.width; ++u) {
      float sum = 0.0F;
      int count = 0;

      // Mean of the known depths in the block.
      for (int y = v * bv; y < std::min((v + 1) * bv, depth.rows); y += step) {
        const auto* row = depth.ptr<float>(y);
        for (int x = u * bu; x < std::min((u + 1) * bu, depth.cols); x += step) {
          if (row[x] > 0.0F) sum += 1.0F / row[x], ++count;
        }
      }

      to[u] = count > 0 ? sum / static_cast<float>(count) : 0.0F;
    }
  }
  return small;
}

}  // namespace

Samples::Samples(const sensor::Pinhole& camera, std::size_t frames) : camera_(camera), frames_(frames) {
  step_ = std::max(1, camera.width / kDepthWidth);
  const double s = step_;
  depth_camera_ = {camera.width / step_, camera.height / step_, camera.fx / s,
                   camera.fy / s,        camera.cx / s,         camera.cy / s};
}

bool Samples::wants_sample(std::size_t index) const {
  for (std::size_t g = 0; g < kGroups; ++g) {
    const std::size_t start = group_start(g, frames_);

    // Neighbours at several distances in time.
    for (const std::size_t offset : kOffsets) {
      if (index == start + offset) return true;
    }
  }
  return false;
}

bool Samples::wants_thumbnail(std::size_t index) const {
  if (frames_ == 0) return index < kStretches * kStretch;
  if (frames_ <= kStretches * kStretch) return true;
  const std::size_t spacing = (frames_ - kStretch) / (kStretches - 1);
  return index % spacing < kStretch;
}

std::vector<std::size_t> Samples::wanted() const {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < frames_; ++i) {
    if (wants_sample(i)) all.push_back(i);
  }
  return all;
}

void Samples::add(const sensor::RgbdFrame& frame) {
  const auto index = static_cast<std::size_t>(frame.index);
  if (frame.depth.empty() || frame.gray.empty()) return;

  // Groups of frames, spread over the recording.
  if (wants_sample(index)) {
    Sample sample{index, frame.stamp, frame.gray.clone(), thinned(frame.depth, step_)};
    const std::lock_guard<std::mutex> lock(mutex_);
    samples_.push_back(std::move(sample));
  }

  // Dense stretches, for motion between frames.
  if (wants_thumbnail(index)) {
    const cv::Size size(kThumbnailWidth, std::max(1, kThumbnailWidth * frame.gray.rows / frame.gray.cols));
    Thumbnail thumbnail{index, frame.stamp, frame.depth_stamp, {}, inverse_thumbnail(frame.depth, size)};
    cv::Mat small;
    cv::resize(frame.gray, small, size, 0.0, 0.0, cv::INTER_AREA);
    small.convertTo(thumbnail.gray, CV_32F);
    const std::lock_guard<std::mutex> lock(mutex_);
    thumbnails_.push_back(std::move(thumbnail));
  }
}

namespace {

template <typename T>
std::vector<T> sorted(std::vector<T> all) {
  std::sort(all.begin(), all.end(), [](const T& a, const T& b) { return a.index < b.index; });
  return all;
}

}  // namespace

std::vector<Sample> Samples::samples() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return sorted(samples_);
}

std::vector<Thumbnail> Samples::thumbnails() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return sorted(thumbnails_);
}

}  // namespace plumbline::diagnose
