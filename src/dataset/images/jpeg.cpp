// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/jpeg.hpp"

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdio>  // jpeglib.h uses FILE and size_t without including them
#include <cstdlib>
// clang-format off
#include <jpeglib.h>
#include <jerror.h>
// clang-format on
#include <new>
#include <opencv2/imgproc.hpp>

#include "images/image_decoders.hpp"

namespace plumbline::dataset {
namespace {

struct JpegErrors {
  jpeg_error_mgr base;
  std::jmp_buf jump;
};

[[noreturn]] void leave_jpeg(j_common_ptr info) {
  std::longjmp(reinterpret_cast<JpegErrors*>(info->err)->jump, 1);
}

}  // namespace

std::vector<std::uint8_t> encode_jpeg(const cv::Mat& bgr, int quality) {
  if (bgr.type() != CV_8UC3 || bgr.empty()) return {};

  // Without a handler libjpeg ends the program
  jpeg_compress_struct info;
  JpegErrors errors;
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  info.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = &leave_jpeg;

  // Errors of libjpeg continue here
  if (setjmp(errors.jump) != 0) {
    jpeg_destroy_compress(&info);
    std::free(bytes);
    if (errors.base.msg_code == JERR_OUT_OF_MEMORY) throw std::bad_alloc();
    return {};
  }

  // Settings for colours in OpenCV's order
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, &bytes, &size);
  info.image_width = static_cast<JDIMENSION>(bgr.cols);
  info.image_height = static_cast<JDIMENSION>(bgr.rows);
  info.input_components = 3;
  info.in_color_space = JCS_EXT_BGR;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, quality, TRUE);
  info.optimize_coding = TRUE;

  // Chroma is subsampled only at lower quality
  constexpr int kFine = 90;  // from here on colour is as sharp as brightness
  if (quality >= kFine) info.comp_info[0].h_samp_factor = info.comp_info[0].v_samp_factor = 1;

  // Rows are encoded without a copy
  jpeg_start_compress(&info, TRUE);
  while (info.next_scanline < info.image_height) {
    auto* row = const_cast<JSAMPLE*>(bgr.ptr<JSAMPLE>(static_cast<int>(info.next_scanline)));
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);

  std::vector<std::uint8_t> out(bytes, bytes + size);
  std::free(bytes);
  return out;
}

std::vector<std::uint8_t> encode_small_jpeg(const cv::Mat& bgr) {
  constexpr int kWidth = 160;
  constexpr std::size_t kMostBytes = 5000;
  if (bgr.empty()) return {};

  // Averaging over areas avoids aliasing
  cv::Mat small;
  const double scale = static_cast<double>(kWidth) / bgr.cols;
  const int height = std::max(1, static_cast<int>(std::lround(bgr.rows * scale)));
  cv::resize(bgr, small, {kWidth, height}, 0.0, 0.0, cv::INTER_AREA);

  // The best quality within the size limit
  for (int quality = 70; quality >= 10; quality -= 15) {
    std::vector<std::uint8_t> bytes = encode_jpeg(small, quality);
    if (bytes.size() <= kMostBytes) return bytes;
  }
  return {};
}

core::Result<cv::Mat> decode_jpeg_bytes(const std::vector<std::uint8_t>& file) {
  if (!is_jpeg(file)) return core::input_error("is no JPEG file");
  auto decoded = decode_jpeg(file);
  if (!decoded) return core::input_error(decoded.error());
  return std::move(*decoded);
}

}  // namespace plumbline::dataset
