// SPDX-License-Identifier: BSD-3-Clause
#include "frame_images.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "films/azure_kinect.hpp"
#include "films/video_frames.hpp"
#include "layout.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/dataset/image_io.hpp"

namespace plumbline::dataset {
namespace {

constexpr double kFarthestMedian_m = 50.0;  // largest plausible median of depth stored as metres

std::string type_name(const cv::Mat& image) {
  const int bits = image.depth() == CV_8U    ? 8
                   : image.depth() == CV_16U ? 16
                   : image.depth() == CV_64F ? 64
                                             : 32;
  return fmt::format("{} channel{} of {} bits", image.channels(), image.channels() == 1 ? "" : "s", bits);
}

core::Result<void> check_size(const std::string& file, const cv::Mat& image, const sensor::Pinhole& camera,
                              const char* what) {
  if (image.cols == camera.width && image.rows == camera.height) return {};
  return core::input_error(fmt::format(
      "{}: the {} image is {}x{}, the camera file says {}x{}; give the camera's own file (--camera)", file,
      what, image.cols, image.rows, camera.width, camera.height));
}

bool channels_are_equal(const cv::Mat& image) {
  for (int v = 0; v < image.rows; ++v) {
    const auto* pixel = image.ptr<cv::Vec3w>(v);
    for (int u = 0; u < image.cols; ++u) {
      if (pixel[u][0] != pixel[u][1] || pixel[u][0] != pixel[u][2]) return false;
    }
  }
  return true;
}

/// The first readable image of the pairs and its name; empty if none is readable.
template <typename Name>
std::pair<std::string, cv::Mat> first_image(const Layout& layout, const Name& name) {
  for (const PairInfo& pair : layout.pairs) {
    if (auto image = read_stored(layout, name(pair))) return {name(pair), std::move(*image)};
  }
  return {};
}

std::optional<double> median_of(const cv::Mat& metres) {
  std::vector<float> measured;
  for (int v = 0; v < metres.rows; ++v) {
    const auto* row = metres.ptr<float>(v);
    for (int u = 0; u < metres.cols; ++u) {
      if (std::isfinite(row[u]) && row[u] > 0.0F) measured.push_back(row[u]);
    }
  }
  if (measured.empty()) return std::nullopt;
  return static_cast<double>(core::median(std::move(measured)));
}

}  // namespace

cv::Mat depth_units(const cv::Mat& metres, double depth_scale) {
  constexpr double kMostUnits = 65534.0;  // 65535 means no measurement
  cv::Mat units(metres.size(), CV_16UC1);
  for (int v = 0; v < metres.rows; ++v) {
    const auto* from = metres.ptr<float>(v);
    auto* to = units.ptr<std::uint16_t>(v);
    for (int u = 0; u < metres.cols; ++u) {
      const double value = std::round(static_cast<double>(from[u]) * depth_scale);
      to[u] = value >= 1.0 && value <= kMostUnits ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
    }
  }
  return units;
}

core::Result<cv::Mat> read_stored(const Layout& layout, const std::string& name, VideoFrames* video) {
  if (layout.images != nullptr) return layout.images->image(name);
  if (layout.packed != nullptr) {
    if (auto packed = layout.packed->read(name)) return std::move(*packed);
  }
  const auto frame = video_frame_of(name);
  if (!frame || is_file(name)) return read_image(name);
  if (video != nullptr) return video->read(frame->second);
  return VideoFrames(frame->first).read(frame->second);
}

core::Result<void> mask_depth(const std::string& mask_file, cv::Mat& depth) {
  auto mask = read_image(mask_file);
  if (!mask) return tl::unexpected(mask.error());
  if (mask->type() != CV_8UC1)
    return core::input_error(
        fmt::format("{}: the mask has {}; one channel of 8 bits is needed", mask_file, type_name(*mask)));
  if (mask->size() != depth.size()) cv::resize(*mask, *mask, depth.size(), 0.0, 0.0, cv::INTER_NEAREST);
  depth.setTo(0, *mask == 0);
  return {};
}

core::Result<void> check_color(const std::string& name, const cv::Mat& image, const sensor::Pinhole& camera,
                               int reduction) {
  const int channels = image.channels();
  const bool colors = channels == 3 || channels == 4;
  if (!(image.depth() == CV_8U && (colors || channels == 1)) && !(image.depth() == CV_16U && colors)) {
    return core::input_error(
        fmt::format("{}: the colour image has {}; 8 bits are needed", name, type_name(image)));
  }

  sensor::Pinhole stored = camera;
  stored.width *= reduction;
  stored.height *= reduction;
  return check_size(name, image, stored, "colour");
}

core::Result<void> check_depth(const std::string& name, const cv::Mat& image, const sensor::Pinhole& camera) {
  const bool one = image.type() == CV_16UC1 || image.type() == CV_32FC1 || image.type() == CV_64FC1;
  if (!one && !(image.type() == CV_16UC3 && channels_are_equal(image))) {
    return core::input_error(
        fmt::format("{}: the depth image has {}; a 16-bit PNG or PGM with one channel is needed, or floats "
                    "of 32 bits in metres (TIFF or EXR)",
                    name, type_name(image)));
  }
  return check_size(name, image, camera, "depth");
}

core::Result<cv::Mat> color_pixels(const std::string& name, cv::Mat image, const sensor::Pinhole& camera,
                                   int reduction) {
  if (auto good = check_color(name, image, camera, reduction); !good) return tl::unexpected(good.error());

  if (reduction > 1) cv::resize(image, image, {camera.width, camera.height}, 0.0, 0.0, cv::INTER_AREA);
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 257.0);  // 65535 becomes 255
  if (image.channels() == 1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
  if (image.channels() == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2BGR);
  return image;
}

core::Result<cv::Mat> depth_pixels(const std::string& name, cv::Mat image, const sensor::Pinhole& camera,
                                   double depth_scale) {
  if (auto good = check_depth(name, image, camera); !good) return tl::unexpected(good.error());
  if (image.type() == CV_64FC1) image.convertTo(image, CV_32F);
  if (image.type() == CV_16UC3) cv::extractChannel(image, image, 0);
  return image.type() == CV_32FC1 ? depth_units(image, depth_scale) : image;
}

core::Result<cv::Mat> read_color(const Layout& layout, const std::string& file, const sensor::Pinhole& camera,
                                 VideoFrames* video) {
  auto image = read_stored(layout, file, video);
  return image ? color_pixels(file, std::move(*image), camera, layout.color_reduction) : image;
}

core::Result<cv::Mat> read_depth(const Layout& layout, const std::string& file, const sensor::Pinhole& camera,
                                 double depth_scale) {
  auto image = read_stored(layout, file);
  return image ? depth_pixels(file, std::move(*image), camera, depth_scale) : image;
}

sensor::RgbdFrame rectified_frame(std::size_t index, const PairInfo& pair, const cv::Mat& color,
                                  const cv::Mat& depth, const sensor::Rectifier& rectifier) {
  sensor::RgbdFrame frame;
  frame.index = static_cast<std::int64_t>(index);
  frame.stamp = pair.stamp;
  frame.depth_stamp = pair.depth_stamp;
  frame.color = rectifier.color(color);
  cv::cvtColor(frame.color, frame.gray, cv::COLOR_BGR2GRAY);
  frame.depth = rectifier.depth(depth);
  return frame;
}

core::Result<void> check_image_kinds(const Layout& layout, sensor::Camera& camera, core::Log& log) {
  const cv::Mat color = first_image(layout, [](const PairInfo& pair) { return pair.color_file; }).second;
  if (!color.empty() && color.depth() == CV_16U && color.channels() >= 3)
    log.info("the colour images have 16 bits a channel; the upper 8 are used");

  const auto [depth_file, depth] = first_image(layout, [](const PairInfo& pair) { return pair.depth_file; });
  if (depth.type() == CV_16UC3 && channels_are_equal(depth))
    log.info("the depth images have three equal channels; the first is used");
  if (depth.type() != CV_32FC1 && depth.type() != CV_64FC1) return {};

  cv::Mat metres;
  depth.convertTo(metres, CV_32F);

  const auto median = median_of(metres);
  if (median && *median > kFarthestMedian_m) {
    return core::input_error(
        fmt::format("{}: depth stored as floats is taken as metres, and its median is {:.4g}; store metres "
                    "(divide millimetres by 1000)",
                    depth_file, *median));
  }

  camera.depth_scale = kFloatDepthScale;
  log.info("the depth images hold metres as floats; they are read in steps of 0.2 mm, up to 13.1 m");
  return {};
}

}  // namespace plumbline::dataset
