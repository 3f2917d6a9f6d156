// SPDX-License-Identifier: BSD-3-Clause
#include "images/video_frames.hpp"

#include <fmt/format.h>

#include "plumbline/core/git_lfs.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::size_t kRecent = 8;
constexpr std::int64_t kSkipAtMost = 90;  // frames; beyond, seeking is quicker than decoding

}  // namespace

VideoFrames::VideoFrames(std::string file) : file_(std::move(file)) {}

VideoFrames::~VideoFrames() {
  if (video_ != nullptr) decoder_->close(video_);
}

core::Result<void> VideoFrames::open() {
  if (video_ != nullptr) return {};
  const auto& decoder = core::part<VideoDecoder>();
  if (!decoder) return tl::unexpected(decoder.error());
  decoder_ = *decoder;
  video_ = decoder_->open(file_.c_str());
  if (video_ != nullptr) return {};

  // An LFS pointer may replace the video
  const bool pointer = core::is_lfs_pointer(file_);
  return core::input_error(file_ + ": " +
                           (pointer ? core::kLfsPointer : "is not a video that can be decoded"));
}

bool VideoFrames::go_to(std::int64_t frame) {
  // Short distances are faster without a seek
  const bool far = frame < next_ || frame > next_ + kSkipAtMost;
  if (far && !decoder_->seek(video_, frame)) return false;
  if (far) next_ = frame;
  for (; next_ < frame; ++next_) {
    if (!decoder_->skip(video_)) return false;
  }
  return true;
}

core::Result<cv::Mat> VideoFrames::read(std::int64_t frame) {
  const std::lock_guard lock(mutex_);
  if (auto opened = open(); !opened) return tl::unexpected(opened.error());
  if (const auto known = recent_.find(frame); known != recent_.end()) return known->second.clone();
  cv::Mat image;
  if (!go_to(frame) || !decoder_->next(video_, image) || image.type() != CV_8UC3)
    return core::input_error(fmt::format("{}: frame {} cannot be decoded", file_, frame));

  // Neighbouring frames may be read again
  next_ = frame + 1;
  recent_[frame] = image.clone();
  if (recent_.size() > kRecent) recent_.erase(recent_.begin());
  return image.clone();
}

core::Result<std::int64_t> VideoFrames::count() {
  const std::lock_guard lock(mutex_);
  if (auto opened = open(); !opened) return tl::unexpected(opened.error());
  return decoder_->count(video_);
}

}  // namespace plumbline::dataset
