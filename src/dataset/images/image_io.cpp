// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/image_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fstream>

#include "frame_images.hpp"
#include "images/image_decoders.hpp"
#include "images/image_formats.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/shortage.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{1} << 29;

core::Result<Bytes> read_bytes(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) return core::input_error(fmt::format("{}: cannot be read: {}", file.string(), error.message()));
  if (size > kMaxFileBytes)
    return core::input_error(fmt::format("{}: too large for an image", file.string()));
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (const std::string shortage = stream ? "" : core::shortage_of(errno); !shortage.empty())
    return core::output_error(fmt::format("{}: cannot be read: {}", file.string(), shortage));
  Bytes bytes(static_cast<std::size_t>(size));
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream)
    return core::input_error(
        fmt::format("{}: cannot be read: no permission, or a disk error", file.string()));
  return bytes;
}

}  // namespace

Decoded decode_other(const Bytes& file) {
  const auto& formats = core::part<ImageFormats>();
  if (!formats) return tl::unexpected<std::string>(formats.error().message);
  cv::Mat image = (*formats)->decode(file);
  if (image.empty()) return tl::unexpected<std::string>("no known image format");
  return image;
}

core::Result<StoredImage> stored_file(const std::string& file) {
  auto bytes = read_bytes(file);
  if (!bytes) return tl::unexpected(bytes.error());
  return StoredImage{core::ending_of(file), std::move(*bytes), {}};
}

core::Result<cv::Mat> read_image(const std::filesystem::path& file) {
  auto bytes = read_bytes(file);
  if (!bytes) return tl::unexpected(bytes.error());
  if (bytes->empty())
    return core::input_error(fmt::format("{}: truncated or damaged: empty file", file.string()));
  Decoded image = is_png(*bytes)    ? decode_png(*bytes)
                  : is_jpeg(*bytes) ? decode_jpeg(*bytes)
                  : is_npy(*bytes)  ? decode_npy(*bytes)
                                    : decode_other(*bytes);
  if (image) return std::move(*image);
  return core::input_error(fmt::format("{}: truncated or damaged: {}", file.string(), image.error()));
}

core::Result<std::vector<std::uint8_t>> encode_png(const cv::Mat& image, int level) {
  const auto& formats = core::part<ImageFormats>();
  if (!formats) return tl::unexpected(formats.error());
  Bytes bytes = (*formats)->encode_png(image, level);
  if (bytes.empty()) return core::failure(core::ErrorKind::kInternal, "the image cannot be encoded as PNG");
  return bytes;
}

core::Result<std::vector<std::uint8_t>> encode_tiff(const cv::Mat& image) {
  const auto& formats = core::part<ImageFormats>();
  if (!formats) return tl::unexpected(formats.error());
  Bytes bytes = (*formats)->encode_tiff(image);
  if (bytes.empty()) return core::failure(core::ErrorKind::kInternal, "the image cannot be encoded as TIFF");
  return bytes;
}

core::Result<void> write_png(const std::filesystem::path& file, const cv::Mat& image) {
  const auto bytes = encode_png(image, 1);
  if (!bytes) return core::failure(bytes.error().kind, file.string() + ": " + bytes.error().message);
  return core::write_file(file, *bytes);
}

}  // namespace plumbline::dataset
