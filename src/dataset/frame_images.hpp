// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The images of a pair, converted from the many stored pixel formats to those that a Rectifier takes.
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/rectify.hpp"

namespace plumbline::dataset {

struct Layout;

/// Units per metre of the 16-bit image into which depth in floating-point metres is converted: steps of 0.2
/// mm, up to 13.1 m.
inline constexpr double kFloatDepthScale = 5000.0;

/// The fault of pixels as an image of the camera, `reduction` times as large as its size; "": there is none.
std::string color_problem(const cv::Mat& image, const sensor::Pinhole& camera, int reduction = 1);
std::string depth_problem(const cv::Mat& image, const sensor::Pinhole& camera);

/// Converts pixels without a problem into those of read_color and read_depth.
cv::Mat color_pixels(cv::Mat image, const sensor::Pinhole& camera, int reduction = 1);
cv::Mat depth_pixels(cv::Mat image, double depth_scale);

/// CV_8UC3, BGR, of the camera's size; stored Layout::color_reduction times as large. Grey, transparent and
/// 16-bit images are converted. Error (kInput): names the image and what is wrong.
core::Result<cv::Mat> read_color(const Layout& layout, ImageId image, const sensor::Pinhole& camera);

/// CV_16UC1 of the camera's size, in units of 1 / depth_scale metres; 0 means no measurement. Images of 16
/// bits with one channel are taken as they are, those with three equal channels too; floats are metres and
/// rounded to units.
core::Result<cv::Mat> read_depth(const Layout& layout, ImageId image, const sensor::Pinhole& camera,
                                 double depth_scale);

/// Converts metres (CV_32FC1) to units of 1 / depth_scale metres; values that are not finite, not positive or
/// too far become 0.
cv::Mat depth_units(const cv::Mat& metres, double depth_scale);

/// Clears the pixels of a depth image where the mask in a file, of any size, is 0. Errors (kInput): no mask.
core::Result<void> mask_depth(const std::string& mask_file, cv::Mat& depth);

/// Makes a frame without odometry from a pair's images, which are those of read_color and read_depth.
sensor::RgbdFrame rectified_frame(std::size_t index, const PairInfo& pair, const cv::Mat& color,
                                  const cv::Mat& depth, const sensor::Rectifier& rectifier);

/// Reports unusual pixel formats of the first readable images to the log. Where depth is stored as floats,
/// the camera's depth_scale becomes kFloatDepthScale. Error (kInput): floats that cannot be metres.
core::Result<void> check_image_kinds(const Layout& layout, sensor::Camera& camera, core::Log& log);

}  // namespace plumbline::dataset
