// SPDX-License-Identifier: BSD-3-Clause
// PNG (ISO/IEC 15948) for what cameras write: 8-bit grey, RGB, RGBA and 16-bit grey, not interlaced.
// The whole image is inflated in one call of libdeflate, which is quicker than libpng's streaming through
// zlib.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <libdeflate.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "images/image_decoders.hpp"
#include "plumbline/core/shortage.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::uint8_t kSignature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr std::size_t kChunkOverhead = 12;  // length, type, checksum

struct Header {
  int width = 0;
  int height = 0;
  int bits = 0;
  int color_type = 0;  ///< 0 grey, 2 RGB, 3 palette, 4 grey + alpha, 6 RGBA
  int interlace = 0;

  [[nodiscard]] bool common() const {
    const bool eight = bits == 8 && (color_type == 0 || color_type == 2 || color_type == 6);
    return interlace == 0 && (eight || (bits == 16 && color_type == 0));
  }
  [[nodiscard]] int channels() const { return color_type == 2 ? 3 : color_type == 6 ? 4 : 1; }
  [[nodiscard]] std::size_t pixel_bytes() const { return static_cast<std::size_t>(channels() * bits / 8); }
  [[nodiscard]] std::size_t row_bytes() const { return static_cast<std::size_t>(width) * pixel_bytes(); }
};

std::uint32_t big_endian(const std::uint8_t* p) {
  return std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 |
         std::uint32_t{p[3]};
}

/// Walks the chunks; fills the header and the joined IDAT data. Returns "" or what is wrong.
std::string read_chunks(const Bytes& file, Header& header, Bytes& compressed) {
  std::size_t at = sizeof kSignature;
  bool have_header = false;
  while (true) {
    if (file.size() - at < kChunkOverhead) return "the file ends before the image does";
    const std::size_t length = big_endian(&file[at]);
    if (length > file.size() - at - kChunkOverhead) return "the file ends before the image does";

    // A wrong checksum means a damaged file
    const std::uint8_t* type = &file[at + 4];
    const std::uint8_t* data = &file[at + 8];
    if (libdeflate_crc32(0, type, length + 4) != big_endian(data + length)) {
      return fmt::format("checksum is wrong at byte {}", at);
    }

    // Other chunks do not alter the pixels
    if (std::memcmp(type, "IHDR", 4) == 0 && length == 13) {
      if (big_endian(data) - 1 >= 1U << 24 || big_endian(data + 4) - 1 >= 1U << 24) return "impossible size";

      // Size, bit depth, colour type and interlacing
      header = {static_cast<int>(big_endian(data)), static_cast<int>(big_endian(data + 4)), data[8], data[9],
                data[12]};
      have_header = true;
    } else if (std::memcmp(type, "IDAT", 4) == 0) {
      compressed.insert(compressed.end(), data, data + length);
    } else if (std::memcmp(type, "IEND", 4) == 0) {
      return have_header ? "" : "there is no header";
    }

    at += length + kChunkOverhead;
  }
}

std::uint8_t paeth(int left, int up, int corner) {
  const int to_left = std::abs(up - corner);
  const int to_up = std::abs(left - corner);
  const int to_corner = std::abs(left + up - 2 * corner);
  if (to_left <= to_up && to_left <= to_corner) return static_cast<std::uint8_t>(left);
  return static_cast<std::uint8_t>(to_up <= to_corner ? up : corner);
}

/// Undoes one row's filter in place; `above` is the row above, already undone. B: bytes per pixel. Where a
/// pixel depends on the one before, that one is kept in registers: the row is one long chain of dependences.
template <std::size_t B>
bool unfilter_row(int filter, std::uint8_t* row, const std::uint8_t* above, std::size_t size) {
  const auto add = [](std::uint8_t& to, int value) { to = static_cast<std::uint8_t>(to + value); };
  switch (filter) {
    case 0:
      return true;

    case 1: {
      std::uint8_t left[B] = {};
      for (std::size_t i = 0; i < size; i += B) {
        for (std::size_t c = 0; c < B; ++c) {
          left[c] = static_cast<std::uint8_t>(left[c] + row[i + c]);
          row[i + c] = left[c];
        }
      }
      return true;
    }

    case 2:
      for (std::size_t i = 0; i < size; ++i) add(row[i], above[i]);
      return true;

    case 3: {
      std::uint8_t left[B] = {};
      for (std::size_t i = 0; i < size; i += B) {
        for (std::size_t c = 0; c < B; ++c) {
          left[c] = static_cast<std::uint8_t>(row[i + c] + (left[c] + above[i + c]) / 2);
          row[i + c] = left[c];
        }
      }
      return true;
    }

    case 4: {
      int left[B] = {};
      int corner[B] = {};

      for (std::size_t i = 0; i < size; i += B) {
        for (std::size_t c = 0; c < B; ++c) {
          const int up = above[i + c];
          add(row[i + c], paeth(left[c], up, corner[c]));
          left[c] = row[i + c];
          corner[c] = up;
        }
      }

      return true;
    }
    default:
      return false;
  }
}

