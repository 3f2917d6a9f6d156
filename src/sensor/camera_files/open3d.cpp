// SPDX-License-Identifier: BSD-3-Clause
// Open3D's PinholeCameraIntrinsic and PinholeCameraParameters, and the intrinsic.json of its RealSense
// recorder: width, height and intrinsic_matrix, nine numbers column by column. Depth is in millimetres there.
#include "camera_files/camera_formats.hpp"

namespace plumbline::sensor {
namespace {

/// The map that holds intrinsic_matrix; null when there is none.
const core::ConfigNode* open3d_intrinsics(const CameraText& text) {
  if (!text.is_map()) return nullptr;
  if (find_any(text.tree, {"intrinsic_matrix"}) != nullptr) return &text.tree;
  const core::ConfigNode* inner = find_any(text.tree, {"intrinsic"});
  const core::ConfigNode* list = find_any(text.tree, {"parameters"});  // of a trajectory: one for each image
  if (inner == nullptr && list != nullptr && !list->items.empty())
    inner = find_any(list->items[0], {"intrinsic"});
  return inner != nullptr && find_any(*inner, {"intrinsic_matrix"}) != nullptr ? inner : nullptr;
}

bool recognises_open3d(const CameraText& text) { return open3d_intrinsics(text) != nullptr; }

core::Result<CameraReading> read_open3d(const CameraText& text) {
  // The size may be missing
  constexpr double millimetres = 1000.0;
  CameraReading reading = blank_reading(text, kOpen3dCamera);
  Camera& camera = reading.camera;
  const core::ConfigNode& node = *open3d_intrinsics(text);
  const auto width = number_at(node, {"width"});
  const auto height = number_at(node, {"height"});
  reading.has_size = width && height;

  // Width and height come together
  if (reading.has_size) {
    camera.color.width = static_cast<int>(*width);
    camera.color.height = static_cast<int>(*height);
  }

  // Millimetres unless the recording says otherwise
  const auto scale = number_at(text.tree, {"depth_scale"});
  camera.depth_scale = scale && *scale > 0.0 ? units_per_metre(*scale) : millimetres;
  reading.has_depth_scale = scale.has_value();
  if (const auto fps = number_at(text.tree, {"fps"}); fps && *fps > 0.0) camera.fps = *fps;

  // Open3D stores the matrix by columns
  const core::ConfigNode& matrix = *find_any(node, {"intrinsic_matrix"});
  const auto k = numbers_in(matrix);
  const std::string wrong = k ? take_matrix(*k, camera) : "intrinsic_matrix does not consist of numbers";
  if (!wrong.empty()) return refuse_camera(text, kOpen3dCamera, matrix.mark, wrong, camera);
  return reading;
}

}  // namespace

const CameraFormat kOpen3dCamera = {"Open3D", true, &recognises_open3d, &read_open3d};

}  // namespace plumbline::sensor
