// SPDX-License-Identifier: BSD-3-Clause
// NumPy's .npy: "\x93NUMPY", two bytes of version, the length of a header, the header as a Python dictionary
// such as {'descr': '<f4', 'fortran_order': False, 'shape': (480, 640), }, the numbers.
#include <fmt/format.h>

#include <array>
#include <cstring>
#include <optional>
#include <string_view>

#include "images/image_decoders.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::array<char, 6> kNpyMagic = {'\x93', 'N', 'U', 'M', 'P', 'Y'};

struct NpyHeader {
  std::string_view text;
  std::size_t numbers_at = 0;
};

std::optional<NpyHeader> npy_header(const Bytes& file) {
  constexpr std::size_t kVersion1 = 10;
  constexpr std::size_t kLater = 12;
  if (file.size() < kLater) return std::nullopt;

  // Version 1 has a length of two bytes
  const bool first = file[6] == 1;
  const std::size_t begin = first ? kVersion1 : kLater;
  std::size_t length = file[8] + (std::size_t{file[9]} << 8U);
  if (!first) length += (std::size_t{file[10]} << 16U) + (std::size_t{file[11]} << 24U);
  if (length > file.size() - begin) return std::nullopt;
  return NpyHeader{{reinterpret_cast<const char*>(file.data()) + begin, length}, begin + length};
}

/// Rest of the header after a key; "" if the key is missing.
std::string_view after_key(std::string_view text, const std::string& key) {
  const std::size_t at = text.find("'" + key + "'");
  const std::size_t colon = at == std::string_view::npos ? at : text.find(':', at);
  return colon == std::string_view::npos ? std::string_view() : text.substr(colon + 1);
}

/// Sizes in "(480, 640, 1)" that are not 1; empty if the text is not a shape.
std::vector<std::int64_t> npy_shape(std::string_view text) {
  const std::size_t open = text.find('(');
  const std::size_t close = text.find(')', open == std::string_view::npos ? 0 : open);
  if (open == std::string_view::npos || close == std::string_view::npos) return {};
  std::vector<std::int64_t> shape;
  std::int64_t number = -1;
  for (std::size_t i = open + 1; i <= close; ++i) {
    const char c = text[i];
    if (c >= '0' && c <= '9') {
      number = std::min<std::int64_t>(10 * std::max<std::int64_t>(number, 0) + (c - '0'), kMaxPixels);
    } else if (number >= 0) {
      if (number != 1) shape.push_back(number);
      number = -1;
    }
  }
  return shape;
}

/// OpenCV's type of the numbers; -1 if there is none.
int npy_type(std::string_view text) {
  for (const auto& [name, type] :
       {std::pair("'<f4'", CV_32FC1), std::pair("'<f8'", CV_64FC1), std::pair("'<u2'", CV_16UC1)}) {
    const std::size_t at = text.find(name);
    if (at != std::string_view::npos && at < 4) return type;
  }
  return -1;
}

}  // namespace

bool is_npy(const Bytes& file) {
  return file.size() > kNpyMagic.size() && std::memcmp(file.data(), kNpyMagic.data(), kNpyMagic.size()) == 0;
}

Decoded decode_npy(const Bytes& file) {
  const auto header = npy_header(file);
  if (!header) return tl::unexpected<std::string>("the file ends within the header of .npy");

  // Images are two-dimensional and stored row by row
  const int type = npy_type(after_key(header->text, "descr"));
  const std::vector<std::int64_t> shape = npy_shape(after_key(header->text, "shape"));
  const std::string_view order = after_key(header->text, "fortran_order");
  if (type < 0 || shape.size() != 2 || order.substr(0, 6).find("False") == std::string_view::npos) {
    return tl::unexpected<std::string>(
        "this .npy is not an image: it needs two dimensions of '<f4', '<f8' or '<u2', row by row");
  }

  // Sizes of damaged headers are not allocated
  if (shape[0] * shape[1] > kMaxPixels || shape[0] * shape[1] < 1)
    return tl::unexpected(fmt::format("{}x{} is not the size of an image", shape[1], shape[0]));
  const std::size_t bytes = static_cast<std::size_t>(shape[0] * shape[1]) * CV_ELEM_SIZE(type);
  if (file.size() - header->numbers_at < bytes)
    return tl::unexpected<std::string>("the file ends before its numbers do");
  cv::Mat image(static_cast<int>(shape[0]), static_cast<int>(shape[1]), type);
  std::memcpy(image.data, file.data() + header->numbers_at, bytes);
  return image;
}

}  // namespace plumbline::dataset
