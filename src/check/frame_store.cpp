// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/check/frame_store.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

namespace plumbline::check {
namespace {

constexpr double kAnchors_s = 1.0 / 3.0;
constexpr std::size_t kNextEvery = 3;

/// Differences to the pixel on the left, low and high bytes apart, are packed into less than half.
core::Bytes bytes_of(const SmallFrame& frame) {
  const std::size_t pixels = frame.gray.total();
  core::Bytes bytes(3 * pixels);
  std::size_t at = 0;
  for (int y = 0; y < frame.gray.rows; ++y) {
    const auto* gray = frame.gray.ptr<std::uint8_t>(y);
    const auto* depth = frame.depth.ptr<std::uint16_t>(y);
    std::uint8_t left = 0;
    std::uint16_t left_depth = 0;
    for (int x = 0; x < frame.gray.cols; ++x, ++at) {
      const auto step = static_cast<std::uint16_t>(depth[x] - std::exchange(left_depth, depth[x]));
      bytes[at] = static_cast<std::uint8_t>(gray[x] - std::exchange(left, gray[x]));
      bytes[pixels + at] = static_cast<std::uint8_t>(step & 255U);
      bytes[2 * pixels + at] = static_cast<std::uint8_t>(step >> 8U);
    }
  }
  return bytes;
}

void set_pixels(const core::Bytes& bytes, SmallFrame& frame) {
  const std::size_t pixels = frame.gray.total();
  std::size_t at = 0;
  for (int y = 0; y < frame.gray.rows; ++y) {
    auto* gray = frame.gray.ptr<std::uint8_t>(y);
    auto* depth = frame.depth.ptr<std::uint16_t>(y);
    std::uint8_t left = 0;
    std::uint16_t left_depth = 0;
    for (int x = 0; x < frame.gray.cols; ++x, ++at) {
      gray[x] = left = static_cast<std::uint8_t>(left + bytes[at]);
      const unsigned step = bytes[pixels + at] + (static_cast<unsigned>(bytes[2 * pixels + at]) << 8U);
      depth[x] = left_depth = static_cast<std::uint16_t>(left_depth + step);
    }
  }
}

}  // namespace

cv::Size small_size(const sensor::Pinhole& camera) {
  if (camera.width <= kWidth_px) return {camera.width, camera.height};
  return {kWidth_px, std::max(1, (camera.height * kWidth_px + camera.width / 2) / camera.width)};
}

SmallFrame shrink(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera) {
  const cv::Size size = small_size(camera);
  SmallFrame small;
  small.stamp = frame.stamp;
  small.depth_stamp = frame.depth_stamp;
  cv::resize(frame.gray, small.gray, size, 0.0, 0.0, cv::INTER_AREA);

  // Depth is sampled, not averaged: the mean across an edge would be a surface that does not exist.
  small.depth.create(size, CV_16UC1);
  std::vector<int> columns;
  columns.reserve(static_cast<std::size_t>(size.width));
  for (int x = 0; x < size.width; ++x) columns.push_back(grid_pixel(x, camera.width, size.width));

  for (int y = 0; y < size.height; ++y) {
    const auto* from = frame.depth.ptr<float>(grid_pixel(y, camera.height, size.height));
    auto* to = small.depth.ptr<std::uint16_t>(y);
    for (int x = 0; x < size.width; ++x) {
      const double units =
          kDepthUnits_per_m * static_cast<double>(from[columns[static_cast<std::size_t>(x)]]);
      to[x] = units > 0.0 && units < 65535.0 ? static_cast<std::uint16_t>(units + 0.5) : std::uint16_t{0};
    }
  }
  return small;
}

FrameChoice::Use FrameChoice::next(double stamp) {
  const double step = frames_ > 0 ? stamp - last_ : 0.0;
  last_ = stamp;
  const bool after_anchor = std::exchange(wants_next_, false);
  if (frames_++ > 0 && stamp + 0.5 * std::min(step, kAnchors_s) < anchor_ + kAnchors_s)
    return after_anchor ? Use::kNext : Use::kNone;

  anchor_ = stamp;
  wants_next_ = anchors_++ % kNextEvery == 0;
  return Use::kAnchor;
}

std::size_t FrameStore::add(const SmallFrame& frame) {
  headers_.push_back({frame.stamp, frame.depth_stamp, frame.gray.size()});
  return blocks_.add(bytes_of(frame));
}

core::Result<SmallFrame> FrameStore::read(std::size_t number) const {
  const std::optional<core::Bytes> bytes = blocks_.get(number);
  if (!bytes)
    return core::failure(core::ErrorKind::kOutput, "the temporary file of the check cannot be read");

  const Header& header = headers_.at(number);
  SmallFrame frame;
  frame.stamp = header.stamp;
  frame.depth_stamp = header.depth_stamp;
  frame.gray.create(header.size, CV_8UC1);
  frame.depth.create(header.size, CV_16UC1);
  set_pixels(*bytes, frame);
  return frame;
}

}  // namespace plumbline::check
