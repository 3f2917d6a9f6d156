// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/live_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "convert/copy_target.hpp"
#include "frame_images.hpp"
#include "plumbline/core/packed_blocks.hpp"
#include "plumbline/sensor/rectify.hpp"

namespace plumbline::dataset {

/// As the camera took them.
struct LiveImages {
  cv::Mat color;  ///< CV_8UC3
  cv::Mat depth;  ///< CV_16UC1
};

/// Images by frame, packed.
class PackedLiveImages {
 public:
  void open(const std::filesystem::path& folder) { blocks_.open(folder); }

  void put(std::size_t index, const LiveImages& images) {
    if (has(index)) return;
    core::Bytes bytes;
    for (const cv::Mat& image : {images.color, images.depth}) {
      const cv::Mat whole = image.isContinuous() ? image : image.clone();
      bytes.insert(bytes.end(), whole.data, whole.data + whole.total() * whole.elemSize());
    }
    numbers_[index] = blocks_.add(bytes);
  }

  [[nodiscard]] bool has(std::size_t index) const { return numbers_.count(index) != 0; }
  [[nodiscard]] std::size_t frames() const { return numbers_.size(); }
  [[nodiscard]] std::size_t bytes() const { return blocks_.bytes(); }

  [[nodiscard]] std::optional<LiveImages> get(std::size_t index, const cv::Size& color,
                                              const cv::Size& depth) const {
    const auto found = numbers_.find(index);
    if (found == numbers_.end()) return std::nullopt;
    const std::optional<core::Bytes> bytes = blocks_.get(found->second);
    if (!bytes) return std::nullopt;

    LiveImages images{cv::Mat(color, CV_8UC3), cv::Mat(depth, CV_16UC1)};
    const std::size_t size = images.color.total() * images.color.elemSize();
    std::copy_n(bytes->begin(), size, images.color.data);
    std::copy(bytes->begin() + static_cast<std::ptrdiff_t>(size), bytes->end(), images.depth.data);
    return images;
  }

 private:
  core::PackedBlocks blocks_;
  std::map<std::size_t, std::size_t> numbers_;  ///< of the blocks, by frame
};

namespace {

constexpr std::chrono::milliseconds kLookUp(20);  // whether to stop

core::Result<void> check_size(const char* what, const cv::Mat& image, const sensor::Pinhole& camera) {
  if (image.cols == camera.width && image.rows == camera.height) return {};
  return core::input_error(fmt::format("{} is {} x {} pixels, the camera takes {} x {}", what, image.cols,
                                       image.rows, camera.width, camera.height));
}

}  // namespace

/// The frames themselves, for all views of them.
class LiveFrames::Store {
 public:
  Store(const sensor::Camera& camera, LiveFramesOptions options)
      : options_(std::move(options)), camera_(camera) {}

  core::Result<void> push(const LiveFrame& frame) {
    auto images = checked(frame.color, frame.depth);
    if (!images) return tl::unexpected<core::Error>(images.error());

    const double depth_stamp = frame.depth_stamp.value_or(frame.stamp);
    const std::lock_guard lock(mutex_);
    if (closed_) return core::input_error("the recording is closed and accepts no more frames");

    if (!std::isfinite(frame.stamp) || !std::isfinite(depth_stamp))
      return core::input_error(
          fmt::format("stamps are finite seconds, not {} and {}", frame.stamp, depth_stamp));
    if (!stamps_.empty() && frame.stamp <= stamps_.back().color) {
      return core::input_error(fmt::format("stamp {} s is not after that of the frame before, {} s",
                                           frame.stamp, stamps_.back().color));
    }

    waiting_[stamps_.size()] = std::move(*images);
    if (frame.odometry) odometry_[stamps_.size()] = *frame.odometry;
    stamps_.push_back({frame.stamp, depth_stamp});
    changed_.notify_all();
    return {};
  }

  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

  void abandon() {
    const std::lock_guard lock(mutex_);
    closed_ = abandoned_ = true;
    changed_.notify_all();
  }

  [[nodiscard]] bool abandoned() const {
    const std::lock_guard lock(mutex_);
    return abandoned_;
  }

  /// Whether the frame has come, or will not.
  [[nodiscard]] bool decided(std::size_t index) const {
    const std::lock_guard lock(mutex_);
    return index < stamps_.size() || closed_;
  }

  void wait_for(std::size_t index, std::chrono::milliseconds most) const {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, most, [&] { return index < stamps_.size() || closed_; });
  }

