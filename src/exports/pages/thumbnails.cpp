// SPDX-License-Identifier: BSD-3-Clause
#include "pages/thumbnails.hpp"

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "pages/jpeg.hpp"
#include "source/pictures.hpp"

namespace plumbline::exports {
namespace {

constexpr int kThumbnailWidth = 160;
constexpr std::size_t kThumbnailBytes = 5000;  // bytes

/// As good a JPEG as fits.
std::string thumbnail(const cv::Mat& bgr) {
  cv::Mat small;
  const double scale = static_cast<double>(kThumbnailWidth) / bgr.cols;
  cv::resize(bgr, small, {kThumbnailWidth, std::max(1, static_cast<int>(std::lround(bgr.rows * scale)))}, 0.0,
             0.0, cv::INTER_AREA);
  std::string bytes;
  for (int quality = 70; quality >= 10; quality -= 15) {
    bytes = encode_jpeg(small, quality);
    if (bytes.size() <= kThumbnailBytes) return bytes;
  }
  return {};
}

}  // namespace

void add_thumbnails(const MapSource& source, MapView& view) {
  if (!source.request().open || !source.has_store()) return;
  const auto pictures = Pictures::open(source);
  if (!pictures) {
    view.notes.push_back("without pictures of keyframes: " + pictures.error().message);
    return;
  }

  std::vector<viewer::Keyframe>& keyframes = view.scene.keyframes;
  source.executor().parallel_for(keyframes.size(), [&](std::size_t i) {
    const auto frame = pictures->find(keyframes[i].robot, keyframes[i].stamp);
    if (!frame) return;
    const auto picture = pictures->read(keyframes[i].robot, *frame);
    if (picture && !picture->color.empty()) keyframes[i].jpeg = thumbnail(picture->color);
  });
}

}  // namespace plumbline::exports
