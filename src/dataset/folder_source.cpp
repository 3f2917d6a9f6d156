// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <opencv2/imgproc.hpp>
#include <utility>

#include "layout.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "plumbline/sensor/rectify.hpp"

namespace plumbline::dataset {
namespace {

std::string type_name(const cv::Mat& image) {
  const int bits = image.depth() == CV_8U ? 8 : image.depth() == CV_16U ? 16 : 32;
  return fmt::format("{} channel{} of {} bits", image.channels(), image.channels() == 1 ? "" : "s", bits);
}

core::Result<void> check_size(const std::string& file, const cv::Mat& image, const sensor::Pinhole& camera,
                              const char* what) {
  if (image.cols == camera.width && image.rows == camera.height) return {};
  return core::input_error(fmt::format("{}: the {} image is {}x{}, the camera file says {}x{}", file, what,
                                       image.cols, image.rows, camera.width, camera.height));
}

core::Result<cv::Mat> read_color(const std::string& file, const sensor::Pinhole& camera) {
  auto image = read_image(file);
  if (!image) return image;
  if (image->depth() != CV_8U) {
    return core::input_error(
        fmt::format("{}: the colour image has {}; 8 bits are needed", file, type_name(*image)));
  }
  if (auto size = check_size(file, *image, camera, "colour"); !size) return tl::unexpected(size.error());
  if (image->channels() == 1) cv::cvtColor(*image, *image, cv::COLOR_GRAY2BGR);
  if (image->channels() == 4) cv::cvtColor(*image, *image, cv::COLOR_BGRA2BGR);
  return image;
}

core::Result<cv::Mat> read_depth(const std::string& file, const sensor::Pinhole& camera) {
  auto image = read_image(file);
  if (!image) return image;
  if (image->type() != CV_16UC1) {
    return core::input_error(fmt::format(
        "{}: the depth image has {}; a 16-bit PNG with one channel is needed", file, type_name(*image)));
  }
  if (auto size = check_size(file, *image, camera, "depth"); !size) return tl::unexpected(size.error());
  return image;
}

class FolderSource final : public FrameSource {
 public:
  FolderSource(std::string name, Layout layout, sensor::Camera camera, const sensor::Pinhole& rectified)
      : name_(std::move(name)),
        layout_(std::move(layout)),
        camera_(std::move(camera)),
        rectifier_(camera_, rectified) {}

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] const std::string& format() const override { return layout_.format; }
  [[nodiscard]] const sensor::Camera& camera() const override { return camera_; }
  [[nodiscard]] std::size_t size() const override { return layout_.pairs.size(); }
  [[nodiscard]] PairInfo info(std::size_t index) const override { return layout_.pairs.at(index); }
  [[nodiscard]] std::optional<geometry::Trajectory> truth() const override { return layout_.truth; }

  [[nodiscard]] std::unique_ptr<FrameSource> taken_by(const sensor::Camera& better) const override {
    Layout layout = layout_;
    for (PairInfo& pair : layout.pairs) pair.depth_stamp += better.depth_delay_s - camera_.depth_delay_s;
    return std::make_unique<FolderSource>(name_, std::move(layout), better, camera_.color);
  }

  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::size_t index) const override {
    const PairInfo& pair = layout_.pairs.at(index);
    auto color = read_color(pair.color_file, camera_.color);
    if (!color) return tl::unexpected(color.error());
    auto depth = read_depth(pair.depth_file, camera_.depth ? *camera_.depth : camera_.color);
    if (!depth) return tl::unexpected(depth.error());
    sensor::RgbdFrame frame;
    frame.index = static_cast<std::int64_t>(index);
    frame.stamp = pair.stamp;
    frame.depth_stamp = pair.depth_stamp;
    frame.color = rectifier_.color(*color);
    cv::cvtColor(frame.color, frame.gray, cv::COLOR_BGR2GRAY);
    frame.depth = rectifier_.depth(*depth);
    return frame;
  }

 private:
  std::string name_;
  Layout layout_;
  sensor::Camera camera_;
  sensor::Rectifier rectifier_;
};

}  // namespace

std::unique_ptr<FrameSource> make_folder_source(std::string name, Layout layout, sensor::Camera camera) {
  const sensor::Pinhole rectified = camera.color;
  return std::make_unique<FolderSource>(std::move(name), std::move(layout), std::move(camera), rectified);
}

}  // namespace plumbline::dataset
