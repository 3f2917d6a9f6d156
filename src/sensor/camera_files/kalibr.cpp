// SPDX-License-Identifier: BSD-3-Clause
// Kalibr's camchain (cam0: {camera_model, intrinsics, distortion_coeffs, resolution}), and EuRoC's
// sensor.yaml, which has the same keys without cam0.
#include <fmt/format.h>

#include "camera_files/camera_formats.hpp"

namespace plumbline::sensor {
namespace {

/// The map with the intrinsics of the first camera; null when there is none.
const core::ConfigNode* kalibr_camera(const CameraText& text) {
  if (!text.is_map()) return nullptr;
  const core::ConfigNode* first = find_any(text.tree, {"cam0"});
  const core::ConfigNode* camera = first != nullptr ? first : &text.tree;
  const core::ConfigNode* intrinsics = find_any(*camera, {"intrinsics"});
  return intrinsics != nullptr && intrinsics->kind == core::ConfigNode::Kind::kSequence ? camera : nullptr;
}

bool recognises_kalibr(const CameraText& text) { return kalibr_camera(text) != nullptr; }

core::Result<CameraReading> read_kalibr(const CameraText& text) {
  // The first camera is the colour camera
  CameraReading reading = blank_reading(text, kKalibrCamera);
  Camera& camera = reading.camera;
  const core::ConfigNode& node = *kalibr_camera(text);
  const auto refuse = [&](const core::ConfigNode& at, const std::string& what) {
    return refuse_camera(text, kKalibrCamera, at.mark, what, camera);
  };
  if (find_any(text.tree, {"cam1"}) != nullptr) reading.notes.emplace_back("cam0 of several cameras");

  // Only the pinhole projection is supported
  const std::string model = word_at(node, {"camera_model"});
  if (!model.empty() && model != "pinhole")
    return refuse(node, fmt::format("the model '{}' is not supported, only 'pinhole' is (with the distortion "
                                    "'radtan' or 'equidistant')",
                                    model));

  // Focal lengths and principal point
  const core::ConfigNode& intrinsics = *find_any(node, {"intrinsics"});
  const auto k = numbers_in(intrinsics);
  if (!k || k->size() != 4) return refuse(intrinsics, "intrinsics are not the four numbers [fx, fy, cx, cy]");
  camera.color.fx = (*k)[0];
  camera.color.fy = (*k)[1];
  camera.color.cx = (*k)[2];
  camera.color.cy = (*k)[3];

  // Size and rate are optional
  if (const core::ConfigNode* size = find_any(node, {"resolution"})) {
    const auto pixels = numbers_in(*size);
    if (!pixels || pixels->size() != 2) return refuse(*size, "resolution is not [width, height]");
    camera.color.width = static_cast<int>((*pixels)[0]);
    camera.color.height = static_cast<int>((*pixels)[1]);
    reading.has_size = true;
  }
  if (const auto rate = number_at(node, {"rate_hz"}); rate && *rate > 0.0) camera.fps = *rate;

  // Distortion of the named model
  const core::ConfigNode* coefficients = find_any(node, {"distortion_coeffs", "distortion_coefficients"});
  if (coefficients == nullptr) return reading;
  const auto d = numbers_in(*coefficients);
  if (!d) return refuse(*coefficients, "the distortion coefficients are not numbers");
  const std::string wrong = take_coefficients(word_at(node, {"distortion_model"}), *d, camera);
  if (!wrong.empty()) return refuse(*coefficients, wrong);
  return reading;
}

}  // namespace

const CameraFormat kKalibrCamera = {"Kalibr", true, &recognises_kalibr, &read_kalibr};

}  // namespace plumbline::sensor
