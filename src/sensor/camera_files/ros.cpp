// SPDX-License-Identifier: BSD-3-Clause
// ROS camera_info: files of camera_calibration (camera_matrix: {rows, cols, data}), messages as `ros2 topic
// echo` prints them (k: [...], d: [...]), and OpenCV's own calibration files, which have the same keys.
#include "camera_files/camera_formats.hpp"

namespace plumbline::sensor {
namespace {

const std::vector<std::string> kMatrixNames = {"camera_matrix", "k"};

bool recognises_ros(const CameraText& text) {
  if (!text.is_map()) return false;
  const bool message = find_any(text.tree, {"k"}) != nullptr && find_any(text.tree, {"d"}) != nullptr;
  return message || find_any(text.tree, {"camera_matrix"}) != nullptr;
}

/// Binning and regions of interest make an image that the matrix is not for. Returns "" or which it is.
std::string cut_out(const core::ConfigNode& tree) {
  if (number_at(tree, {"binning_x"}).value_or(0.0) > 1.0 ||
      number_at(tree, {"binning_y"}).value_or(0.0) > 1.0) {
    return "images with binning are not supported";
  }
  const core::ConfigNode* roi = find_any(tree, {"roi"});
  const bool offset = roi != nullptr && (number_at(*roi, {"x_offset"}).value_or(0.0) != 0.0 ||
                                         number_at(*roi, {"y_offset"}).value_or(0.0) != 0.0);
  return offset ? "a region of interest (roi) is not supported" : "";
}

core::Result<CameraReading> read_ros(const CameraText& text) {
  // A size of zero is unknown
  CameraReading reading = blank_reading(text, kRosCamera);
  Camera& camera = reading.camera;
  const auto width = number_at(text.tree, {"image_width", "width"});
  const auto height = number_at(text.tree, {"image_height", "height"});
  reading.has_size = width && height && *width >= 1.0 && *height >= 1.0;
  if (reading.has_size) {
    camera.color.width = static_cast<int>(*width);
    camera.color.height = static_cast<int>(*height);
  }

  // A camera that was never calibrated has zeros
  const core::ConfigNode& matrix = *find_any(text.tree, kMatrixNames);
  const auto k = numbers_in(matrix);
  if (!k)
    return refuse_camera(text, kRosCamera, matrix.mark, "the camera matrix does not consist of numbers",
                         camera);
  if (k->size() == 9 && (*k)[0] == 0.0) {
    return refuse_camera(text, kRosCamera, matrix.mark, "the matrix is zero: this camera was not calibrated",
                         camera);
  }

  // Binning and regions would change the matrix
  if (const std::string wrong = take_matrix(*k, camera); !wrong.empty())
    return refuse_camera(text, kRosCamera, matrix.mark, wrong, camera);
  if (const std::string wrong = cut_out(text.tree); !wrong.empty())
    return refuse_camera(text, kRosCamera, {}, wrong, camera);

  // Distortion of the named model
  const core::ConfigNode* coefficients =
      find_any(text.tree, {"distortion_coefficients", "distortion_coeffs", "dist_coeffs", "d"});
  if (coefficients == nullptr) return reading;
  const auto d = numbers_in(*coefficients);
  const std::string wrong = d ? take_coefficients(word_at(text.tree, {"distortion_model"}), *d, camera)
                              : "the distortion coefficients are not numbers";
  if (!wrong.empty()) return refuse_camera(text, kRosCamera, coefficients->mark, wrong, camera);
  return reading;
}

}  // namespace

const CameraFormat kRosCamera = {"ROS (camera_info) or OpenCV", true, &recognises_ros, &read_ros};

}  // namespace plumbline::sensor
