// SPDX-License-Identifier: BSD-3-Clause
// ScanNet's scene*.txt (fx_color = ..., colorWidth = ...) and the _info.txt of its SensReader
// (m_calibrationColorIntrinsic = 16 numbers). Its intrinsic_color.txt is a plain matrix.
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "camera_files/camera_formats.hpp"
#include "camera_files/text_words.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::sensor {
namespace {

using ScanNetKeys = std::map<std::string, std::vector<double>>;

/// "key = numbers" by key; lines of another shape are passed over.
ScanNetKeys scannet_keys(const CameraText& text) {
  ScanNetKeys keys;
  for (const CameraLine& line : camera_text_lines(text.text, " \t\r=")) {
    std::vector<double> numbers;
    for (std::size_t i = 1; i < line.words.size(); ++i) {
      if (const auto number = core::to_number(line.words[i]); number && std::isfinite(*number))
        numbers.push_back(*number);
    }
    keys.emplace(line.words[0], std::move(numbers));
  }
  return keys;
}

bool recognises_scannet(const CameraText& text) {
  if (text.text.find('=') == std::string::npos) return false;
  const ScanNetKeys keys = scannet_keys(text);
  return keys.count("fx_color") > 0 || keys.count("m_calibrationColorIntrinsic") > 0;
}

/// Reads the camera `which`, "color" or "depth". Returns "" or what is wrong.
std::string take_scannet(const ScanNetKeys& keys, const std::string& which, Camera& camera) {
  // A single number of the file
  const auto value = [&](const std::string& key) {
    const auto found = keys.find(key);
    return found == keys.end() || found->second.size() != 1 ? NAN : found->second[0];
  };

  // Two kinds of files name the keys differently
  const std::string capital = which == "color" ? "Color" : "Depth";
  const bool sens = keys.count("m_calibrationColorIntrinsic") > 0;

  if (sens) {
    const auto matrix = keys.find("m_calibration" + capital + "Intrinsic");
    if (matrix == keys.end()) return fmt::format("no m_calibration{}Intrinsic", capital);
    if (std::string wrong = take_matrix(matrix->second, camera); !wrong.empty()) return wrong;
  } else {
    camera.color.fx = value("fx_" + which);
    camera.color.fy = value("fy_" + which);
    camera.color.cx = value("mx_" + which);
    camera.color.cy = value("my_" + which);
  }

  // The size is needed for both cameras
  const double width = value(sens ? "m_" + which + "Width" : which + "Width");
  const double height = value(sens ? "m_" + which + "Height" : which + "Height");
  if (!(width >= 1.0) || !(height >= 1.0) || width > 1e6 || height > 1e6)
    return fmt::format("the size of the {} image is missing", which);
  camera.color.width = static_cast<int>(width);
  camera.color.height = static_cast<int>(height);
  const bool all = std::isfinite(camera.color.fx + camera.color.fy + camera.color.cx + camera.color.cy);
  return all ? "" : fmt::format("some of fx_{0} fy_{0} mx_{0} my_{0} are missing", which);
}

/// ScanNet's colour and depth camera, as if they had one pose.
core::Result<CameraReading> read_scannet(const CameraText& text) {
  CameraReading reading = blank_reading(text, kScanNetCamera);
  const ScanNetKeys keys = scannet_keys(text);
  Camera depth;
  for (const auto& [which, camera] : {std::pair("color", &reading.camera), std::pair("depth", &depth)}) {
    if (const std::string wrong = take_scannet(keys, which, *camera); !wrong.empty())
      return refuse_camera(text, kScanNetCamera, {}, wrong);
  }
  reading.camera.depth = depth.color;
  reading.camera.color_from_depth = geometry::Rigid3();
  reading.camera.depth_scale = 1000.0;
  if (const auto shift = keys.find("m_depthShift"); shift != keys.end() && shift->second.size() == 1)
    reading.camera.depth_scale = shift->second[0];
  reading.has_size = true;
  reading.has_depth_scale = true;
  reading.notes.emplace_back("colour and depth are assumed to have the same pose");
  return reading;
}

}  // namespace

const CameraFormat kScanNetCamera = {"ScanNet", true, &recognises_scannet, &read_scannet};

}  // namespace plumbline::sensor
