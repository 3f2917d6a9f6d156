// SPDX-License-Identifier: BSD-3-Clause
#include "image_formats.hpp"

#include <opencv2/imgcodecs.hpp>

namespace plumbline::dataset {
namespace {

cv::Mat decode(const Bytes& file) {
  try {
    return cv::imdecode(file, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return {};
  }
}

Bytes encode_png(const cv::Mat& image, int level) {
  Bytes bytes;
  try {
    if (!cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, level})) bytes.clear();
  } catch (const cv::Exception&) {
    bytes.clear();
  }
  return bytes;
}

}  // namespace
}  // namespace plumbline::dataset

PLUMBLINE_PART(plumbline::dataset::ImageFormats, &plumbline::dataset::decode, &plumbline::dataset::encode_png)
