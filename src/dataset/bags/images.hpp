// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Images of messages, as they would be stored in a file: CV_8U or CV_16U with 1, 3 (BGR) or 4 channels, or
// CV_32FC1.
#include <opencv2/core/mat.hpp>
#include <string>

#include "bags/messages.hpp"

namespace plumbline::dataset {

using MessageImage = tl::expected<cv::Mat, std::string>;

/// True for encodings of depth images: 16UC1, mono16, 32FC1.
bool is_depth_encoding(const std::string& encoding);
/// True if `format` is that of the transport compressedDepth.
bool is_compressed_depth(const std::string& format);

/// sensor_msgs/Image: rgb8 bgr8 rgba8 bgra8 mono8 8UC1 8UC3 8UC4 rgb16 bgr16 yuv422 uyvy yuyv yuv422_yuy2;
/// 16UC1 mono16 32FC1. What is wrong otherwise, with the remedy.
MessageImage image_of(const ImageMessage& message);
/// sensor_msgs/CompressedImage: JPEG, PNG and other image formats; compressedDepth as PNG or RVL, of 32FC1
/// too.
MessageImage image_of(const CompressedImageMessage& message);

}  // namespace plumbline::dataset
