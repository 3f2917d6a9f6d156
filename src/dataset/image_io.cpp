// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/image_io.hpp"

#include <fmt/format.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "image_decoders.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{1} << 29;

core::Result<Bytes> read_bytes(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) return core::input_error(fmt::format("{}: cannot be read: {}", file.string(), error.message()));
  if (size > kMaxFileBytes)
    return core::input_error(fmt::format("{}: too large for an image", file.string()));
  std::ifstream stream(file, std::ios::binary);
  Bytes bytes(static_cast<std::size_t>(size));
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream)
    return core::input_error(fmt::format("{}: cannot be read: no right or disk error", file.string()));
  return bytes;
}

}  // namespace

Decoded decode_other(const Bytes& file) {
  try {
    cv::Mat image = cv::imdecode(file, cv::IMREAD_UNCHANGED);
    if (!image.empty()) return image;
  } catch (const cv::Exception&) {  // the same as an empty image
  }
  return tl::unexpected<std::string>("no known image format");
}

core::Result<cv::Mat> read_image(const std::filesystem::path& file) {
  auto bytes = read_bytes(file);
  if (!bytes) return tl::unexpected<core::Error>(bytes.error());
  if (bytes->empty())
    return core::input_error(fmt::format("{}: truncated or damaged: empty file", file.string()));
  Decoded image = is_png(*bytes)    ? decode_png(*bytes)
                  : is_jpeg(*bytes) ? decode_jpeg(*bytes)
                                    : decode_other(*bytes);
  if (image) return std::move(*image);
  return core::input_error(fmt::format("{}: truncated or damaged: {}", file.string(), image.error()));
}

}  // namespace plumbline::dataset
