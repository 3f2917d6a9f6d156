// SPDX-License-Identifier: BSD-3-Clause
#include "frame_images.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

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

std::string size_problem(const cv::Mat& image, int width, int height, const char* what) {
  if (image.cols == width && image.rows == height) return "";
  return fmt::format(
      "the {} image is {}x{}, the camera file says {}x{}; give the camera's own file (--camera)", what,
      image.cols, image.rows, width, height);
}

/// True for grey images stored as three channels.
bool channels_are_equal(const cv::Mat& image) {
  for (int v = 0; v < image.rows; ++v) {
    const auto* pixel = image.ptr<cv::Vec3w>(v);
    for (int u = 0; u < image.cols; ++u) {
      if (pixel[u][0] != pixel[u][1] || pixel[u][0] != pixel[u][2]) return false;
    }
  }
  return true;
}

/// The first readable image of the pairs and its place; empty if none is readable.
std::pair<ImageId, cv::Mat> first_image(const Layout& layout, ImageId PairInfo::*image) {
  for (const PairInfo& pair : layout.pairs) {
    if (auto read = layout.images->read(pair.*image)) return {pair.*image, std::move(*read)};
  }
  return {};
}

/// The median of measured pixels; none if nothing was measured.
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

/// Values outside 1 to 65534 units become 0: no measurement.
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

core::Result<void> mask_depth(const std::string& mask_file, cv::Mat& depth) {
  auto mask = read_image(mask_file);
  if (!mask) return tl::unexpected(mask.error());
  if (mask->type() != CV_8UC1)
    return core::input_error(
        fmt::format("{}: the mask has {}; one channel of 8 bits is needed", mask_file, type_name(*mask)));

  // Nearest pixels keep the mask's classes
  if (mask->size() != depth.size()) cv::resize(*mask, *mask, depth.size(), 0.0, 0.0, cv::INTER_NEAREST);
  depth.setTo(0, *mask == 0);
  return {};
}

std::string color_problem(const cv::Mat& image, const sensor::Pinhole& camera, int reduction) {
  const int channels = image.channels();
  const bool colors = channels == 3 || channels == 4;
  if (!(image.depth() == CV_8U && (colors || channels == 1)) && !(image.depth() == CV_16U && colors))
    return fmt::format("the colour image has {}; 8 bits are needed", type_name(image));
  return size_problem(image, camera.width * reduction, camera.height * reduction, "colour");
}

std::string depth_problem(const cv::Mat& image, const sensor::Pinhole& camera) {
  const bool one = image.type() == CV_16UC1 || image.type() == CV_32FC1 || image.type() == CV_64FC1;

  // Three equal channels count as one
  if (!one && !(image.type() == CV_16UC3 && channels_are_equal(image))) {
    return fmt::format(
        "the depth image has {}; a 16-bit PNG or PGM with one channel is needed, or floats "
        "of 32 bits in metres (TIFF or EXR)",
        type_name(image));
  }
  return size_problem(image, camera.width, camera.height, "depth");
}

cv::Mat color_pixels(cv::Mat image, const sensor::Pinhole& camera, int reduction) {
  if (reduction > 1) cv::resize(image, image, {camera.width, camera.height}, 0.0, 0.0, cv::INTER_AREA);
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 257.0);  // 65535 becomes 255
  if (image.channels() == 1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
  if (image.channels() == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2BGR);
  return image;
}

cv::Mat depth_pixels(cv::Mat image, double depth_scale) {
  if (image.type() == CV_64FC1) image.convertTo(image, CV_32F);
  if (image.type() == CV_16UC3) cv::extractChannel(image, image, 0);
  return image.type() == CV_32FC1 ? depth_units(image, depth_scale) : image;
}

core::Result<cv::Mat> read_color(const Layout& layout, ImageId id, const sensor::Pinhole& camera) {
  auto image = layout.images->read(id);
  if (!image) return image;
  const std::string problem = color_problem(*image, camera, layout.color_reduction);
  if (!problem.empty()) return core::input_error(layout.images->describe(id) + ": " + problem);
  return color_pixels(std::move(*image), camera, layout.color_reduction);
}

/// Depth of the camera's size, as 16 bits in its units.
core::Result<cv::Mat> read_depth(const Layout& layout, ImageId id, const sensor::Pinhole& camera,
                                 double depth_scale) {
  auto image = layout.images->read(id);
  if (!image) return image;
  const std::string problem = depth_problem(*image, camera);
  if (!problem.empty()) return core::input_error(layout.images->describe(id) + ": " + problem);
  return depth_pixels(std::move(*image), depth_scale);
}

sensor::RgbdFrame rectified_frame(std::size_t index, const PairInfo& pair, const cv::Mat& color,
                                  const cv::Mat& depth, const sensor::Rectifier& rectifier) {
  sensor::RgbdFrame frame;
  frame.index = static_cast<std::int64_t>(index);
  frame.stamp = pair.stamp;
  frame.depth_stamp = pair.depth_stamp;

  // Both images in the rectified camera
  frame.color = rectifier.color(color);
  cv::cvtColor(frame.color, frame.gray, cv::COLOR_BGR2GRAY);
  frame.depth = rectifier.depth(depth);
  return frame;
}

core::Result<void> check_image_kinds(const Layout& layout, sensor::Camera& camera, core::Log& log) {
  const cv::Mat color = first_image(layout, &PairInfo::color).second;
  if (!color.empty() && color.depth() == CV_16U && color.channels() >= 3)
    log.info("the colour images have 16 bits a channel; the upper 8 are used");

  // Some programs store depth as three channels
  const auto [id, depth] = first_image(layout, &PairInfo::depth);
  if (depth.type() == CV_16UC3 && channels_are_equal(depth))
    log.info("the depth images have three equal channels; the first is used");
  if (depth.type() != CV_32FC1 && depth.type() != CV_64FC1) return {};

  // Millimetres as floats are a common mistake
  cv::Mat metres;
  depth.convertTo(metres, CV_32F);
  const auto median = median_of(metres);
  if (median && *median > kFarthestMedian_m) {
    return core::input_error(
        fmt::format("{}: depth stored as floats is taken as metres, and its median is {:.4g}; store metres "
                    "(divide millimetres by 1000)",
                    layout.images->describe(id), *median));
  }

  // Metres become 16 bits like all other depth
  camera.depth_scale = kFloatDepthScale;
  log.info("the depth images hold metres as floats; they are read in steps of 0.2 mm, up to 13.1 m");
  return {};
}

}  // namespace plumbline::dataset