/// Undoes the filters, for `B` bytes a pixel; false if one is not known.
template <std::size_t B>
bool unfilter(const Header& header, std::uint8_t* pixels) {
  const std::size_t size = header.row_bytes();
  const Bytes zeros(size, 0);
  const std::uint8_t* above = zeros.data();
  for (std::size_t v = 0; v < static_cast<std::size_t>(header.height); ++v) {
    std::uint8_t* row = pixels + v * (size + 1);
    if (!unfilter_row<B>(row[0], row + 1, above, size)) return false;
    above = row + 1;
  }
  return true;
}

bool unfilter_any(const Header& header, std::uint8_t* pixels) {
  const std::size_t bytes = header.pixel_bytes();
  return bytes == 1   ? unfilter<1>(header, pixels)
         : bytes == 2 ? unfilter<2>(header, pixels)
         : bytes == 3 ? unfilter<3>(header, pixels)
                      : unfilter<4>(header, pixels);
}

/// Rows without their filter bytes, in OpenCV's order of channels and this machine's order of bytes.
cv::Mat to_image(const Header& header, std::uint8_t* pixels) {
  const std::size_t stride = header.row_bytes() + 1;
  if (header.bits == 16) {
    cv::Mat image(header.height, header.width, CV_16UC1);
    for (int v = 0; v < header.height; ++v) {
      auto* row = image.ptr<std::uint16_t>(v);
      std::memcpy(row, pixels + static_cast<std::size_t>(v) * stride + 1, header.row_bytes());
      for (int u = 0; u < header.width; ++u) row[u] = ntohs(row[u]);
    }
    return image;
  }
  const cv::Mat rows(header.height, header.width, CV_8UC(header.channels()), pixels + 1, stride);
  cv::Mat image;
  if (header.channels() == 1) return rows.clone();
  cv::cvtColor(rows, image, header.channels() == 3 ? cv::COLOR_RGB2BGR : cv::COLOR_RGBA2BGRA);
  return image;
}

}  // namespace

bool is_png(const Bytes& file) {
  return file.size() >= sizeof kSignature && std::memcmp(file.data(), kSignature, sizeof kSignature) == 0;
}

Decoded decode_png(const Bytes& file) {
  Header header;
  Bytes compressed;
  compressed.reserve(file.size());

  if (const std::string wrong = read_chunks(file, header, compressed); !wrong.empty()) {
    return tl::unexpected<std::string>(wrong);
  }

  if (static_cast<std::int64_t>(header.width) * header.height > kMaxPixels) {
    return tl::unexpected<std::string>("the image is too large");
  }
  if (!header.common()) return decode_other(file);

  // deflate shrinks data at most 1032 times: nothing is allocated for a small file that claims more
  const std::size_t size = (header.row_bytes() + 1) * static_cast<std::size_t>(header.height);
  if (size / 1032 > compressed.size()) return tl::unexpected<std::string>("the image data is too short");

  const std::unique_ptr<std::uint8_t[]> pixels(new std::uint8_t[size]);  // all of it is written to
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflater(
      core::made(libdeflate_alloc_decompressor()), &libdeflate_free_decompressor);

  std::size_t produced = 0;
  const auto status = libdeflate_zlib_decompress(inflater.get(), compressed.data(), compressed.size(),
                                                 pixels.get(), size, &produced);
  if (status != LIBDEFLATE_SUCCESS || produced != size) {
    return tl::unexpected<std::string>("the image data cannot be inflated");
  }
  if (!unfilter_any(header, pixels.get())) return tl::unexpected<std::string>("unknown row filter");

  return to_image(header, pixels.get());
}

}  // namespace plumbline::dataset
