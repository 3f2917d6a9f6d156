// SPDX-License-Identifier: BSD-3-Clause
// cam_params.json of Replica as NICE-SLAM ships it (camera: {w, h, fx, fy, cx, cy, scale}), and the `cam`
// section of NICE-SLAM's and its successors' settings (H, W, fx, fy, cx, cy, png_depth_scale).
#include "camera_files/camera_formats.hpp"

namespace plumbline::sensor {
namespace {

/// The map with the intrinsics, on top or in a section.
const core::ConfigNode* replica_camera(const CameraText& text) {
  if (!text.is_map()) return nullptr;
  const core::ConfigNode* section = find_any(text.tree, {"camera", "cam"});
  const core::ConfigNode* node = section != nullptr ? section : &text.tree;
  const bool sized = find_any(*node, {"w"}) != nullptr && find_any(*node, {"h"}) != nullptr;
  const bool named = section != nullptr && find_any(*node, {"width", "image_width"}) != nullptr;
  return (sized || named) && find_any(*node, {"fx"}) != nullptr ? node : nullptr;
}

bool recognises_replica(const CameraText& text) { return replica_camera(text) != nullptr; }

core::Result<CameraReading> read_replica(const CameraText& text) {
  // Intrinsics with the size
  CameraReading reading = blank_reading(text, kReplicaCamera);
  Camera& camera = reading.camera;
  const core::ConfigNode& node = *replica_camera(text);
  const std::string missing = take_pinhole(node, camera.color);
  if (!missing.empty()) return refuse_camera(text, kReplicaCamera, node.mark, missing, camera);
  reading.has_size = true;

  // Depth scale, rate and distortion are optional
  if (const auto scale = number_at(node, {"scale", "png_depth_scale", "depth_scale"})) {
    camera.depth_scale = units_per_metre(*scale);
    reading.has_depth_scale = true;
  }
  if (const auto fps = number_at(node, {"fps"}); fps && *fps > 0.0) camera.fps = *fps;
  const core::ConfigNode* coefficients = find_any(node, {"distortion"});
  if (coefficients == nullptr) return reading;

  // Coefficients without a model are OpenCV's
  const auto d = numbers_in(*coefficients);
  const std::string wrong =
      d ? take_coefficients("", *d, camera) : "the distortion coefficients are not numbers";
  if (!wrong.empty()) return refuse_camera(text, kReplicaCamera, coefficients->mark, wrong, camera);
  return reading;
}

}  // namespace

const CameraFormat kReplicaCamera = {"Replica or NICE-SLAM", true, &recognises_replica, &read_replica};

}  // namespace plumbline::sensor
