// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/image_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fstream>

#include "images/image_decoders.hpp"
#include "images/image_formats.hpp"
#include "images/image_source.hpp"
#include "plumbline/core/git_lfs.hpp"
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

  // Shortages of the system are not bad input
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

/// The ending that a copy's file has: the file's own, or that of its content where it has none that can stand
/// in a list.
std::string ending_of_copy(const std::filesystem::path& file, const Bytes& bytes) {
  const std::string own = core::ending_of(file);
  const auto plain = [](unsigned char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); };
  if (own.size() > 1 && std::all_of(own.begin() + 1, own.end(), plain)) return own;
  return is_png(bytes) ? ".png" : is_jpeg(bytes) ? ".jpg" : "";
}

}  // namespace

Decoded decode_other(const Bytes& file) {
  const auto& formats = core::part<ImageFormats>();
  if (!formats) return tl::unexpected<std::string>(formats.error().message);
  cv::Mat image = (*formats)->decode(file);
  if (image.empty()) return tl::unexpected<std::string>("no known image format");
  return image;
}

core::Result<cv::Mat> decode_image(const std::string& name, const Bytes& file) {
  if (file.empty()) return core::input_error(name + ": truncated or damaged: empty file");
  Decoded image = is_png(file)    ? decode_png(file)
                  : is_jpeg(file) ? decode_jpeg(file)
                  : is_npy(file)  ? decode_npy(file)
                                  : decode_other(file);
  if (image) return std::move(*image);

  // An LFS pointer may replace the image
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  if (core::begins_as_lfs_pointer(text)) return core::input_error(name + ": " + core::kLfsPointer);
  return core::input_error(fmt::format("{}: truncated or damaged: {}", name, image.error()));
}

core::Result<StoredImage> stored_file(const std::string& file) {
  auto bytes = read_bytes(file);
  if (!bytes) return tl::unexpected(bytes.error());
  auto pixels = decode_image(file, *bytes);
  if (!pixels) return tl::unexpected(pixels.error());
  return StoredImage{ending_of_copy(file, *bytes), std::move(*bytes), std::move(*pixels)};
}

core::Result<cv::Mat> read_image(const std::filesystem::path& file) {
  auto bytes = read_bytes(file);
  return bytes ? decode_image(file.string(), *bytes) : tl::unexpected(bytes.error());
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
