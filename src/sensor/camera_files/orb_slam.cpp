// SPDX-License-Identifier: BSD-3-Clause
// Settings of ORB-SLAM2 and ORB-SLAM3: flat keys such as Camera.fx or Camera1.fx, and DepthMapFactor.
#include <fmt/format.h>

#include <string>

#include "camera_files/camera_formats.hpp"

namespace plumbline::sensor {
namespace {

/// "camera." or, in ORB-SLAM3's newer files, "camera1.".
std::string orb_prefix(const CameraText& text) {
  for (const char* prefix : {"camera1.", "camera."}) {
    if (find_any(text.tree, {std::string(prefix) + "fx"}) != nullptr) return prefix;
  }
  return "";
}

bool recognises_orb_slam(const CameraText& text) {
  if (!text.is_map()) return false;
  return !orb_prefix(text).empty() || find_any(text.tree, {"camera.type", "camera.fy"}) != nullptr;
}

/// Coefficients as keys; missing ones are zero.
std::string take_orb_distortion(const CameraText& text, const std::string& prefix, const std::string& model,
                                Camera& camera) {
  std::vector<std::string> names = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  if (model.find("kannala") != std::string::npos) names = {"k1", "k2", "k3", "k4"};
  std::vector<double> numbers;
  for (const std::string& name : names)
    numbers.push_back(number_at(text.tree, {prefix + name}).value_or(0.0));
  return take_coefficients(model, numbers, camera);
}

core::Result<CameraReading> read_orb_slam(const CameraText& text) {
  // Older files say Camera, newer ones Camera1
  CameraReading reading = blank_reading(text, kOrbSlamCamera);
  Camera& camera = reading.camera;
  const std::string prefix = orb_prefix(text).empty() ? "camera." : orb_prefix(text);
  std::string missing;
  const auto need = [&](const char* name, double& value) {
    const auto number = number_at(text.tree, {prefix + name});
    if (!number) missing += fmt::format(" {}{}", prefix == "camera." ? "Camera." : "Camera1.", name);
    value = number.value_or(0.0);
  };

  // All missing numbers are reported together
  need("fx", camera.color.fx);
  need("fy", camera.color.fy);
  need("cx", camera.color.cx);
  need("cy", camera.color.cy);

  // The size is optional
  const auto width = number_at(text.tree, {"camera.width"});
  const auto height = number_at(text.tree, {"camera.height"});
  reading.has_size = width && height;
  if (reading.has_size) {
    camera.color.width = static_cast<int>(*width);
    camera.color.height = static_cast<int>(*height);
  }

  // A depth factor of 0 means 1
  if (const auto fps = number_at(text.tree, {"camera.fps"}); fps && *fps > 0.0) camera.fps = *fps;
  if (const auto factor = number_at(text.tree, {"depthmapfactor", "rgbd.depthmapfactor"})) {
    camera.depth_scale = *factor == 0.0 ? 1.0 : *factor;  // as ORB-SLAM takes it
    reading.has_depth_scale = true;
  }
  if (!missing.empty()) return refuse_camera(text, kOrbSlamCamera, {}, "no number for" + missing, camera);

  // The type of camera decides the distortion
  const std::string model = word_at(text.tree, {"camera.type"});
  if (const std::string wrong = take_orb_distortion(text, prefix, model, camera); !wrong.empty())
    return refuse_camera(text, kOrbSlamCamera, {}, wrong, camera);
  return reading;
}

}  // namespace

const CameraFormat kOrbSlamCamera = {"ORB-SLAM2 or ORB-SLAM3", true, &recognises_orb_slam, &read_orb_slam};

}  // namespace plumbline::sensor
