// SPDX-License-Identifier: BSD-3-Clause
#include <csetjmp>
#include <cstddef>
#include <cstdio>  // jpeglib.h uses FILE and size_t without including them
// clang-format off
#include <jpeglib.h>
#include <jerror.h>
// clang-format on
#include <new>

#include "images/image_decoders.hpp"

namespace plumbline::dataset {
namespace {

struct ErrorManager {
  jpeg_error_mgr base;  // first, so that libjpeg's pointer is also ours
  std::jmp_buf jump;
  char message[JMSG_LENGTH_MAX];
};

[[noreturn]] void leave(j_common_ptr info) {
  auto* errors = reinterpret_cast<ErrorManager*>(info->err);
  info->err->format_message(info, errors->message);
  std::longjmp(errors->jump, 1);
}

/// Level -1 is a warning. After a warning about lost data libjpeg continues with invented pixels; other
/// warnings (stray bytes between segments, odd version numbers) are harmless, and frequent in some cameras'
/// files.
void on_message(j_common_ptr info, int level) {
  if (level >= 0) return;
  switch (info->err->msg_code) {
    case JWRN_JPEG_EOF:
    case JWRN_HIT_MARKER:
    case JWRN_HUFF_BAD_CODE:
    case JWRN_ARITH_BAD_CODE:
    case JWRN_MUST_RESYNC:
      leave(info);
    default:
      return;
  }
}

void be_quiet(j_common_ptr /*info*/) {}

/// No object with a destructor may live in the frames that longjmp leaves: the image is owned by the caller
/// and every libjpeg callback here is plain C. Returns false with `errors.message` set.
bool decode(jpeg_decompress_struct& info, ErrorManager& errors, const Bytes& file, cv::Mat& image) {
  // NOLINTNEXTLINE(cert-err52-cpp): libjpeg's documented way of leaving after an error
  if (setjmp(errors.jump) != 0) return false;
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, file.data(), static_cast<unsigned long>(file.size()));
  jpeg_read_header(&info, TRUE);

  const bool cmyk = info.jpeg_color_space == JCS_CMYK || info.jpeg_color_space == JCS_YCCK;
  info.out_color_space = cmyk ? JCS_CMYK : JCS_EXT_BGR;
  jpeg_start_decompress(&info);
  if (static_cast<std::int64_t>(info.output_width) * info.output_height > kMaxPixels) return false;

  image.create(static_cast<int>(info.output_height), static_cast<int>(info.output_width),
               cmyk ? CV_8UC4 : CV_8UC3);
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = image.ptr(static_cast<int>(info.output_scanline));
    jpeg_read_scanlines(&info, &row, 1);
  }

  jpeg_finish_decompress(&info);
  return true;
}

/// Converts cyan, magenta, yellow, black to BGR; Adobe's programs store them inverted.
cv::Mat from_cmyk(const cv::Mat& cmyk, bool inverted) {
  cv::Mat bgr(cmyk.size(), CV_8UC3);
  for (int v = 0; v < cmyk.rows; ++v) {
    const auto* from = cmyk.ptr<cv::Vec4b>(v);
    auto* to = bgr.ptr<cv::Vec3b>(v);
    for (int u = 0; u < cmyk.cols; ++u) {
      const auto light = [&](int c) { return inverted ? from[u][c] : 255 - from[u][c]; };
      for (int c = 0; c < 3; ++c) to[u][c] = static_cast<std::uint8_t>(light(2 - c) * light(3) / 255);
    }
  }
  return bgr;
}

}  // namespace

bool is_jpeg(const Bytes& file) {
  return file.size() >= 3 && file[0] == 0xFF && file[1] == 0xD8 && file[2] == 0xFF;
}

Decoded decode_jpeg(const Bytes& file) {
  ErrorManager errors{};
  jpeg_decompress_struct info{};
  info.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = leave;
  errors.base.emit_message = on_message;
  errors.base.output_message = be_quiet;

  cv::Mat image;
  const bool done = decode(info, errors, file, image);
  const bool adobe = info.saw_Adobe_marker != 0;

  // Lack of memory is not the image's fault
  jpeg_destroy_decompress(&info);
  if (!done && errors.base.msg_code == JERR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (done) return image.channels() == 4 ? from_cmyk(image, adobe) : image;
  return tl::unexpected<std::string>(errors.message[0] != '\0' ? errors.message : "the image is too large");
}

}  // namespace plumbline::dataset
