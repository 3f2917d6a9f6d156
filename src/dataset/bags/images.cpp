// SPDX-License-Identifier: BSD-3-Clause
#include "bags/images.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "bags/rvl.hpp"
#include "images/image_decoders.hpp"

namespace plumbline::dataset {
namespace {

constexpr int kAsItIs = -1;  // no conversion
// A few bytes of RVL can stand for any number of zeros, so only this limits the memory for them.
constexpr std::uint64_t kMostRvlPixels = std::uint64_t{1} << 24;

/// Rule by which the bytes of one encoding become an image.
struct RawEncoding {
  const char* name;
  int type;
  int conversion;  ///< code of cv::cvtColor, or kAsItIs
};

constexpr std::array<RawEncoding, 18> kEncodings = {{{"rgb8", CV_8UC3, cv::COLOR_RGB2BGR},
                                                     {"bgr8", CV_8UC3, kAsItIs},
                                                     {"8UC3", CV_8UC3, kAsItIs},
                                                     {"rgba8", CV_8UC4, cv::COLOR_RGBA2BGRA},
                                                     {"bgra8", CV_8UC4, kAsItIs},
                                                     {"8UC4", CV_8UC4, kAsItIs},
                                                     {"mono8", CV_8UC1, kAsItIs},
                                                     {"8UC1", CV_8UC1, kAsItIs},
                                                     {"rgb16", CV_16UC3, cv::COLOR_RGB2BGR},
                                                     {"bgr16", CV_16UC3, kAsItIs},
                                                     {"yuv422", CV_8UC2, cv::COLOR_YUV2BGR_UYVY},
                                                     {"uyvy", CV_8UC2, cv::COLOR_YUV2BGR_UYVY},
                                                     {"yuyv", CV_8UC2, cv::COLOR_YUV2BGR_YUYV},
                                                     {"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2BGR_YUYV},
                                                     {"16UC1", CV_16UC1, kAsItIs},
                                                     {"mono16", CV_16UC1, kAsItIs},
                                                     {"32FC1", CV_32FC1, kAsItIs},
                                                     {"16UC3", CV_16UC3, kAsItIs}}};

const RawEncoding* encoding_of(const std::string& name) {
  for (const RawEncoding& encoding : kEncodings) {
    if (name == encoding.name) return &encoding;
  }
  return nullptr;
}

std::string not_known(const std::string& encoding) {
  if (encoding.rfind("bayer_", 0) == 0)
    return fmt::format("has the raw encoding '{}'; record the topic with colours (image_proc)", encoding);
  std::string known;
  for (const RawEncoding& each : kEncodings) known += (known.empty() ? "" : ", ") + std::string(each.name);
  return fmt::format("has the encoding '{}', which is not known (known: {})", encoding, known);
}

/// Reverses the bytes of each value.
void swap_bytes(cv::Mat& image) {
  const std::size_t width = image.elemSize1();
  for (int v = 0; v < image.rows; ++v) {
    auto* row = image.ptr<std::uint8_t>(v);
    const std::size_t end = static_cast<std::size_t>(image.cols) * image.elemSize();
    for (std::size_t i = 0; i < end; i += width) std::reverse(row + i, row + i + width);
  }
}

/// Bytes in front of compressed depth: 12, of which the last 8 say how inverse floats became integers.
constexpr std::size_t kDepthHead = 12;

struct InverseDepth {
  float a = 0.0F;
  float b = 0.0F;
};

/// The two numbers in front of `begin`; none where there are fewer bytes.
std::optional<InverseDepth> inverse_depth(const Bytes& data, std::size_t begin) {
  std::array<float, 2> numbers{};
  if (begin < sizeof(numbers)) return std::nullopt;
  std::memcpy(numbers.data(), data.data() + begin - sizeof(numbers), sizeof(numbers));
  return InverseDepth{numbers[0], numbers[1]};
}

/// z = a / (value - b); 0 means no measurement.
cv::Mat metres_of(const cv::Mat& values, const InverseDepth& head) {
  cv::Mat metres(values.size(), CV_32FC1);
  for (int v = 0; v < values.rows; ++v) {
    const auto* from = values.ptr<std::uint16_t>(v);
    auto* to = metres.ptr<float>(v);
    for (int u = 0; u < values.cols; ++u) {
      const float z = head.a / (static_cast<float>(from[u]) - head.b);
      to[u] = from[u] == 0 || !(z > 0.0F) ? 0.0F : z;
    }
  }
  return metres;
}

/// Columns and rows in front of the numbers.
MessageImage rvl_image(const std::uint8_t* data, std::size_t size) {
  std::array<std::uint32_t, 2> shape{};
  if (size < sizeof(shape)) return tl::unexpected<std::string>("ends before its size");
  std::memcpy(shape.data(), data, sizeof(shape));
  const std::uint64_t pixels = std::uint64_t{shape[0]} * shape[1];
  if (shape[0] == 0 || shape[1] == 0 || shape[0] > 32768 || shape[1] > 32768 || pixels > kMostRvlPixels)
    return tl::unexpected<std::string>(fmt::format("has {} x {} pixels", shape[0], shape[1]));
  const auto depths =
      decode_rvl(data + sizeof(shape), size - sizeof(shape), static_cast<std::size_t>(pixels));
  if (!depths) return tl::unexpected<std::string>("is damaged: RVL ends too early");
  cv::Mat image(static_cast<int>(shape[1]), static_cast<int>(shape[0]), CV_16UC1);
  std::memcpy(image.data, depths->data(), depths->size() * sizeof(std::uint16_t));
  return image;
}

MessageImage decode_file(const Bytes& file) {
  if (file.empty()) return tl::unexpected<std::string>("holds no image");
  auto image = is_png(file) ? decode_png(file) : is_jpeg(file) ? decode_jpeg(file) : decode_other(file);
  if (!image) return tl::unexpected<std::string>("is damaged: " + image.error());
  return std::move(*image);
}

/// Byte at which the PNG of compressed depth begins, behind a head that not all programs write with 12 bytes.
std::size_t begin_of_png(const Bytes& data) {
  constexpr std::array<std::uint8_t, 8> kSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  constexpr std::size_t kLongestHead = 64;
  const auto end =
      data.begin() + static_cast<std::ptrdiff_t>(std::min(data.size(), kLongestHead + kSignature.size()));
  const auto found = std::search(data.begin(), end, kSignature.begin(), kSignature.end());
  return found == end ? kDepthHead : static_cast<std::size_t>(found - data.begin());
}

MessageImage compressed_depth(const CompressedImageMessage& message) {
  const bool rvl = message.format.find("rvl") != std::string::npos;
  const std::size_t begin = rvl ? kDepthHead : begin_of_png(message.data);
  if (message.data.size() <= begin) return tl::unexpected<std::string>("holds no image");

  const std::uint8_t* data = message.data.data() + begin;
  const std::size_t size = message.data.size() - begin;
  MessageImage image = rvl ? rvl_image(data, size) : decode_file(Bytes(data, data + size));
  if (!image || message.format.rfind("32FC1", 0) != 0) return image;

  // Floats are stored as quantised inverse depth
  const auto inverse = inverse_depth(message.data, begin);
  if (!inverse) {
    return tl::unexpected<std::string>(
        "has no numbers in front of its PNG that turn it into metres; record the topic as 16UC1");
  }
  if (image->type() != CV_16UC1) return tl::unexpected<std::string>("holds no 16-bit image");
  return metres_of(*image, *inverse);
}

}  // namespace

bool is_depth_encoding(const std::string& encoding) {
  return encoding == "16UC1" || encoding == "mono16" || encoding == "32FC1";
}

bool is_compressed_depth(const std::string& format) {
  return format.find("compressedDepth") != std::string::npos;
}

MessageImage image_of(const ImageMessage& message) {
  const RawEncoding* encoding = encoding_of(message.encoding);
  if (encoding == nullptr) return tl::unexpected(not_known(message.encoding));

  // The promised size must fit into the message
  const std::uint64_t width_bytes = std::uint64_t{message.width} * CV_ELEM_SIZE(encoding->type);
  const std::uint64_t step = message.step == 0 ? width_bytes : message.step;
  const std::uint64_t pixels = std::uint64_t{message.width} * message.height;
  if (pixels == 0 || message.width > 32768 || message.height > 32768 || step < width_bytes ||
      (message.height - 1) * step + width_bytes > message.data.size()) {
    return tl::unexpected<std::string>(
        fmt::format("promises {} x {} pixels {} in rows of {} bytes, and has {} bytes", message.width,
                    message.height, message.encoding, message.step, message.data.size()));
  }

  // Rows may end with padding
  cv::Mat image(static_cast<int>(message.height), static_cast<int>(message.width), encoding->type);
  for (int v = 0; v < image.rows; ++v)
    std::memcpy(image.ptr(v), message.data.data() + static_cast<std::size_t>(v) * step, width_bytes);
  if (message.big_endian && image.elemSize1() > 1) swap_bytes(image);
  if (encoding->conversion == kAsItIs) return image;

  // YUV 4:2:2 needs an even width
  const bool pairs = encoding->type == CV_8UC2;  // of pixels, which share their colour
  if (pairs && image.cols % 2 != 0)
    return tl::unexpected<std::string>(
        fmt::format("has an odd width of {} for {}", image.cols, encoding->name));

  cv::Mat converted;
  cv::cvtColor(image, converted, encoding->conversion);
  return converted;
}

MessageImage image_of(const CompressedImageMessage& message) {
  return is_compressed_depth(message.format) ? compressed_depth(message) : decode_file(message.data);
}

}  // namespace plumbline::dataset
