// SPDX-License-Identifier: BSD-3-Clause
#include "png_writer.hpp"

#include <libdeflate.h>

#include <memory>
#include <stdexcept>

namespace plumbline::synth {

namespace {

void put32(std::vector<std::uint8_t>& out, std::size_t v) {
  for (const int shift : {24, 16, 8, 0}) out.push_back(static_cast<std::uint8_t>(v >> shift & 255U));
}

void chunk(std::vector<std::uint8_t>& out, const char* type, const std::uint8_t* data, std::size_t size) {
  put32(out, size);
  const std::size_t from = out.size();
  out.insert(out.end(), type, type + 4);
  out.insert(out.end(), data, data + size);
  put32(out, libdeflate_crc32(0, out.data() + from, out.size() - from));
}

/// Rows as PNG wants them: RGB or big-endian 16 bit, each less its left neighbour (filter 1).
std::vector<std::uint8_t> filtered_rows(const cv::Mat& image) {
  const bool color = image.type() == CV_8UC3;
  const std::size_t step = color ? 3 : 2, width = static_cast<std::size_t>(image.cols) * step;
  std::vector<std::uint8_t> out((width + 1) * static_cast<std::size_t>(image.rows));
  std::vector<std::uint8_t> row(width + step, 0);  // begins with the pixel left of the first
  std::uint8_t* q = out.data();
  for (int y = 0; y < image.rows; ++y) {
    const auto* p = image.ptr<std::uint8_t>(y);
    std::uint8_t* r = row.data() + step;
    for (int x = 0; x < image.cols; ++x, p += step, r += step) {
      if (color) {
        r[0] = p[2];
        r[1] = p[1];
        r[2] = p[0];
      } else {
        r[0] = p[1];
        r[1] = p[0];
      }
    }
    *q++ = 1;
    for (std::size_t i = 0; i < width; ++i) q[i] = static_cast<std::uint8_t>(row[i + step] - row[i]);
    q += width;
  }
  return out;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const cv::Mat& image) {
  if (image.type() != CV_8UC3 && image.type() != CV_16UC1)
    throw std::invalid_argument("encode_png: type of picture");
  const std::vector<std::uint8_t> rows = filtered_rows(image);
  const std::unique_ptr<libdeflate_compressor, void (*)(libdeflate_compressor*)> deflate(
      libdeflate_alloc_compressor(1), libdeflate_free_compressor);
  std::vector<std::uint8_t> packed(libdeflate_zlib_compress_bound(deflate.get(), rows.size()));
  packed.resize(
      libdeflate_zlib_compress(deflate.get(), rows.data(), rows.size(), packed.data(), packed.size()));

  std::vector<std::uint8_t> out = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  std::vector<std::uint8_t> header;
  put32(header, static_cast<std::size_t>(image.cols));
  put32(header, static_cast<std::size_t>(image.rows));
  const bool color = image.type() == CV_8UC3;
  for (const int v : {color ? 8 : 16, color ? 2 : 0, 0, 0, 0}) header.push_back(static_cast<std::uint8_t>(v));
  chunk(out, "IHDR", header.data(), header.size());
  chunk(out, "IDAT", packed.data(), packed.size());
  chunk(out, "IEND", nullptr, 0);
  return out;
}

}  // namespace plumbline::synth
