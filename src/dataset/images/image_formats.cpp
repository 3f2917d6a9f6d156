// SPDX-License-Identifier: BSD-3-Clause
#include "images/image_formats.hpp"

#include <new>
#include <opencv2/imgcodecs.hpp>

#include "images/exr.hpp"

namespace plumbline::dataset {
namespace {

/// Throws again what is no fault of the image.
void check_memory(const cv::Exception& problem) {
  if (problem.code == cv::Error::StsNoMem) throw std::bad_alloc();
}

/// Empty if the image cannot be decoded.
cv::Mat decode(const Bytes& file) {
  if (is_exr(file)) return decode_exr(file);
  try {
    return cv::imdecode(file, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& problem) {
    check_memory(problem);
    return {};
  }
}

Bytes encode_png(const cv::Mat& image, int level) {
  Bytes bytes;
  // By default OpenCV packs the differences from the left neighbour at level 1; with a given level it tries
  // all filters on each row, which takes 1.7 times as long and makes the file no smaller.
  std::vector<int> how;
  if (level != 1) how = {cv::IMWRITE_PNG_COMPRESSION, level};
  try {
    if (!cv::imencode(".png", image, bytes, how)) bytes.clear();
  } catch (const cv::Exception& problem) {
    check_memory(problem);
    bytes.clear();
  }
  return bytes;
}

/// Empty if the image cannot be encoded.
Bytes encode_tiff(const cv::Mat& image) {
  Bytes bytes;
  try {
    if (!cv::imencode(".tiff", image, bytes)) bytes.clear();
  } catch (const cv::Exception& problem) {
    check_memory(problem);
    bytes.clear();
  }
  return bytes;
}

}  // namespace
}  // namespace plumbline::dataset

PLUMBLINE_PART(plumbline::dataset::ImageFormats, &plumbline::dataset::decode, &plumbline::dataset::encode_png,
               &plumbline::dataset::encode_tiff)