  [[nodiscard]] bool is_last(std::size_t index, const core::StopToken& stop) const {
    std::unique_lock lock(mutex_);
    while (index + 1 >= stamps_.size() && !closed_ && !stop.stop_requested())
      changed_.wait_for(lock, kLookUp);
    return closed_ && index + 1 == stamps_.size();
  }

  [[nodiscard]] bool wait_for_room(std::size_t most, double seconds) const {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::duration<double>(seconds),
                             [&] { return stamps_.size() - read_ < most; });
  }

  [[nodiscard]] std::size_t waiting() const {
    const std::lock_guard lock(mutex_);
    return stamps_.size() - read_;
  }

  void keep_in(const std::filesystem::path& folder) {
    const std::lock_guard lock(mutex_);
    kept_.open(folder);
  }

  void keep(std::size_t index) {
    const std::lock_guard lock(mutex_);
    if (const auto found = waiting_.find(index); found != waiting_.end()) kept_.put(index, found->second);
  }

  void release(std::size_t index) {
    const std::lock_guard lock(mutex_);
    waiting_.erase(index);
    if (!kept_.has(index)) odometry_.erase(index);
    changed_.notify_all();
  }

  [[nodiscard]] std::optional<LiveImages> images(std::size_t index) const {
    const std::lock_guard lock(mutex_);
    read_ = std::max(read_, index + 1);
    changed_.notify_all();
    const auto found = waiting_.find(index);
    if (found != waiting_.end()) return found->second;
    return kept_.get(index, {camera_.color.width, camera_.color.height}, depth_size());
  }

  [[nodiscard]] std::optional<geometry::Rigid3> odometry(std::size_t index) const {
    const std::lock_guard lock(mutex_);
    const auto found = odometry_.find(index);
    return found == odometry_.end() ? std::nullopt : std::optional(found->second);
  }

  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return stamps_.size();
  }

  [[nodiscard]] LiveReport report() const {
    const std::lock_guard lock(mutex_);
    LiveReport report;
    report.taken = stamps_.size();
    report.kept = kept_.frames();
    report.kept_bytes = kept_.bytes();
    return report;
  }

  struct Stamps {
    double color = 0.0;
    double depth = 0.0;
  };
  [[nodiscard]] Stamps stamps(std::size_t index) const {
    const std::lock_guard lock(mutex_);
    return stamps_.at(index);
  }

  [[nodiscard]] const std::string& name() const { return options_.name; }
  [[nodiscard]] const sensor::Camera& camera() const { return camera_; }

 private:
  [[nodiscard]] const sensor::Pinhole& depth_camera() const {
    return camera_.depth ? *camera_.depth : camera_.color;
  }
  [[nodiscard]] cv::Size depth_size() const { return {depth_camera().width, depth_camera().height}; }

  [[nodiscard]] core::Result<LiveImages> checked(const cv::Mat& color, const cv::Mat& depth) const {
    if (auto fits = check_size("colour", color, camera_.color); !fits)
      return tl::unexpected<core::Error>(fits.error());
    if (auto fits = check_size("depth", depth, depth_camera()); !fits)
      return tl::unexpected<core::Error>(fits.error());

    LiveImages images;
    if (color.type() == CV_8UC1) {
      cv::cvtColor(color, images.color, cv::COLOR_GRAY2BGR);
    } else if (color.type() == CV_8UC3) {
      images.color = color.clone();
    } else {
      return core::input_error("colour has neither one nor three channels of 8 bits");
    }

    if (depth.type() == CV_16UC1) {
      images.depth = depth.clone();
    } else if (depth.type() == CV_32FC1) {
      if (!cv::checkRange(depth) && cv::countNonZero(depth == depth) == 0)
        return core::input_error("depth is NaN in every pixel; 0 is no measurement");
      images.depth = depth_units(depth, camera_.depth_scale);
    } else {
      return core::input_error(
          "depth has neither 16 bits (units of 1 / depth_scale metres) nor floats (metres)");
    }

    return images;
  }

  LiveFramesOptions options_;
  sensor::Camera camera_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool closed_ = false;
  bool abandoned_ = false;
  std::vector<Stamps> stamps_;
  mutable std::size_t read_ = 0;  ///< frames of which somebody has begun to read the images
  std::map<std::size_t, LiveImages> waiting_;
  std::map<std::size_t, geometry::Rigid3> odometry_;
  PackedLiveImages kept_;
};

/// The frames as one camera took them.
class LiveFrames::View final : public FrameSource {
 public:
  View(std::shared_ptr<Store> store, const sensor::Camera& camera, const sensor::Pinhole& rectified)
      : store_(std::move(store)), camera_(camera), rectified_(rectified), rectifier_(camera, rectified) {}

