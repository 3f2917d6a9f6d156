// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <new>
#include <opencv2/videoio.hpp>

#include "images/video_frames.hpp"

namespace plumbline::dataset {
namespace {

cv::VideoCapture& capture(void* video) { return *static_cast<cv::VideoCapture*>(video); }

/// Null if the file is not a video that can be decoded.
void* open_video(const char* file) {
  try {
    auto video = std::make_unique<cv::VideoCapture>(file, cv::CAP_FFMPEG);
    return video->isOpened() ? video.release() : nullptr;
  } catch (const cv::Exception&) {
    return nullptr;
  }
}

void close_video(void* video) { delete &capture(video); }

std::int64_t count_frames(void* video) {
  return static_cast<std::int64_t>(capture(video).get(cv::CAP_PROP_FRAME_COUNT));
}

bool seek_frame(void* video, std::int64_t frame) {
  return capture(video).set(cv::CAP_PROP_POS_FRAMES, static_cast<double>(frame));
}

bool skip_frame(void* video) { return capture(video).grab(); }

/// False after the last frame or at a damaged one.
bool next_frame(void* video, cv::Mat& image) {
  try {
    return capture(video).read(image);
  } catch (const cv::Exception& problem) {
    if (problem.code == cv::Error::StsNoMem) throw std::bad_alloc();
    return false;
  }
}

}  // namespace
}  // namespace plumbline::dataset

PLUMBLINE_PART(plumbline::dataset::VideoDecoder, &plumbline::dataset::open_video,
               &plumbline::dataset::close_video, &plumbline::dataset::count_frames,
               &plumbline::dataset::seek_frame, &plumbline::dataset::skip_frame,
               &plumbline::dataset::next_frame)
