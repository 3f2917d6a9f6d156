// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/live_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "frame_images.hpp"
#include "live/live_source.hpp"

namespace plumbline::dataset {
namespace {

const sensor::Pinhole& depth_camera_of(const sensor::Camera& camera) {
  return camera.depth ? *camera.depth : camera.color;
}

SharedBytes pixels_of(const cv::Mat& image) {
  const cv::Mat whole = image.isContinuous() ? image : image.clone();
  return std::make_shared<const core::Bytes>(whole.data, whole.data + whole.total() * whole.elemSize());
}

/// Images of the queue are pixels, CV_8UC3 and CV_16UC1.
class FedImages final : public ImageSource {
 public:
  FedImages(std::string name, std::shared_ptr<LiveQueue> queue, const sensor::Camera& camera)
      : name_(std::move(name)),
        queue_(std::move(queue)),
        color_(camera.color),
        depth_(depth_camera_of(camera)) {}

  [[nodiscard]] core::Result<cv::Mat> read(ImageId id) override {
    const SharedBytes bytes = queue_->image(id);
    if (!bytes) return core::input_error(describe(id) + ": does not exist any more");
    const bool color = id.list == ImageList::kColor;
    const sensor::Pinhole& size = color ? color_ : depth_;

    // A copy, because the stored bytes are shared
    cv::Mat image(size.height, size.width, color ? CV_8UC3 : CV_16UC1);
    std::copy(bytes->begin(), bytes->end(), image.data);
    return image;
  }
  [[nodiscard]] std::string describe(ImageId id) const override {
    return fmt::format("{}: frame {}", name_, id.number);
  }

 private:
  std::string name_;
  std::shared_ptr<LiveQueue> queue_;
  sensor::Pinhole color_;
  sensor::Pinhole depth_;
};

core::Result<void> check_size(const char* what, const cv::Mat& image, const sensor::Pinhole& camera) {
  if (image.cols == camera.width && image.rows == camera.height) return {};
  return core::input_error(fmt::format("{} is {} x {} pixels, the camera takes {} x {}", what, image.cols,
                                       image.rows, camera.width, camera.height));
}

core::Result<SharedBytes> checked_color(const cv::Mat& color, const sensor::Camera& camera) {
  if (auto fits = check_size("colour", color, camera.color); !fits) return tl::unexpected(fits.error());
  if (color.type() == CV_8UC1 || color.type() == CV_8UC3) return pixels_of(color_pixels(color, camera.color));
  return core::input_error("colour has neither one nor three channels of 8 bits");
}

/// Depth of the camera's size as 16 bits in its units.
core::Result<SharedBytes> checked_depth(const cv::Mat& depth, const sensor::Camera& camera) {
  if (auto fits = check_size("depth", depth, depth_camera_of(camera)); !fits)
    return tl::unexpected(fits.error());
  if (depth.type() != CV_16UC1 && depth.type() != CV_32FC1)
    return core::input_error(
        "depth has neither 16 bits (units of 1 / depth_scale metres) nor floats (metres)");
  if (depth.type() == CV_32FC1 && !cv::checkRange(depth) && cv::countNonZero(depth == depth) == 0)
    return core::input_error("depth is NaN in every pixel; 0 means no measurement");
  return pixels_of(depth_pixels(depth, camera.depth_scale));
}

}  // namespace

core::Result<LiveFrame> stored_frame(const FrameSource& source, std::size_t index) {
  const PairInfo info = source.info(index);
  const sensor::Camera& camera = source.camera();
  auto pair = source.stored(index);
  if (!pair) return tl::unexpected<core::Error>(pair.error());

  // Stamps as measured, without the delay of depth
  LiveFrame frame;
  frame.stamp = info.stamp;
  frame.depth_stamp = info.depth_stamp - camera.depth_delay_s;

  // The error names the stored image
  const sensor::Pinhole& depth_camera = camera.depth ? *camera.depth : camera.color;
  const std::string color = color_problem(pair->color.pixels, camera.color);
  if (!color.empty()) return core::input_error(pair->color.name + ": " + color);
  const std::string depth = depth_problem(pair->depth.pixels, depth_camera);
  if (!depth.empty()) return core::input_error(pair->depth.name + ": " + depth);

  // Pixels in the types of a live camera
  frame.color = color_pixels(std::move(pair->color.pixels), camera.color);
  frame.depth = depth_pixels(std::move(pair->depth.pixels), camera.depth_scale);
  return frame;
}

LiveFrames::LiveFrames(const sensor::Camera& camera, LiveFramesOptions options)
    : camera_(camera), live_(std::make_shared<LiveCamera>()) {
  live_->name = std::move(options.name);
  live_->queue = std::make_shared<LiveQueue>(options.most_waiting_bytes);
  live_->layout.format = "live";
  live_->layout.images = std::make_shared<FedImages>(live_->name, live_->queue, camera_);
}

core::Result<void> LiveFrames::push(const LiveFrame& frame) {
  // Pixels in the form of the queue.
  auto color = checked_color(frame.color, camera_);
  if (!color) return tl::unexpected(color.error());
  auto depth = checked_depth(frame.depth, camera_);
  if (!depth) return tl::unexpected(depth.error());

  const double depth_stamp = frame.depth_stamp.value_or(frame.stamp);
  if (!std::isfinite(frame.stamp) || !std::isfinite(depth_stamp))
    return core::input_error(
        fmt::format("stamps are finite seconds, not {} and {}", frame.stamp, depth_stamp));

  // The frame gets a place in the queue, or is refused for a reason
  switch (live_->queue->push({frame.stamp, depth_stamp, *color, *depth, frame.odometry})) {
    case LiveQueue::Answer::kTaken:
      return {};
    case LiveQueue::Answer::kEnded:
      return core::input_error("the recording is closed and accepts no more frames");

    case LiveQueue::Answer::kFull:
      return core::input_error(
          fmt::format("{} frames wait to be mapped, as many as there is memory for", waiting()));
    case LiveQueue::Answer::kBackwards:
      break;
  }
  return core::input_error(fmt::format("stamp {} s is not after that of the frame before, {} s", frame.stamp,
                                       live_->queue->info(live_->queue->size() - 1).stamp));
}

void LiveFrames::close() { live_->queue->end(); }
void LiveFrames::abandon() { live_->queue->abandon(); }
std::size_t LiveFrames::waiting() const { return live_->queue->waiting(); }
bool LiveFrames::wait_for_room(std::size_t most, double seconds) const {
  return live_->queue->wait_for_room(most, seconds);
}
std::unique_ptr<LiveFrameSource> LiveFrames::recording() const { return make_live_source(live_, camera_); }

}  // namespace plumbline::dataset