  [[nodiscard]] const std::string& name() const override { return store_->name(); }
  [[nodiscard]] const std::string& format() const override { return format_; }
  [[nodiscard]] const sensor::Camera& camera() const override { return camera_; }
  [[nodiscard]] std::size_t size() const override { return store_->size(); }
  [[nodiscard]] std::optional<geometry::Trajectory> truth() const override { return std::nullopt; }

  [[nodiscard]] PairInfo info(std::size_t index) const override {
    PairInfo info;
    const Store::Stamps stamps = store_->stamps(index);
    info.stamp = stamps.color;
    info.depth_stamp = stamps.depth + camera_.depth_delay_s;
    return info;
  }

  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::size_t index) const override {
    const auto images = store_->images(index);
    if (!images) return core::input_error(fmt::format("{}: frame {} is not there any more", name(), index));
    const PairInfo pair = info(index);
    sensor::RgbdFrame frame;
    frame.index = static_cast<std::int64_t>(index);
    frame.stamp = pair.stamp;
    frame.depth_stamp = pair.depth_stamp;

    frame.color = rectifier_.color(images->color);
    cv::cvtColor(frame.color, frame.gray, cv::COLOR_BGR2GRAY);
    frame.depth = rectifier_.depth(images->depth);
    frame.odometry = store_->odometry(index);
    return frame;
  }

  [[nodiscard]] std::unique_ptr<FrameSource> taken_by(const sensor::Camera& better) const override {
    return std::make_unique<View>(store_, better, rectified_);
  }

  [[nodiscard]] bool live() const override { return true; }
  [[nodiscard]] bool decided(std::size_t index) const override { return store_->decided(index); }
  void wait_for(std::size_t index, std::chrono::milliseconds most) const override {
    store_->wait_for(index, most);
  }
  [[nodiscard]] bool is_last(std::size_t index, const core::StopToken& stop) const override {
    return store_->is_last(index, stop);
  }
  void keep(std::size_t index) const override { store_->keep(index); }
  void release(std::size_t index) const override { store_->release(index); }
  [[nodiscard]] bool given_up() const override { return store_->abandoned(); }
  [[nodiscard]] LiveReport report() const override { return store_->report(); }

 private:
  std::string format_ = "live";
  std::shared_ptr<Store> store_;
  sensor::Camera camera_;
  sensor::Pinhole rectified_;  ///< pinhole of the rectified images
  sensor::Rectifier rectifier_;
};

core::Result<LiveFrame> stored_frame(const FrameSource& source, std::size_t index) {
  const PairInfo info = source.info(index);
  const sensor::Camera& camera = source.camera();
  auto pair = source.stored(index);
  if (!pair) return tl::unexpected<core::Error>(pair.error());

  LiveFrame frame;
  frame.stamp = info.stamp;
  frame.depth_stamp = info.depth_stamp - camera.depth_delay_s;
  const sensor::Pinhole& depth_camera = camera.depth ? *camera.depth : camera.color;
  const std::string color = color_problem(pair->color.pixels, camera.color);
  if (!color.empty()) return core::input_error(pair->color.name + ": " + color);
  const std::string depth = depth_problem(pair->depth.pixels, depth_camera);
  if (!depth.empty()) return core::input_error(pair->depth.name + ": " + depth);

  frame.color = color_pixels(std::move(pair->color.pixels), camera.color);
  frame.depth = depth_pixels(std::move(pair->depth.pixels), camera.depth_scale);
  return frame;
}

LiveFrames::LiveFrames(const sensor::Camera& camera, LiveFramesOptions options)
    : store_(std::make_shared<Store>(camera, std::move(options))) {}
LiveFrames::~LiveFrames() = default;

core::Result<void> LiveFrames::push(const LiveFrame& frame) { return store_->push(frame); }
void LiveFrames::close() { store_->close(); }
void LiveFrames::abandon() { store_->abandon(); }
std::size_t LiveFrames::waiting() const { return store_->waiting(); }
bool LiveFrames::wait_for_room(std::size_t most, double seconds) const {
  return store_->wait_for_room(most, seconds);
}
void LiveFrames::keep_in(const std::filesystem::path& folder) { store_->keep_in(folder); }
std::unique_ptr<FrameSource> LiveFrames::recording() const {
  return std::make_unique<View>(store_, store_->camera(), store_->camera().color);
}

}  // namespace plumbline::dataset
