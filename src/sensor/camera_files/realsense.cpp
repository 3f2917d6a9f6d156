// SPDX-License-Identifier: BSD-3-Clause
// librealsense's intrinsics as JSON (width height ppx ppy fx fy model coeffs), alone or one for each stream,
// with a depth_scale in metres a unit and extrinsics {rotation, translation} from depth to colour.
#include <cmath>

#include "camera_files/camera_formats.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::sensor {
namespace {

struct RealSenseStreams {
  const core::ConfigNode* color = nullptr;
  const core::ConfigNode* depth = nullptr;
  const core::ConfigNode* extrinsics = nullptr;  ///< from depth to colour
  std::optional<double> depth_scale;
};

bool has_word(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

/// `path`: the keys above, in lower case.
void find_streams(const core::ConfigNode& node, const std::string& path, RealSenseStreams& found) {
  if (find_any(node, {"ppx"}) != nullptr && find_any(node, {"fx"}) != nullptr) {
    const bool infrared = has_word(path, "infra") || has_word(path, "left") || has_word(path, "right");
    const core::ConfigNode*& stream = has_word(path, "depth") ? found.depth : found.color;
    if (stream == nullptr && !infrared) stream = &node;
  }
  if (find_any(node, {"rotation"}) != nullptr && find_any(node, {"translation"}) != nullptr) {
    const std::size_t depth = path.find("depth");
    const std::size_t color = std::min(path.find("color"), path.find("rgb"));
    if (depth < color && color != std::string::npos) found.extrinsics = &node;
  }
  if (const auto scale = number_at(node, {"depth_scale", "depth_units"}); scale && !found.depth_scale)
    found.depth_scale = scale;
  for (const auto& [key, value] : node.entries) {
    if (value.kind != core::ConfigNode::Kind::kMap) continue;
    find_streams(value, path + "/" + core::lower(key), found);
  }
}

RealSenseStreams realsense_streams(const CameraText& text) {
  RealSenseStreams found;
  if (text.is_map()) find_streams(text.tree, "", found);
  return found;
}

bool recognises_realsense(const CameraText& text) {
  const RealSenseStreams found = realsense_streams(text);
  return found.color != nullptr || found.depth != nullptr;
}

/// Intrinsics of one stream.
std::string take_stream(const core::ConfigNode& node, Lens& lens, Pinhole& pinhole) {
  if (std::string missing = take_pinhole(node, pinhole); !missing.empty()) return missing;
  const core::ConfigNode* coefficients = find_any(node, {"coeffs", "distortion_coeffs", "coefficients"});
  if (coefficients == nullptr) return "";
  const auto d = numbers_in(*coefficients);
  if (!d) return "the distortion coefficients are not numbers";
  return take_coefficients(word_at(node, {"model", "distortion_model"}), *d, lens);
}

/// librealsense writes rotations column by column.
std::string take_extrinsics(const core::ConfigNode& node, Camera& camera) {
  const auto r = numbers_in(*find_any(node, {"rotation"}));
  const auto t = numbers_in(*find_any(node, {"translation"}));
  if (!r || !t || r->size() != 9 || t->size() != 3) return "the extrinsics are not 9 and 3 numbers";
  const Eigen::Matrix3d rotation = Eigen::Map<const Eigen::Matrix3d>(r->data());
  const bool rigid =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3;
  if (!rigid || rotation.determinant() < 0.0) return "the extrinsics are not a rotation";
  camera.color_from_depth =
      geometry::Rigid3(Eigen::Quaterniond(rotation), Eigen::Vector3d((*t)[0], (*t)[1], (*t)[2]));
  return "";
}

bool same_pinhole(const Pinhole& a, const Pinhole& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy;
}

/// Reads a separate depth camera if the file has its pose too. Returns "" or what is wrong.
std::string take_depth_stream(const RealSenseStreams& found, CameraReading& reading) {
  Pinhole depth;
  Lens lens;
  if (std::string wrong = take_stream(*found.depth, lens, depth); !wrong.empty()) return wrong;
  if (same_pinhole(depth, reading.camera.color)) return "";
  if (found.extrinsics == nullptr) {
    reading.notes.emplace_back(
        "depth is assumed to be aligned to colour: the file has no extrinsics depth_to_color");
    return "";
  }
  reading.camera.depth = depth;
  reading.camera.depth_lens = lens;
  return take_extrinsics(*found.extrinsics, reading.camera);
}

core::Result<CameraReading> read_realsense(const CameraText& text) {
  // The colour stream, else the depth stream
  CameraReading reading = blank_reading(text, kRealSenseCamera);
  Camera& camera = reading.camera;
  const RealSenseStreams found = realsense_streams(text);
  const core::ConfigNode& node = found.color != nullptr ? *found.color : *found.depth;
  const auto refuse = [&](const core::ConfigNode& at, const std::string& what) {
    return refuse_camera(text, kRealSenseCamera, at.mark, what, camera);
  };

  // Intrinsics and distortion
  Lens lens;
  if (const std::string wrong = take_stream(node, lens, camera.color); !wrong.empty())
    return refuse(node, wrong);
  camera.model = lens.model;
  camera.distortion = lens.k;
  reading.has_size = camera.color.width > 0 && camera.color.height > 0;

  // RealSense's inverse model is read as OpenCV's
  if (camera.distorted() && has_word(word_at(node, {"model"}), "inverse"))
    reading.notes.emplace_back(
        "coefficients of inverse_brown_conrady taken as OpenCV's, as RealSense's ROS driver does");

  // Depth scale and rate are optional
  if (found.depth_scale && *found.depth_scale > 0.0) {
    camera.depth_scale = units_per_metre(*found.depth_scale);
    reading.has_depth_scale = true;
  }
  if (const auto fps = number_at(node, {"fps"}); fps && *fps > 0.0) camera.fps = *fps;

  // The depth stream may be another camera
  if (found.color == nullptr || found.depth == nullptr) return reading;
  if (const std::string wrong = take_depth_stream(found, reading); !wrong.empty())
    return refuse(*found.depth, wrong);
  return reading;
}

}  // namespace

const CameraFormat kRealSenseCamera = {"RealSense", true, &recognises_realsense, &read_realsense};

}  // namespace plumbline::sensor
